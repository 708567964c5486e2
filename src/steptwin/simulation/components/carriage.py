"""``[[carriage]]``: what an axis moves through an elastic belt: it lags behind, and swings after a stop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import floor
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion.elastic import Response, Spring
from steptwin.simulation.components.axis import AXIS, BuiltAxis, find_axis, mm_per_unit, moves, nm_per_pulse
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.mount import Movement, MoverSpec
from steptwin.simulation.components.switch import SwitchSpec, channel_of, put_switch, zone_of
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number as parameter
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import SPRING_SHARE, MovedChannel
from steptwin.simulation.mechanics.drawing import rail
from steptwin.simulation.mechanics.loadmotion import load_intervals
from steptwin.simulation.space.pieces import Motion, gear_of, geared, pieces_of_response
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import NameOf, name_value, number
from steptwin.state import Plain, Stateful


@table("[[carriage]]")
class CarriageSpec(NamedSpec, MoverSpec):
    """``frequency`` in Hz; ``damping`` is the damping ratio."""

    name: str = key(name_value, "how conditions and faults name it")
    axis: str = key(NameOf("axis"), "the axis that moves it")
    frequency: float = key(number(0.1, 10_000.0), "Hz at which it swings while the axis stands")
    damping: float = key(number(0.001, 0.99), "damping ratio: 1 would not swing", default=0.05)
    switches: tuple[SwitchSpec, ...] = tables_in("switch", SwitchSpec)

    @property
    def mounted_as(self) -> str:
        return self.axis


class Carriage(Stateful):
    """Follows the load of its axis through a spring and a damper. Its place is the whole pulse nearest to it."""

    FIXED: ClassVar[tuple[str, ...]] = ("_version", "axis", "spec")
    __slots__ = (*FIXED, "_response", "_spring")

    def __init__(self, spec: CarriageSpec, axis: BuiltAxis) -> None:
        self.spec = spec
        self.axis = axis
        self._spring = Spring(spec.frequency, spec.damping)
        now = axis.scheduler.now
        self._response = self._respond(now, float(axis.mechanism.grid_position(now)), 0.0)
        self._version: object = axis.mechanism.version()

    def _respond(self, now: Nanos, x: float, v: float) -> Response:
        return Response(self._spring, load_intervals(self.axis.mechanism.trajectory(now), now), x, v)

    def _renew(self, now: Nanos) -> None:
        """Go on from the present place after a change of the motion of the axis, or of the belt."""
        before = self._response
        x, v = before.at(now)
        drives = tuple(load_intervals(self.axis.mechanism.trajectory(now), now))
        v += 2.0 * self._spring.rate * (drives[0].p - before.interval(now).drive.at(now)[0])
        self._response = Response(self._spring, drives, x, v)
        self._version = self.axis.mechanism.version()

    def soften(self, share: float, now: Nanos) -> None:
        """Let the belt have a share of its frequency."""
        self._spring = Spring(self.spec.frequency * share, self.spec.damping)
        self._renew(now)
        self.axis.scheduler.record(self.axis.mechanism.controller, "edge", f"{self.spec.name}.{SPRING_SHARE}", share)

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        if self.axis.mechanism.version() != self._version:
            self._renew(now)
            self.axis.scheduler.notify(self.spec.name)

    def deadline(self) -> Nanos | None:
        """None: its motion is computed in advance."""
        return None

    def copy_state(self) -> Plain:
        return super().copy_state(), self._version == self.axis.mechanism.version()

    def set_state(self, plain: Plain) -> None:
        """As `Stateful.set_state`; the axis must have been restored before."""
        own, is_current = plain
        super().set_state(own)
        self._version = self.axis.mechanism.version() if is_current else None

    # ------------------------------------------------------------------ the carriage of switches

    def version(self) -> object:
        return self._response

    def grid_position(self, now: Nanos) -> int:
        return floor(self._response.at(now)[0] + 0.5)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        return self._response.reaches(position - 0.5 * direction, after, direction)

    @property
    def moved(self) -> tuple[str, MovedChannel]:
        spec, scale = self.spec, self.axis.scale
        per_pulse = self.axis.mechanism.build.sign / float(scale.pulses_per_unit)
        return self.axis.spec.name, MovedChannel(
            spec.name, "position", scale.unit, per_pulse, spring=(spec.frequency, spec.damping)
        )

    @property
    def motion(self) -> Motion:
        """In nm. Raises `Misuse` where the unit of its axis is none of a place."""
        gear = gear_of(nm_per_pulse(self.axis))
        return Motion(self.version, lambda now: geared(pieces_of_response(self._response, now), gear))

    # ------------------------------------------------------------------ signals

    def position(self, now: Nanos) -> float:
        return self._units(self._response.at(now)[0])

    def deflection(self, now: Nanos) -> float:
        """By how much it is ahead of its drive."""
        return self._units(self._response.at(now)[0] - self._response.interval(now).drive.at(now)[0])

    def settled(self, now: Nanos) -> float:
        """1 while its drive stands and it does not swing."""
        drive = self._response.interval(now).drive
        return float(not (self._response.oscillates(now) or drive.v or drive.a or drive.j))

    def _units(self, pulses: float) -> float:
        return pulses / float(self.axis.scale.pulses_per_unit)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return self._response.turning_points(now)

    def ends(self, now: Nanos) -> Iterator[Nanos]:
        return (end for end in self._response.ends() if end > now)


# ---------------------------------------------------------------------- the element


BELT_HAS_SHARE = Message("simulation.belt-has-share", "the belt of {name} has {share:g} of its frequency")


def _slacken(active: ActiveFault, carriage: Carriage, begins: bool, now: Nanos) -> str:
    share = active.fault.number("share") if begins else 1.0
    carriage.soften(share, now)
    return BELT_HAS_SHARE(name=carriage.spec.name, share=share)


def _swings(active: ActiveFault, carriage: Carriage, now: Nanos) -> bool:
    return moves(carriage.axis, now)


def _refers(spec: CarriageSpec, described: ElementSpecs) -> Iterator[Reference]:
    drives = {axis.name: axis.drive[0] for axis in described.of(AXIS)}
    controller = drives.get(spec.axis, spec.axis)
    yield Reference(controller, controller, (*spec.path, "axis"))
    for switch in spec.switches:
        yield Reference(controller, switch.target[0], (*switch.path, "to"))


def _build(spec: CarriageSpec, context: ElementContext) -> Carriage:
    carriage = Carriage(spec, find_axis(spec.axis, context))
    carriage.axis.scheduler.add_part(carriage, (spec.axis,), spec.name)
    for n, switch in enumerate(spec.switches, start=1):
        context.text.unless_wrong(switch.path, partial(_put_switch, carriage, switch, channel_of(spec.name, n), context))
    return carriage


def _put_switch(carriage: Carriage, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    scale = carriage.axis.scale
    usual = scale.turn if carriage.axis.spec.kind == "rotary" else None
    period = usual if spec.period is None else scale.pulses(spec.period)
    put_switch(
        carriage.axis.scheduler, carriage, carriage.spec.name, zone_of(spec, scale.nearest, period), spec, channel, context
    )


def _signals(carriage: Carriage) -> Mapping[str, SignalOf]:
    def refuse() -> None:
        name, axis = carriage.spec.name, carriage.spec.axis
        raise Misuse(f"{name}.deflection swings while its axis moves: write {name}.position - {axis}.position")

    source, unit = (carriage.axis.scheduler.source(carriage.spec.name),), carriage.axis.scale.unit
    return {
        "position": SignalOf(source, carriage.position, carriage.turning_points, carriage.version, unit),
        "deflection": SignalOf(source, carriage.deflection, unit=unit, check=refuse),
        "settled": SignalOf(source, carriage.settled, carriage.ends, carriage.version),
    }


def _moves(spec: CarriageSpec, carriage: Carriage) -> Sequence[Movement]:
    axis = carriage.axis
    if axis.spec.kind == "rotary":
        raise Misuse(f"{spec.axis!r} is rotary: only carriages of linear axes have a place in space")
    sources = (axis.spec.name, spec.name)
    towards = spec.towards(axis.spec.towards())
    return (Movement("position", carriage.motion, towards, float(mm_per_unit(axis)), (axis.mechanism.block,), sources),)


CARRIAGE: Element[CarriageSpec, Carriage] = Element(
    spec=CarriageSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
    drawing=lambda carriage: rail(carriage.axis.spec.travel, tuple(one.zone for one in carriage.spec.switches)),
    moved=lambda carriage: (carriage.moved,),
    moves=_moves,
    faults=(
        FaultKind(
            "slack-belt",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The belt of a carriage is slack: it swings at a lower frequency.",
            own=(parameter("share", "Of its frequency.", 0.01, 1.0, default=0.5),),
            effect=ElementEffect(_slacken, _swings),
        ),
    ),
)
