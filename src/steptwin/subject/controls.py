"""Which commands a controller takes, and with which arguments: from the table of commands and its data sheet."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import get_args

from steptwin.datasheet import Argument, AxisDescription, Datasheet, FactType, Limits
from steptwin.fields import Field
from steptwin.simulation.script.command import UNITS
from steptwin.simulation.script.control import ControllerCommand
from steptwin.subject.commands import COMMANDS, Command

_TYPES = {"integer": FactType.WHOLE.value, "number": FactType.NUMBER.value, "boolean": FactType.TRUTH.value}
"""By the types of JSON Schema."""


@dataclass(frozen=True, slots=True)
class ControlDescription:
    """A command for controllers (`steptwin.simulation.script.control`) that one takes."""

    command: str
    axis: int | None
    """For which axis; None: for the whole controller."""
    arguments: tuple[Argument, ...]
    """Besides controller and axis, in the unit of the axis."""


def controls_of(sheet: Datasheet, kinds: Iterable[type[Command]]) -> tuple[ControlDescription, ...]:
    """Those among ``kinds`` that are commands for controllers, for each axis."""
    wanted = {kind for kind in kinds if kind in get_args(ControllerCommand)}
    found: list[ControlDescription] = []
    for row in COMMANDS.values():
        if row.kind not in wanted:
            continue
        own = [field for field in row.fields if field.name not in ("controller", "axis")]
        axis = next((field for field in row.fields if field.name == "axis"), None)
        if axis is not None:
            found += [ControlDescription(row.name, each.number, _arguments(own, each, sheet)) for each in sheet.axes]
        if axis is None or not axis.is_required:
            found.append(ControlDescription(row.name, None, _arguments(own, None, sheet)))
    return tuple(found)


def _arguments(fields: Iterable[Field], axis: AxisDescription | None, sheet: Datasheet) -> tuple[Argument, ...]:
    return tuple(_argument(field, axis, sheet) for field in fields)


def _argument(field: Field, axis: AxisDescription | None, sheet: Datasheet) -> Argument:
    words = list(sheet.program_actions) if field.name == "action" else field.form.schema.get("enum")
    return Argument(
        name=field.name,
        type=_TYPES.get(str(field.form.schema.get("type")), FactType.TEXT.value),
        unit=field.unit if axis is None else field.unit.replace(UNITS, axis.unit),
        limits=None if axis is None else _limits(field.name, axis),
        values=tuple(map(str, words)) if isinstance(words, list) else (),
        is_optional=not field.is_required,
    )


def _limits(name: str, axis: AxisDescription) -> Limits | None:
    return {"to": axis.positions, "by": axis.distances, "velocity": axis.velocities}.get(name)
