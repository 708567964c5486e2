"""Reads ``campaign.toml``: its content as values, or all errors in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.campaign.checks import CAMPAIGN, FAULT, MATRIX, MEASURE, PROPERTY, STEP, VARY, CampaignChecks
from steptwin.campaign.description import (
    DESIGNS,
    SEARCHES,
    CampaignDescription,
    MatrixRules,
    Measure,
    NamedProperty,
    VariedFault,
    VariedStep,
    step_text,
)
from steptwin.campaign.properties import read_property
from steptwin.campaign.variation import MOST_LEVELS, Between, Choice, Normal, Varied
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.files.textfiles import read_text
from steptwin.files.world import World
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES
from steptwin.machine import SECOND, Nanos
from steptwin.simulation.describe.tables import SEED, tables
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.toml.reader import Key, TomlText, optional, read_table
from steptwin.simulation.toml.table import TableRows, check_sense
from steptwin.simulation.toml.tomlplaces import Path as TomlPath
from steptwin.simulation.toml.values import flag, name_value, number, positive_time, text_value, whole, word

MOST_RUNS = 1_000_000_000
MOST_PHASES = 1000
LEAST_SHARE = 1e-6
"""Least probability inside the limits of a truncated normal distribution: far out its values cannot be distinguished."""


def _condition(value: Any) -> str:
    parse_condition(text_value(value))
    return value


def _list(value: Any) -> tuple[Any, ...]:
    if not isinstance(value, list) or not value or any(not isinstance(item, bool | int | float | str) for item in value):
        raise Misuse(f"{value!r}: expected a list of numbers, texts or truth values")
    for item in value:
        if isinstance(item, int | float) and not isinstance(item, bool):
            number()(item)  # neither nan nor beyond what is permitted
    return tuple(value)


def _number_or_time(value: Any) -> tuple[float, bool]:
    """A number, or seconds and whether it is a time."""
    return (duration(value) / SECOND, True) if isinstance(value, str) else (number()(value), False)


def _ends(value: Any) -> tuple[float, float, bool]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [low, high], such as [0.1, 0.4] or ['0 s', '2 s']")
    (low, is_time), (high, also) = map(_number_or_time, value)
    if is_time is not also:
        raise Misuse(f"{value!r}: expected two numbers or two times")
    if low >= high:
        raise Misuse(f"{value!r}: the first must be below the second")
    return low, high, is_time


def _normal(value: Any) -> tuple[float, float, bool]:
    if not isinstance(value, Mapping) or set(value) != {"mean", "deviation"}:
        raise Misuse(f"{value!r}: expected {{ mean = NUMBER, deviation = NUMBER }}")
    (mean, is_time), (deviation, also) = _number_or_time(value["mean"]), _number_or_time(value["deviation"])
    if is_time is not also:
        raise Misuse(f"{value!r}: expected two numbers or two times")
    if deviation <= 0:
        raise Misuse(f"deviation = {value['deviation']!r}: must be more than 0")
    return mean, deviation, is_time


def _moment(value: Any) -> Nanos | str:
    """A time, or the name of one that varies."""
    try:
        return duration(value)
    except Misuse:
        if not isinstance(value, str) or not value[:1].isalpha():
            raise
        return name_value(value)


def _table(value: Any) -> str:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected a step of a script, such as {{ press = 'start' }}")
    return step_text(value)


TIMED = ("always", "never", "eventually", "after")
"""Keys of properties that are their first words."""

ROWS: Mapping[str, TableRows] = {
    CAMPAIGN: TableRows(
        written=f"[{CAMPAIGN}]",
        keys=(
            Key("world", text_value, "the description of the world, beside this file"),
            Key("end", positive_time, "the virtual time of a run", attribute="end_ns"),
            optional(text_value, "name", "for people; default that of the file"),
            optional(whole(1, MOST_RUNS), "runs", "how many; default as many as the grid has"),
            optional(positive_time, "time", "of the clock on the wall: no run begins later", attribute="time_ns"),
            optional(flag, "until_failure", "end after the first run that fails", False),
            optional(SEED, "seed", "where all chance comes from", 0),
            optional(word(*DESIGNS), "design", "how values are drawn", DESIGNS[0]),
            optional(word(*SEARCHES), "search", "how cases are chosen", SEARCHES[0]),
            optional(_condition, "until", "a condition that ends a run earlier"),
            optional(positive_time, "start", "the end of the beginning that all runs have in common", attribute="start_ns"),
            optional(flag, "expectations", "whether a run fails where a script expects or waits for something in vain", True),
            optional(text_value, "database", "of the results: postgresql://HOST/NAME; default a file beside the results"),
        ),
    ),
    VARY: TableRows(
        written=f"[[{VARY}]]",
        keys=(
            optional(text_value, "path", "of a value of the world, as --with has it"),
            optional(name_value, "name", "a name that other tables refer to as {name}"),
            optional(_ends, "between", "[low, high], numbers or times"),
            optional(_normal, "normal", "{ mean = NUMBER, deviation = NUMBER }; between cuts it off"),
            optional(_list, "choose", "a list of values, one of which is drawn"),
            optional(_list, "grid", "a list of values, each with each of other grids"),
            optional(flag, "log", "between: uniform in the logarithm", False),
            optional(flag, "whole", "between: whole numbers", False),
            optional(whole(2, MOST_LEVELS), "levels", "between: so many equidistant values, for the design grid", 0),
        ),
        need={"log": "between", "whole": "between", "levels": "between"},
        exclude=(
            ("path", "name"), ("choose", "grid"), ("between", "choose"), ("between", "grid"), ("normal", "choose"),
            ("normal", "grid"), ("normal", "log"), ("normal", "whole"), ("normal", "levels"), ("log", "whole"),
        ),
    ),
    FAULT: TableRows(
        written=f"[[{FAULT}]]",
        keys=(
            Key("do", text_value, "KIND NAME=VALUE ..., with {name} for what varies ('steptwin fault --kinds')"),
            optional(_moment, "at", "a moment, or the name of a time that varies; default where runs begin to vary"),
            optional(number(0.0, 1.0, above=True), "chance", "of being there", 1.0),
        ),
    ),
    STEP: TableRows(
        written=f"[[{STEP}]]",
        keys=(
            Key("do", _table, "a step of a script, such as { press = 'start' }, with '{name}' for what varies"),
            optional(_moment, "at", "a moment, or the name of a time that varies; default where runs begin to vary"),
        ),
    ),
    PROPERTY: TableRows(
        written=f"[[{PROPERTY}]]",
        keys=(
            optional(text_value, "name", "for people; default the property as it is written"),
            optional(text_value, "holds", "a property, or a ready one by its name, such as 'no-collision'"),
            optional(text_value, "always", "what holds at every moment, such as 'x.position < 300'"),
            optional(text_value, "never", "what holds at no moment"),
            optional(text_value, "eventually", "what comes true in the run, such as 'within 2 s x.position > 100'"),
            optional(text_value, "after", "what follows, such as 'stop.pressed within 300 ms not table.M1.moving'"),
        ),
        exclude=tuple(combinations(("holds", *TIMED), 2)),
    ),
    MEASURE: TableRows(
        written=f"[[{MEASURE}]]",
        keys=(
            Key("name", text_value, "for people"),
            optional(text_value, "value", "a signal, read at the end of a run"),
            optional(_condition, "when", "a condition: the moment at which it comes true first, s"),
        ),
        exclude=(("value", "when"),),
    ),
    MATRIX: TableRows(
        written=f"[{MATRIX}]",
        keys=(
            optional(_condition, "done", "true at the end of a run that made its parts; default: it ends as without a fault"),
            optional(_condition, "alarm", "how the machine says that it noticed something"),
            optional(whole(1, MOST_PHASES), "phases", "how many of the cycle are tried at most"),
            optional(_list, "product", "names of properties whose failure is a wrong part, not a danger", ()),
        ),
    ),
}  # fmt: skip
"""Keys that the tables may contain."""


def load_campaign(path: str | Path) -> CampaignDescription:
    """The campaign that a file describes, with its world. Raises `WorldError` with everything that is wrong with either."""
    place = Path(path)
    text = read_text(place, MOST_DESCRIPTION_BYTES).source.text
    return read_campaign(str(place), text, place.parent)


def read_campaign(name: str, text: str, folder: Path) -> CampaignDescription:
    """As `load_campaign`, of a text whose world lies in a folder."""
    toml = TomlText(name, text, (), (VARY,))
    known = list(ROWS)
    of_world = next((key for key in toml.data if key in tables() and key not in ROWS), None)
    if CAMPAIGN not in toml.data and of_world is not None:
        toml.wrong((of_world,), "D004", "this is a world, not a campaign", 'a campaign names it: [campaign] with world = "FILE"')
        raise toml.error()
    for key in toml.data:
        if key not in known:
            fix = toml.key_replacement((key,) if isinstance(toml.data[key], dict) else (key, 0), key, known)
            toml.wrong((key,), "D004", f"the file has no [{key}]{toml.near(key, known)}", f"permitted: {', '.join(known)}", fix)
    head = read_table(toml, (CAMPAIGN,), toml.data.get(CAMPAIGN, {}), ROWS[CAMPAIGN].keys)
    vary = tuple(found for row in _rows(toml, VARY) if (found := _varied(toml, row)) is not None)
    start = head.get("start_ns") or 0
    faults = tuple(VariedFault(row["do"], _at(row, start), row["chance"]) for row in _rows(toml, FAULT))
    steps = tuple(VariedStep(row["do"], _at(row, start)) for row in _rows(toml, STEP))
    measures = tuple(_measures(toml))
    properties = tuple(_properties(toml))
    matrix = MatrixRules(**read_table(toml, (MATRIX,), toml.data.get(MATRIX, {}), ROWS[MATRIX].keys))
    checks = CampaignChecks(toml, head, vary)
    checks.check_names(faults, steps)
    checks.check_head()
    if "world" not in head or toml.findings:
        raise toml.error()
    with World.load(folder / head["world"], keep_trace=False, keep_inputs=False) as world:
        text_of_world, files = world.spec.text.source.text, dict(world.files)
        checks.read_files((folder / head["world"]).parent, files)
        checks.check_in(world, files, faults, steps, measures)
        checks.check_properties(world, properties)
        for key, condition in (("done", matrix.done), ("alarm", matrix.alarm)):
            if condition is not None:
                toml.unless_wrong((MATRIX, key), partial(world.condition, condition))
    toml.check()
    named: dict[str, Any] = {**head, "name": head["name"] or Path(name).stem, "world": str(folder / head["world"])}
    return CampaignDescription(
        **named,
        text=text_of_world,
        files=files,
        vary=vary,
        faults=faults,
        steps=steps,
        properties=properties,
        measures=measures,
        matrix=matrix,
    )


def _rows(toml: TomlText, kind: str) -> Iterable[dict[str, Any]]:
    """The values of each table that has all it needs."""
    rows, given = ROWS[kind], toml.data.get(kind, [])
    if not isinstance(given, list):
        toml.wrong((kind,), "D002", f"[{kind}] stands once", f"expected [[{kind}]], for there may be several")
        return
    for n, table in enumerate(given):
        values = read_table(toml, (kind, n), table, rows.keys)
        if all((key.attribute or key.name) in values for key in rows.keys):
            check_sense(toml, (kind, n), rows, table)
            yield {**values, "place": (kind, n)}


def _at(row: Mapping[str, Any], start: Nanos) -> Nanos | str:
    return start if row["at"] is None else row["at"]


def _varied(toml: TomlText, row: Mapping[str, Any]) -> Varied | None:
    place: TomlPath = row["place"]
    spreads = [key for key in ("between", "normal", "choose", "grid") if row[key] is not None]
    if toml.is_wrong(place):
        return None
    if (row["path"] is None) is (row["name"] is None):
        toml.wrong(place, "D007", "[[vary]] needs one of path and name")
        return None
    if not spreads:
        toml.wrong(place, "D007", "[[vary]] needs one of between, normal, choose and grid")
        return None
    try:
        return Varied(row["path"] or row["name"], row["path"] is not None, _spread(row))
    except Misuse as error:
        toml.wrong((*place, spreads[0]), "D003", str(error))
        return None


def _spread(row: Mapping[str, Any]) -> Between | Normal | Choice:
    between = row["between"]
    if row["normal"] is not None:
        mean, deviation, is_time = row["normal"]
        if between is not None and between[2] is not is_time:
            raise Misuse("between and normal: expected numbers in both, or times")
        low, high = (0.0 if is_time else None, None) if between is None else between[:2]
        found = Normal(mean, deviation, low, high, is_time=is_time)
        if found.share < LEAST_SHARE:
            raise Misuse(f"between = {[low, high]}: next to nothing of this distribution, {found.share:.1g}, is there")
        return found
    if between is not None:
        low, high, is_time = between
        if row["log"] and low <= 0.0:
            raise Misuse(f"between = {[low, high]}: log needs numbers above 0")
        if row["whole"] and (is_time or low != int(low) or high != int(high)):
            raise Misuse(f"between = {[low, high]}: whole needs whole numbers")
        return Between(low, high, row["log"], row["whole"], is_time, row["levels"])
    return Choice(row["choose"] or row["grid"], is_grid=row["grid"] is not None)


def _properties(toml: TomlText) -> Iterable[NamedProperty]:
    names: set[str] = set()
    for row in _rows(toml, PROPERTY):
        given = [key for key in ("holds", *TIMED) if row[key] is not None]
        if not given:
            toml.wrong(row["place"], "D007", f"[[{PROPERTY}]] needs one of holds, {', '.join(TIMED)}")
            continue
        (word,) = given[:1]
        text = row[word] if word == "holds" else f"{word} {row[word]}"
        name = row["name"] or text
        if name in names:
            toml.wrong((*row["place"], "name"), "D006", f"there is a [[{PROPERTY}]] named {name!r} already")
        names.add(name)
        toml.unless_wrong((*row["place"], word), partial(read_property, text, name))
        yield NamedProperty(name, text)


def _measures(toml: TomlText) -> Iterable[Measure]:
    names: set[str] = set()
    for row in _rows(toml, MEASURE):
        if (row["value"] is None) is (row["when"] is None):
            toml.wrong(row["place"], "D007", "[[measure]] needs one of value and when")
        if row["name"] in names:
            toml.wrong((*row["place"], "name"), "D006", f"there is a [[measure]] named {row['name']!r} already")
        names.add(row["name"])
        yield Measure(row["name"], row["value"], row["when"])
