"""Every key of every table: a misspelt one is answered with the right one, a wrong value with what is permitted, at its place."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.describe.steptable import ACTIONS
from steptwin.simulation.describe.tables import all_keys, written
from steptwin.simulation.toml.reader import Key, WorldError

PROBES = (("'?'", "?"), ("[]", []), ("true", True), ("-1", -1), ("1e300", 1e300), ("{ a = 1 }", {"a": 1}))
"""As TOML, and as values."""
KEYS = [(table, key) for table, keys in all_keys().items() for key in keys]


AROUND = {
    "axis": "name = 'x'\ndrive = 'a.M1'\n",
    "shaft": "name = 's'\naxis = 'x'\nratio = 1\n",
    "conveyor": "name = 'b'\nlength = 100\nspeed = 10\n",
    "tool": "name = 't'\naxis = 'x'\nother = 'y'\n",
}
"""Tables with tables in them, which are read when nothing is missing."""
STEP_VALUES = (("'1 s'", "1 s"), ("'start'", "start"), ("'a.M1'", "a.M1"), ("{ 'a.OUT1' = 1 }", {"a.OUT1": 1}))


def header(table: str) -> str:
    """Of a table, after that which it is in."""
    found = written(table)
    outer, dot, _ = found.strip("[]").partition(".")
    return f"[[{outer}]]\n{AROUND[outer]}{found}\n" if dot else f"{found}\n"


def misspelt(name: str, known: set[str]) -> str | None:
    """A typing mistake that makes no other key: the last letter twice."""
    found = name + name[-1]
    return found if len(name) > 3 and found not in known else None


def findings(text: str) -> str:
    with pytest.raises(WorldError) as raised:
        World.from_toml(text, name="t.toml")
    return str(raised.value)


@pytest.mark.parametrize(("table", "key"), KEYS, ids=[f"{table}.{key.name}" for table, key in KEYS])
def test_a_misspelt_key_is_answered_with_the_right_one(table: str, key: Key) -> None:
    wrong = misspelt(key.name, {one.name for one in all_keys()[table]})
    if wrong is None:
        wrong = f"{key.name}_"
    top = header(table)
    found = findings(f"{top}{wrong} = 1\n")
    place = f"t.toml:{top.count(chr(10)) + 1}:1: error D004"
    assert place in found
    (told,) = (line for line in found.splitlines() if place in line)
    assert f"has no {wrong!r}" in told
    assert "did you mean" in told or len(key.name) < 4, told
    assert "permitted: " in found


def refused(key: Key) -> str | None:
    """A value, as TOML, that a key does not take; None for one that is read elsewhere."""
    for text, value in PROBES:
        try:
            key.read(value)
        except Misuse:
            return text
        except (AttributeError, TypeError):
            continue
    return None


@pytest.mark.parametrize(("table", "key"), KEYS, ids=[f"{table}.{key.name}" for table, key in KEYS])
def test_a_wrong_value_has_its_place_and_what_is_permitted(table: str, key: Key) -> None:
    value = refused(key)
    top = header(table)
    if value is None:
        assert key.name == "steps"
        top, value = (f"{top}name = 's'\n", "1")
    found = findings(f"{top}{key.name} = {value}\n")
    at = f"t.toml:{top.count(chr(10)) + 1}:"
    told = "".join(part for part in found.split("t.toml:") if part.startswith(at.removeprefix("t.toml:")))
    assert f"{key.name} " in told or f"{key.name}:" in told or repr(key.name) in told or f".{key.name}" in told, told
    assert any(word in told for word in ("expected", "permitted", "must be", "such as", "there are", "is not")), told


@pytest.mark.parametrize(("step", "key"), [(name, key) for name, action in ACTIONS.items() for key in action.others])
def test_a_misspelt_key_of_a_step(step: str, key: Key) -> None:
    main = ACTIONS[step].main
    value = next(text for text, value in STEP_VALUES if takes(main, value))
    wrong = key.name + key.name[-1]
    found = findings(f"[[script]]\nname = 's'\nsteps = [\n  {{ {step} = {value}, {wrong} = 1 }},\n]\n")
    assert "t.toml:4:" in found
    assert f"has no {wrong!r}" in found
    assert "permitted: " in found


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[axis]]\nname = 'x'\ndrive = 'a.M1'\nlead = 5.0\n", "[axis] has no 'lead' (did you mean 'pitch'?)"),
        ("[[axis]]\nname = 'x'\ndrive = 'a.M1'\nLimits = [0, 1]\n", "[axis] has no 'Limits' (did you mean 'travel'?)"),
        ("[[conveyor]]\nname = 'b'\nlength = 9\nvelocity = 5\n", "[conveyor] has no 'velocity' (did you mean 'speed'?)"),
        ("[[gate]]\nname = 'g'\nkind = 'AND'\ninputs = 2\n", "kind: 'AND' (did you mean 'and'?): permitted are and, or"),
        (
            "[[mic488]]\nname = 'c'\n[[button]]\nname = 'b'\nto = 'c.INN5'\n",
            "t.toml:5:1: error D009: c.INN5 is not a digital input (did you mean 'IN5'?)",
        ),
        (
            "[[mic488]]\nname = 'c'\n[[button]]\nname = 'b'\nto = 'c.IN25'\n",
            "t.toml:5:1: error D009: c.IN25 is not a digital input: digital",
        ),
        ("[[mic488]]\nname = 'c'\n[[axis]]\nname = 'x'\ndrive = 'c.M5'\n", "t.toml:5:1: error D009: drive = 'c.M5': c has M1"),
        ("[[cylinder]]\nname = 'c'\nstroke = '30 mm'\n", "stroke: '30 mm': expected a number, without quotes and unit"),
        ("[[cylinder]]\nname = 'c'\nstroke = 'long'\n", "stroke: 'long': expected a number\n"),
    ],
)
def test_what_newcomers_write(text: str, told: str) -> None:
    assert told in findings(text)


def takes(key: Key, value: object) -> bool:
    try:
        key.read(value)
    except Misuse:
        return False
    return True
