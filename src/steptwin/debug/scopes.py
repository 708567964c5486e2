"""The values of a controller in groups, for people: variables, axes, pins, controller, registers; and what a name means."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from steptwin.controllerstate import StateAxis, StateStatus, detail_text
from steptwin.datasheet import Access
from steptwin.debug.calculation import ResolvedExpression, number_text
from steptwin.debug.values import FormattedValue, Scope
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motioncontroller import MotionController
from steptwin.points import LivePoint
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.script.steps import Set, Write
from steptwin.simulation.world.inputs import ExternalInput, SetVariable
from steptwin.simulation.world.simulation import Simulation
from steptwin.subject.debugcommands import SCOPES

VARIABLES, AXES, PINS, CONTROLLER, REGISTERS, PARTS = SCOPES


UNKNOWN_GROUP = Message("debug.unknown-group", "no group of values is called {name!r}: there are {names}")


def scope(world: Simulation, controller: str, name: str) -> Scope:
    """One of `SCOPES` of a controller, at the present moment of its world. Raises `Misuse`."""
    world.sync(controller)
    if name not in SCOPES:
        raise Misuse(UNKNOWN_GROUP(name=name, names=list(SCOPES)))
    return Scope(
        name, [value._replace(expression=_expression(world, controller, value)) for value in _VALUES[name](world, controller)]
    )


def _expression(world: Simulation, controller: str, value: FormattedValue) -> str:
    """Expression of a value: its name, or what follows the name of the axis where a controller has but one."""
    _, _, last = value.name.partition(".")
    for text in (value.name, last):
        with suppress(Misuse):
            found = ResolvedExpression(world, controller, text).value(world.now)
            if value.number is None or found == value.number:
                return text
    return ""


def _variables(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    for name, value in world.programs_of(controller).variables(world.now).items():
        yield FormattedValue(name, number_text(value), value, is_settable=True)


def _axes(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    for axis in world.state_of(controller).axes:
        yield from _axis(axis)


def _axis(axis: StateAxis) -> Iterator[FormattedValue]:
    yield _measured(f"{axis.name}.position", axis.position, axis.unit)
    yield _measured(f"{axis.name}.velocity", axis.velocity, f"{axis.unit}/s")
    moves = "" if axis.moving is None else "moves" if axis.moving else "at rest"
    yield _status(f"{axis.name}.status", axis.status, f", {moves}" if moves not in ("", axis.status.text) else "")


def _status(name: str, status: StateStatus, more: str = "") -> FormattedValue:
    return FormattedValue(name, f"{status.text}{more}", None if status.code is None else float(status.code))


def _measured(name: str, value: float | None, unit: str) -> FormattedValue:
    return (
        FormattedValue(name, "not known")
        if value is None
        else FormattedValue(name, f"{number_text(value)} {unit}".rstrip(), value)
    )


def _pins(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    kind, device = world.kind(controller), world.controller(controller)
    units = {name: pin.unit for name, pin in kind.pins(device).items()}
    inputs = {*kind.terminals.digital_inputs, *kind.terminals.analog_inputs}
    for name, level in kind.state.pins(device, world.now).items():
        yield FormattedValue(name, f"{number_text(level)} {units.get(name, '')}".rstrip(), level, is_settable=name in inputs)


def _controller(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    state = world.state_of(controller)
    yield FormattedValue("time", f"{world.now / 1e9:.9f} s", world.now / 1e9)
    yield _status("status", state.status)
    yield FormattedValue("program", state.program.text)
    for name, detail in state.details.items():
        yield FormattedValue(name, detail_text(detail))


def _registers(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    kind, device = world.kind(controller), world.controller(controller)
    for point in kind.datasheet(device).points:
        live = _live(kind, device, point.path)
        if live is not None and live.read is not None:
            value = float(live.read(world.now))
            settable = kind.registers is not None and point.access is not Access.READ
            yield FormattedValue(point.path, f"{number_text(value)} {point.unit}".rstrip(), value, is_settable=settable)


def _live(kind: AnyKind, device: MotionController, path: str) -> LivePoint | None:
    """None for a row of registers, of which one must be chosen; those that are not 0 are among `CONTROLLER`."""
    try:
        return kind.point(device, path)
    except Misuse:
        return None


def _parts(world: Simulation, controller: str) -> Iterator[FormattedValue]:
    """Mechanics, by axis."""
    for axis in world.axes:
        name = f"{axis}.position"
        yield _measured(name, world.read(name), world.signal(name).unit)


_VALUES = {
    VARIABLES: _variables, AXES: _axes, PINS: _pins, CONTROLLER: _controller, REGISTERS: _registers, PARTS: _parts,
}  # fmt: skip


def evaluate(world: Simulation, controller: str, text: str) -> FormattedValue:
    """The value of an expression. Raises `Misuse`."""
    world.sync(controller)
    name = text.strip()
    number = ResolvedExpression(world, controller, name).value(world.now)
    return FormattedValue(name, number_text(number), number, is_settable=False)


READ_ONLY = Message("debug.read-only", "{name} cannot be set: it can only be read")
CANNOT_BE_SET = Message(
    "debug.cannot-be-set", "{name!r} cannot be set: what can be are variables ({known}), inputs and registers that can be written"
)


def setting(world: Simulation, controller: str, name: str, value: float) -> ExternalInput:
    """Input that gives a variable, an input or a register another value. Raises `Misuse` for what cannot be set."""
    own = world.programs_of(controller)
    variables = {known.upper(): known for known in own.variables(world.now)}
    if name.upper() in variables:
        return SetVariable(controller, variables[name.upper()], value)
    owner, dot, rest = name.partition(".")
    target, path = (owner, rest) if dot and owner in world.controllers else (controller, name)
    kind, device = world.kind(target), world.controller(target)
    path = world.programs_of(target).point(path) or path if target in world.programs else path
    if path.upper() in device.pins():
        return Set(((target, kind.input_pin(path, value), value),))
    if kind.registers is not None and (point := kind.point(device, path)) is not None:
        if point.point.access is Access.READ:
            raise Misuse(READ_ONLY(name=name))
        return Write(((target, path, value),))
    known = ", ".join(variables.values()) or "none"
    raise Misuse(CANNOT_BE_SET(name=name, known=known))
