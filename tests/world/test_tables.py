"""Every key of a description and of a step, its default, what it refuses and what it needs, reviewed once: golden/tables.txt.

Regenerate with ``python tests/world/test_tables.py`` and read the diff.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.world.description import read_world
from steptwin.world.gateways import GATEWAYS
from steptwin.world.reader import Key
from steptwin.world.sense import TableRows
from steptwin.world.steptable import ACTIONS, REPEAT, STEPS
from steptwin.world.tables import tables, written_tables

GOLDEN = Path(__file__).parent / "golden" / "tables.txt"
PROBES: tuple[object, ...] = (None, -(10**30), 10**30, "?", "", [], 0, -1, True)
"""No key takes all of these; what is said of those it refuses has its range in it."""


def answer(key: Key, value: object) -> str:
    try:
        return f"= {key.read(value)!r}"
    except (Misuse, AttributeError, TypeError) as error:
        return str(error).replace(repr(value), "…", 1).removeprefix("…: ")


def described(table: str, keys: Iterable[Key]) -> list[str]:
    lines = []
    for key in keys:
        default = "required" if key.is_required else f"default {key.default!r}"
        lines += [f"{table}.{key.name} {key.attribute} | {default} | {key.permitted} | {key.meaning}"]
        answers: dict[str, list[str]] = {}
        for value in PROBES:
            answers.setdefault(answer(key, value), []).append(repr(value).replace("1" + 30 * "0", "10^30"))
        lines += [f"    {', '.join(values)}: {text}" for text, values in answers.items()]
    return lines


def ruled(rows: TableRows) -> list[str]:
    """Which of its keys need or exclude each other, and which only some kinds have."""
    need = [f"    {key} needs {other}" for key, other in rows.need.items()]
    exclude = [f"    {one} excludes {other}" for one, other in rows.exclude]
    only = [f"    {key} only of {', '.join(kinds)}" for key, kinds in rows.only.items()]
    return [*need, *exclude, *only]


def everything() -> dict[str, list[str]]:
    found = {rows.written: [*ruled(rows), *described(name, rows.keys)] for name, rows in {**tables(), **GATEWAYS}.items()}
    inner = {name: described(name, keys) for name, keys in written_tables().items() if name not in found}
    steps = [line for name, action in ACTIONS.items() for line in described(f"{{{name}}}", (action.main, *action.others))]
    return found | inner | {"step": [*steps, *described("{repeat}", (REPEAT, STEPS))]}


@pytest.mark.parametrize("table", [*written_tables(), "step"])
def test_keys_are_the_reviewed_ones(table: str) -> None:
    texts = GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]
    expected = {name: lines for name, *lines in (text.rstrip().splitlines() for text in texts)}
    assert expected.keys() == everything().keys()
    assert everything()[table] == expected[table]


@pytest.mark.parametrize("table", [*written_tables(), "step"])
def test_each_key_says_what_it_means_and_what_is_permitted(table: str) -> None:
    steps = [key for action in ACTIONS.values() for key in (action.main, *action.others)]
    for key in written_tables().get(table, steps):
        assert key.meaning, key.name
        assert key.permitted, key.name


@pytest.mark.parametrize(("gap", "gap_ns"), [("'0.001 us'", 1), ("1e-6", 1), ("1.5", 1_500_000), ("10000", 10**10)])
def test_the_gap_of_a_line_may_be_as_short_as_a_nanosecond(gap: str, gap_ns: int) -> None:
    spec = read_world("w", f'[[line]]\nname = "bus"\ngap = {gap}\n[[mic488]]\nname = "a"\nline = "bus"\n')
    assert [line.gap for line in spec.lines] == [gap_ns]


def test_axes_and_inputs_of_controllers_are_among_the_tables() -> None:
    tables = {name: {key.name: key for key in keys} for name, keys in written_tables().items()}
    velocity = tables["[mic488.M1] to [mic488.M4]"]["vel"]
    assert (velocity.meaning, velocity.permitted) == ("velocity, u/s", "a number > 0 in units/s")
    assert tables["[mic488.IN1] to [mic488.IN20]"]["filter"].permitted.startswith("10 ms (0), 50 ms (1)")
    assert "[gateway.modbus]" in tables


if __name__ == "__main__":
    GOLDEN.write_text("\n".join("\n".join([f"=== {name}", *lines]) for name, lines in everything().items()) + "\n", "utf-8")
