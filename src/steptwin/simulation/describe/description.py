"""Reads the TOML file of a world: its content as values, or all errors in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from steptwin.errors import Misuse
from steptwin.simulation.components.element import AnyElement
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.arrangement import DRAWING, DrawingSpec, DrawnPosition, check_drawing
from steptwin.simulation.describe.includes import PARAMETERS, USE, Includes, ReadFile, is_include, no_files
from steptwin.simulation.describe.mounts import check_mounts
from steptwin.simulation.describe.overrides import NO_OVERRIDES, Overrides, override
from steptwin.simulation.describe.servicetables import SERVICE_TABLES, SERVICES
from steptwin.simulation.describe.spec import SEED, EventSpec, ScriptSpec, WorldSpec, WorldTable
from steptwin.simulation.describe.steptable import STEPS, read_steps
from steptwin.simulation.describe.tables import tables
from steptwin.simulation.faults import Fault, FaultMistake, parse
from steptwin.simulation.kinds.links import LINK_KEYS, LineSpec
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.names import RESERVED
from steptwin.simulation.toml.reader import TomlText, read_table
from steptwin.simulation.toml.table import TableSpec, check_cross_fields, make_spec, read_row

CAMPAIGN = "campaign"
"""The table that only a campaign has (`steptwin.campaign`)."""


def read_world(
    name: str, text: str, seed: int | None = None, overrides: Overrides = NO_OVERRIDES, read: ReadFile = no_files
) -> WorldSpec:
    """The world that a TOML text called ``name`` describes. Raises `WorldError` with everything that is wrong with it.

    ``seed`` and ``overrides`` replace values of the text; `Misuse` for what is no seed, or is not there to be replaced. ``read``
    gives the content of files of tables that it uses.
    """
    spec = describe(name, text, seed, overrides, read)
    spec.text.check()
    return spec


def describe(
    name: str, text: str, seed: int | None = None, overrides: Overrides = NO_OVERRIDES, read: ReadFile = no_files
) -> WorldSpec:
    """As `read_world`, but raises `WorldError` only for text that is not TOML. Other errors are kept in ``text`` of the result,
    because building the world may find more."""
    named = ("line", *(element.name for element in ELEMENTS.values() if element.needs_name))
    toml = TomlText(name, text, tuple(KINDS), named)
    data = toml.data
    if is_include(toml):
        toml.wrong((PARAMETERS,), "D004", "a file with [parameters] is for [[use]] of a description")
        raise toml.error()
    if CAMPAIGN in data:
        toml.wrong((CAMPAIGN,), "D004", "this is a campaign, not a world", "steptwin campaign run checks it and runs its world")
        raise toml.error()
    late = override(data, overrides, USE)
    includes = Includes(read, tables(), toml.controllers, named)
    includes.put_into(toml)
    override(data, late)
    inner = {key for element in ELEMENTS.values() for key in element.inner}
    known = list(dict.fromkeys([*(key for key in tables() if key not in inner), "fault", *SERVICES]))
    for key in data:
        if key not in known:
            near = toml.near(key, known)
            fix = toml.key_replacement((key,) if isinstance(data[key], dict) else (key, 0), key, known)
            toml.wrong((key,), "D004", f"the file has no [{key}]{near}", f"permitted: {', '.join(known)}", fix)
            toml.leave_out_all(key)
    placed = [make_spec(toml, DrawingSpec, row, table) for row, table in _tables(toml, DRAWING)]
    world = read_table(toml, ("world",), data.get("world", {}), WorldTable.rows.keys)
    spec = WorldSpec(
        **world,
        lines=tuple(_lines(toml)),
        controllers=tuple(
            make_spec(toml, kind.spec, row | {"kind": kind}, table)
            for kind in KINDS.values()
            for row, table in _tables(toml, kind.name)
        ),
        elements=ElementSpecs({element.name: tuple(_elements(toml, element)) for element in ELEMENTS.values()}),
        scripts=(*_scripts(toml, "event", EventSpec), *_scripts(toml, "script", ScriptSpec)),
        drawing=tuple(DrawnPosition(one.of, *one.at) for one in placed),
        faults=tuple(_faults(toml)),
        text=toml,
        overrides=dict(overrides),
        includes=includes.files,
    )
    for service in SERVICE_TABLES.values():
        service.check(toml)
    named_elements = [one for element in ELEMENTS.values() for one in element.named(spec.elements[element.name])]
    _check_names(spec, named_elements)
    check_mounts(toml, spec.elements, (*spec.lines, *spec.controllers, *named_elements))
    check_drawing(toml, placed, [one.name for one in named_elements])
    return spec if seed is None else replace(spec, seed=_seed(seed))


def _seed(value: object) -> int:
    try:
        return SEED(value)
    except Misuse as error:
        raise Misuse(f"seed {error}") from None


def _tables(toml: TomlText, kind: str) -> list[tuple[dict[str, Any], Mapping[str, Any]]]:
    """Values of every ``[[kind]]`` that has all it needs, and the table itself."""
    found: list[tuple[dict[str, Any], Mapping[str, Any]]] = []
    given = toml.data.get(kind)
    if given is None:
        return found
    rows = tables()[kind]
    if not isinstance(given, list):
        toml.stands_once(kind)
        given = []
    names: set[str] = set()
    for number_, table in enumerate(given):
        path = (kind, number_)
        values = read_row(toml, path, rows, table)
        if values is None:
            continue
        check_cross_fields(toml, path, rows, table)
        if values.get("name") and values["name"] in names:
            toml.wrong((*path, "name"), "D006", f"there is a [[{kind}]] named {values['name']!r} already")
        names.add(values.get("name", ""))
        found.append((values | {"path": path}, table))
    return found


def _elements(toml: TomlText, element: AnyElement) -> Iterator[TableSpec]:
    for row, table in _tables(toml, element.name):
        yield make_spec(toml, element.spec, row, table)


def _lines(toml: TomlText) -> Iterator[LineSpec]:
    for row, table in _tables(toml, "line"):
        links = {name: row.pop(name) for name in LINK_KEYS}
        row["links"] = {name: value for name, value in links.items() if value is not None}
        yield make_spec(toml, LineSpec, row, table)


def _scripts(toml: TomlText, kind: str, spec: type[ScriptSpec]) -> Iterator[ScriptSpec]:
    for row, table in _tables(toml, kind):
        path = row["path"]
        row["name"] = row["name"] or f"{kind}-{path[1] + 1}"
        row[STEPS.name] = read_steps(toml, (*path, STEPS.name), row[STEPS.name])
        yield make_spec(toml, spec, row, table)


def _faults(toml: TomlText) -> list[Fault | None]:
    """One for each table; None for one that is wrong."""
    found: list[Fault | None] = []
    tables = toml.data.get("fault", [])
    if not isinstance(tables, list):
        toml.stands_once("fault")
        tables = []
    for n, table in enumerate(tables):
        if not isinstance(table, Mapping):
            toml.wrong(("fault", n), "D002", f"[[fault]] is {table!r}", "expected a table")
            found.append(None)
            continue
        try:
            found.append(parse(table, "[[fault]]"))
        except FaultMistake as error:
            toml.wrong(("fault", n, error.key), "D003", str(error))
            found.append(None)
    return found


def _check_names(spec: WorldSpec, elements: Iterable[NamedSpec]) -> None:
    """Report names of lines, controllers and elements that hide each other. The command line ignores case."""
    text = spec.text
    taken: dict[str, str] = {}
    for one in (*spec.lines, *spec.controllers, *elements):
        path = (*one.path, "name")
        kind = one.path[0]
        key = one.name.lower()
        owner = f"[[{kind}]] {one.name!r}"
        if key in RESERVED:
            text.wrong(path, "D006", f"{one.name!r} is {RESERVED[key]}: choose another name")
        elif key in taken and taken[key] != owner:  # this one is reported already
            text.wrong(path, "D006", f"{one.name!r} is taken by {taken[key]}", "upper and lower case are the same here")
        taken.setdefault(key, owner)
