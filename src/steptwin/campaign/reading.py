"""Reads ``campaign.toml``: its content as values, or all errors in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.campaign.checks import CAMPAIGN, FAULT, MATRIX, MEASURE, PROPERTY, STEP, VARY, CampaignChecks
from steptwin.campaign.description import (
    TIMED,
    CampaignDescription,
    CampaignTable,
    FaultTable,
    MatrixRules,
    Measure,
    NamedProperty,
    PropertyTable,
    StepTable,
    VariedFault,
    VariedStep,
    VaryTable,
)
from steptwin.campaign.properties import read_property
from steptwin.campaign.variation import Between, Choice, Normal, Varied
from steptwin.errors import Misuse
from steptwin.files.textfiles import read_text
from steptwin.files.world import World
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES
from steptwin.simulation.describe.tables import tables
from steptwin.simulation.toml.reader import TomlText, read_table
from steptwin.simulation.toml.table import TableSpec, read_spec

S = TypeVar("S", bound=TableSpec)

LEAST_SHARE = 1e-6
"""Least probability inside the limits of a truncated normal distribution: far out its values cannot be distinguished."""
TABLES: Mapping[str, type[TableSpec]] = {
    CAMPAIGN: CampaignTable,
    VARY: VaryTable,
    FAULT: FaultTable,
    STEP: StepTable,
    PROPERTY: PropertyTable,
    MEASURE: Measure,
    MATRIX: MatrixRules,
}


def load_campaign(path: str | Path) -> CampaignDescription:
    """The campaign that a file describes, with its world. Raises `WorldError` with everything that is wrong with either."""
    place = Path(path)
    text = read_text(place, MOST_DESCRIPTION_BYTES).source.text
    return read_campaign(str(place), text, place.parent)


def read_campaign(name: str, text: str, folder: Path) -> CampaignDescription:
    """As `load_campaign`, of a text whose world lies in a folder."""
    toml = TomlText(name, text, (), (VARY,))
    known = list(TABLES)
    of_world = next((key for key in toml.data if key in tables() and key not in TABLES), None)
    if CAMPAIGN not in toml.data and of_world is not None:
        toml.wrong((of_world,), "D004", "this is a world, not a campaign", 'a campaign names it: [campaign] with world = "FILE"')
        raise toml.error()
    for key in toml.data:
        if key not in known:
            fix = toml.key_replacement((key,) if isinstance(toml.data[key], dict) else (key, 0), key, known)
            toml.wrong((key,), "D004", f"the file has no [{key}]{toml.near(key, known)}", f"permitted: {', '.join(known)}", fix)
    head = read_table(toml, (CAMPAIGN,), toml.data.get(CAMPAIGN, {}), CampaignTable.rows.keys)
    vary = tuple(found for one in _tables(toml, VARY, VaryTable) if (found := _varied(toml, one)) is not None)
    start = head.get("start_ns") or 0
    faults = tuple(
        VariedFault(one.do, start if one.at is None else one.at, one.chance) for one in _tables(toml, FAULT, FaultTable)
    )
    steps = tuple(VariedStep(one.do, start if one.at is None else one.at) for one in _tables(toml, STEP, StepTable))
    measures = tuple(_measures(toml))
    properties = tuple(_properties(toml))
    matrix = read_spec(toml, (MATRIX,), MatrixRules, toml.data.get(MATRIX, {})) or MatrixRules()
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


def _tables(toml: TomlText, kind: str, spec: type[S]) -> Iterator[S]:
    """Each table that has all it needs."""
    given = toml.data.get(kind, [])
    if not isinstance(given, list):
        toml.wrong((kind,), "D002", f"[{kind}] is a single table", f"expected [[{kind}]], for there may be several")
        return
    for n, table in enumerate(given):
        if (found := read_spec(toml, (kind, n), spec, table)) is not None:
            yield found


def _varied(toml: TomlText, one: VaryTable) -> Varied | None:
    spreads = [key for key in ("between", "normal", "choose", "grid") if getattr(one, key) is not None]
    if toml.is_wrong(one.path):
        return None
    name = one.of or one.name
    if name is None or None not in (one.of, one.name):
        toml.wrong(one.path, "D007", "[[vary]] needs one of path and name")
        return None
    if not spreads:
        toml.wrong(one.path, "D007", "[[vary]] needs one of between, normal, choose and grid")
        return None
    try:
        return Varied(name, one.of is not None, _spread(one))
    except Misuse as error:
        toml.wrong((*one.path, spreads[0]), "D003", str(error))
        return None


def _spread(one: VaryTable) -> Between | Normal | Choice:
    between = one.between
    if one.normal is not None:
        mean, deviation, is_time = one.normal
        if between is not None and between[2] is not is_time:
            raise Misuse("between and normal: expected numbers in both, or times")
        low, high = (0.0 if is_time else None, None) if between is None else between[:2]
        found = Normal(mean, deviation, low, high, is_time=is_time)
        if found.share < LEAST_SHARE:
            raise Misuse(f"between = {[low, high]}: next to nothing of this distribution, {found.share:.1g}, is there")
        return found
    if between is not None:
        low, high, is_time = between
        if one.log and low <= 0.0:
            raise Misuse(f"between = {[low, high]}: log needs numbers above 0")
        if one.is_whole and (is_time or low != int(low) or high != int(high)):
            raise Misuse(f"between = {[low, high]}: whole needs whole numbers")
        return Between(low, high, one.log, one.is_whole, is_time, one.levels)
    return Choice(one.choose or one.grid or (), is_grid=one.grid is not None)


def _properties(toml: TomlText) -> Iterable[NamedProperty]:
    names: set[str] = set()
    for one in _tables(toml, PROPERTY, PropertyTable):
        given = {word: text for word in ("holds", *TIMED) if (text := getattr(one, word)) is not None}
        if not given:
            toml.wrong(one.path, "D007", f"[[{PROPERTY}]] needs one of holds, {', '.join(TIMED)}")
            continue
        word = next(iter(given))
        text = given[word] if word == "holds" else f"{word} {given[word]}"
        name = one.name or text
        if name in names:
            toml.wrong((*one.path, "name"), "D006", f"there is a [[{PROPERTY}]] named {name!r} already")
        names.add(name)
        toml.unless_wrong((*one.path, word), partial(read_property, text, name))
        yield NamedProperty(name, text)


def _measures(toml: TomlText) -> Iterable[Measure]:
    names: set[str] = set()
    for one in _tables(toml, MEASURE, Measure):
        if one.name in names:
            toml.wrong((*one.path, "name"), "D006", f"there is a [[measure]] named {one.name!r} already")
        names.add(one.name)
        yield one
