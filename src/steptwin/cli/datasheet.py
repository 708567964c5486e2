"""``steptwin datasheet``: the data sheet of a kind of controllers, or of a controller of a running twin.

From Python: `steptwin.simulation.kinds.kind.ControllerKind.datasheet_of`, and `description` of a subject.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.device import Json, Twin, table
from steptwin.cli.selected import selected
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.datasheet import CommandDescription, Datasheet, Limits, Point


def command(
    kind: Annotated[str | None, typer.Argument(metavar="KIND", help="mic488 or m1486.")] = None,
    variant: Annotated[str | None, typer.Option(help="Firmware of a MIC488, type of an M1486.")] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Show the data sheet of a controller: axes, pins, points with unit and range, commands, events."""
    found = _of_twin(twin, variant) if kind is None else _of_kind(kind, variant, twin)
    if json:
        from json import dumps

        from steptwin.jsonvalues import to_json

        typer.echo(dumps(to_json(found), ensure_ascii=False, indent=2))  # ranges are exact, not REAL
    else:
        typer.echo("\n\n".join(_sections(found)))


def _of_kind(name: str, variant: str | None, twin: str | None) -> Datasheet:
    from steptwin.simulation.kinds.registry import KINDS

    if twin is not None:
        raise Misuse("KIND and --device exclude each other")
    if name not in KINDS:
        raise Misuse(f"no kind of controllers is called {name!r}: there are {', '.join(KINDS)}")
    return KINDS[name].datasheet_of(variant)


def _of_twin(twin: str | None, variant: str | None) -> Datasheet:
    if variant is not None:
        raise Misuse("--variant is for a KIND: a controller of a twin has one already")
    with selected(twin) as there:
        name = there.one()
        return next(part.datasheet for part in there.subject.description.controllers if part.name == name)


def _sections(sheet: Datasheet) -> Iterator[str]:
    yield " ".join(filter(None, (sheet.title, sheet.variant)))
    axes = [(axis.name, axis.unit, f"{axis.pulses_per_unit:g}") for axis in sheet.axes]
    yield _section("axes", ("name", "unit", "pulses per unit"), axes)
    pins = [(pin.name, pin.direction.value, f"{_range(pin.limits)} {pin.unit}".rstrip()) for pin in sheet.pins]
    yield _section("pins", ("name", "direction", "levels"), pins)
    yield _section("points", ("name", "access", "address", "unit", "permitted", "meaning"), map(_point, sheet.points))
    yield _section("commands", ("code", "argument", "effect", "meaning"), map(_command, sheet.commands))
    events = [(event.code, ", ".join(fact.name for fact in event.facts), event.meaning) for event in sheet.events]
    yield _section("events", ("code", "fields", "meaning"), events)


def _section(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return f"{title}\n{table(list(rows), head)}"


def _point(point: Point) -> tuple[str, ...]:
    values = ", ".join(f"{value} {text}" for value, text in point.values.items())
    return (
        point.path,
        point.access.value,
        ", ".join(dict.fromkeys(f"{address.space} {address.place}" for address in point.addresses)),
        point.unit,
        _range(point.limits),
        f"{point.meaning} ({values})" if values else point.meaning,
    )


def _command(command: CommandDescription) -> tuple[str, ...]:
    arguments = [f"{_range(one.limits) or _numbers(one.values)} {one.unit}".strip() for one in command.arguments]
    return command.code, ", ".join(arguments), command.effect.value, command.meaning


def _numbers(values: Sequence[Any]) -> str:
    return " ".join(map(str, values))


def _range(limits: Limits | None) -> str:
    if limits is None or (limits.low is None and limits.high is None):
        return ""
    if limits.high is None:
        return f"{'>' if limits.is_low_excluded else '≥'} {limits.low:g}"
    return f"≤ {limits.high:.10g}" if limits.low is None else f"{limits.low:.10g}…{limits.high:.10g}"
