"""The description of a world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import cast

from steptwin.controller import Nanos
from steptwin.simulation.components.axis import AXIS, MECHANICS
from steptwin.simulation.components.beam import BEAM
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.brake import BRAKE
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.frames import Mounted
from steptwin.simulation.components.mount import MoverSpec
from steptwin.simulation.components.nest import NEST
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.components.vacuum import VACUUM
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.mechanics.drawing import Drawing, SensorZone
from steptwin.simulation.space.bodies import Box, half_height
from steptwin.simulation.space.frames import FLOOR, NM_PER_MM, Joint, Vector, path, pose
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.wiring import connections, terminal_name
from steptwin.subject.commands import COMMANDS
from steptwin.subject.contract import (
    ConnectionDescription,
    ControllerDescription,
    Description,
    DrawingDescription,
    ElementDescription,
    LineDescription,
    MechanicsDescription,
    SignalDescription,
    SwitchDescription,
)
from steptwin.subject.controls import controls_of
from steptwin.subject.scene import (
    BeamDescription,
    BodyDescription,
    CupDescription,
    FrameDescription,
    JointDescription,
    MoveState,
    NestDescription,
    OriginDescription,
    Point,
    SceneDescription,
    WorkpieceState,
)


def describe(world: Simulation) -> Description:
    """Description of a world."""
    moved = world.objects.turned.union(*(axis.mechanism.may_turn for axis in world.axes.values()))
    return Description(
        world.spec.name,
        tuple(_controller(world, name, is_moved=name in moved) for name in world.controllers),
        tuple(_mechanics(world, name) for name in world.axes),
        tuple(world.objects.built(BUTTON)),
        tuple(_elements(world)),
        tuple(_connections(world)),
        tuple(LineDescription(line.name, line.kind, world.lines[line.name].baud) for line in world.spec.lines),
        tuple(COMMANDS),
        _scene(world),
    )


def _controller(world: Simulation, name: str, *, is_moved: bool) -> ControllerDescription:
    on = world.objects.line_of.get(name)
    line, unit = (None, None) if on is None else (on[0].name, on[1])
    kind = world.kind(name)
    sheet = kind.datasheet(world.controllers[name])
    return ControllerDescription(name, sheet, line, unit, controls_of(sheet, kind.commands), is_moved=is_moved)


def _mechanics(world: Simulation, name: str) -> MechanicsDescription:
    fitted = world.axes[name]
    place = fitted.mechanism.controller, str(fitted.mechanism.number)
    points = tuple(f"{name}.{what}" for what in MECHANICS)
    spec = fitted.spec
    switches = tuple(_switch(one.zone) for one in spec.switches)
    scale = fitted.mechanism.build.sign * float(fitted.scale.pulses_per_unit)
    brake = next((one.name for one in world.spec.elements.of(BRAKE) if one.axis == name), None)
    return MechanicsDescription(
        name, *place, fitted.scale.unit, points, spec.kind, spec.travel, switches, scale, brake, spec.pitch
    )


def _elements(world: Simulation) -> Iterator[ElementDescription]:
    for kind, built in world.objects.elements.items():
        if kind not in (AXIS.name, BUTTON.name):
            yield from (_element(world, kind, name) for name in built)


def _element(world: Simulation, kind: str, name: str) -> ElementDescription:
    drawn = ELEMENTS[kind].drawing
    drawing = None if drawn is None else _drawing(drawn(world.objects.elements[kind][name]))
    terminals = world.objects.terminals.get(name, Terminals())
    inputs = tuple(pin.lower() for pin in (*terminals.digital_inputs, *terminals.analog_inputs))
    outputs = tuple(pin.lower() for pin in terminals.outputs)
    signals = world.objects.element_signals(name) or {}
    others = {signal: of for signal, of in signals.items() if signal not in (*inputs, *outputs)}
    parts = tuple(SignalDescription(signal, of.unit, *(of.bounds or (None, None))) for signal, of in others.items())
    function_of = ELEMENTS[kind].function
    function = None if function_of is None else function_of(world.objects.elements[kind][name])
    return ElementDescription(name, kind, inputs, outputs, parts, drawing, function)


def _scene(world: Simulation) -> SceneDescription:
    frames, elements = world.objects.frames, world.spec.elements
    return SceneDescription(
        tuple(_frame(world, name, one) for name, one in frames.items()),
        tuple(
            BodyDescription(
                *(one.name, one.size, one.diameter, one.height, one.color, one.when, one.lit, one.model),
                *(one.shape, one.draws, one.draws_on, one.line_to),
            )
            for one in elements.of(BODY)
        ),
        tuple(CupDescription(one.name, one.diameter) for one in elements.of(VACUUM) if one.name in frames),
        tuple(NestDescription(one.name, one.cells, one.pitch, one.cell or one.pitch) for one in elements.of(NEST)),
        tuple(
            BeamDescription(one.name, one.length, one.count, one.pitch, str(one.across))
            for one in elements.of(BEAM)
            if one.name in frames
        ),
        tuple(
            OriginDescription(one.name, one.workpiece_shape, one.workpiece_color)
            for one in (*elements.of(CONVEYOR), *elements.of(NEST))
            if one.name in frames
        ),
    )


def _frame(world: Simulation, name: str, mounted: Mounted) -> FrameDescription:
    spec, place = mounted.spec, mounted.place
    joints = tuple(JointDescription(f"{name}.{one.signal}", str(one.along), one.turns, one.per_unit) for one in mounted.movements)
    along = str(spec.towards()) if isinstance(spec, MoverSpec) and not joints else None
    written = world.spec.text.place(spec.path)
    return FrameDescription(name, str(spec.path[0]), place.on, _mm(place.origin), along, joints, *written)


def _mm(vector: Vector) -> Point:
    x, y, z = (one / NM_PER_MM for one in vector)
    return x, y, z


def workpiece_states(
    world: Simulation, now: Nanos | None = None, value: Callable[[Joint], float] | None = None
) -> Iterator[WorkpieceState]:
    """All workpieces in space, by default at the present moment. ``value``: that of the signal of a joint."""
    frames = world.objects.frames
    now = world.now if now is None else now
    value = value or (lambda joint: world.read(joint.signal))
    owners = {mounted.frame: name for name, mounted in frames.items()}
    for name, body in world.objects.workpieces.bodies().items():
        carrier = next((one for one in body.frame.line() if one in owners), None)
        there = pose(body.frame, FLOOR if carrier is None else carrier, now)
        shape, height = body.shape, 2 * half_height(body.shape) / NM_PER_MM
        size = tuple(2 * one / NM_PER_MM for one in shape.half) if isinstance(shape, Box) else None
        joints = [one.joint for one in path(carrier or FLOOR, body.frame) if one.joint is not None and one.joint.signal]
        yield WorkpieceState(
            name,
            cast("Point | None", size),
            None if isinstance(shape, Box) else 2 * shape.radius / NM_PER_MM,
            height,
            None if carrier is None else owners[carrier],
            _mm(there.at),
            there.angle_q * 90.0,
            tuple(MoveState(one.signal, str(one.along), one.per_unit, value(one)) for one in joints),
        )


def _connections(world: Simulation) -> Iterator[ConnectionDescription]:
    for one in connections(world.objects):
        target = terminal_name(world.objects, one.target)
        yield ConnectionDescription(one.source, target, one.inverted, one.delay, one.join)


def _drawing(drawing: Drawing) -> DrawingDescription:
    switches = tuple(map(_switch, drawing.sensors))
    across = drawing.across, drawing.across_low
    return DrawingDescription(
        drawing.shape, drawing.length, drawing.places, drawing.size, switches, drawing.low, *across, drawing.feeds
    )


def _switch(zone: SensorZone) -> SwitchDescription:
    return SwitchDescription(".".join(zone.target), zone.low, zone.high, zone.period)
