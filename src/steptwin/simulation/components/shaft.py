"""``[[shaft]]``: a shaft that an axis turns through a gear, with cams that actuate contacts in every revolution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import floor
from typing import Any, ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS, BuiltAxis, find_axis, moves, turning_points_of_axis
from steptwin.simulation.components.contact import ContactSpec
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.mount import UPRIGHT, Movement, MoverSpec
from steptwin.simulation.components.switch import channel_of, put_switch
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.logic.contacts import Zone
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import SLIPS, MovedChannel
from steptwin.simulation.mechanics.drawing import DIAL, Drawing, SensorZone
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.space.pieces import Gear, Motion, Piece, StillPiece, gear_of, geared, pieces_of_trajectory
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import NameOf, name_value, number, permitting
from steptwin.state import Stateful

TURN = 360


@permitting("number other than 0")
def _ratio(value: Any) -> float:
    found = number()(value)
    if found == 0.0:
        raise Misuse(f"{value!r}: permitted are numbers other than 0")
    return found


@table("[[shaft.cam]]")
class CamSpec(ContactSpec):
    """On from ``begin`` to ``end`` degrees of the shaft; through 0 where the end is not above the beginning."""

    begin: float = key(number(0.0, 360.0), "degrees, from which it is on", name="from", order=-1)
    end: float = key(number(0.0, 360.0), "degrees, to which it is on; below from: through 0", name="until", order=-1)

    @property
    def zone(self) -> SensorZone:
        """Where it is on, as it is drawn."""
        return SensorZone(self.target, self.begin, self.end if self.end > self.begin else self.end + TURN)

    def check(self, text: TomlText) -> None:
        if self.begin == self.end:
            text.wrong((*self.path, "until"), "D007", f"from and until are {self.end:g} degrees: the cam has no width")


@table("[[shaft]]")
class ShaftSpec(NamedSpec, MoverSpec):
    name: str = key(name_value, "how conditions and faults name it")
    axis: str = key(NameOf("axis"), "the axis that turns it")
    ratio: float = key(_ratio, "turns of the shaft per unit of the axis; negative: backwards")
    offset: float = key(number(), "degrees of the shaft while the axis is at 0", default=0.0)
    cams: tuple[CamSpec, ...] = tables_in("cam", CamSpec)


class GearedShaft(Stateful):
    """Turns with its axis, a moving part for cams: its grid is that of the pulses of the axis."""

    FIXED: ClassVar[tuple[str, ...]] = ("axis", "spec")
    __slots__ = (*FIXED, "_behind", "_held")

    def __init__(self, spec: ShaftSpec, axis: BuiltAxis) -> None:
        self.spec = spec
        self.axis = axis
        self._held: int | None = None
        """Fault: the place at which it stands while its coupling slips."""
        self._behind = 0
        """Pulses of the axis that slipping has cost it; negative: it is ahead."""

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        """Its motion is that of its axis: the scheduler looks again at what depends on it."""

    def deadline(self) -> Nanos | None:
        """None: its motion is that of its axis."""
        return None

    # ------------------------------------------------------------------ the moving part of cams

    def version(self) -> object:
        return self.axis.mechanism.version(), self._held, self._behind

    def grid_position(self, now: Nanos) -> int:
        return self.axis.mechanism.grid_position(now) - self._behind if self._held is None else self._held

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        if self._held is not None:
            return None
        return self.axis.mechanism.reaches(position + self._behind, after, direction)

    def slip(self, slips: bool, now: Nanos) -> None:
        """Let the coupling slip, or grip again where the shaft is then."""
        scheduler, mechanism = self.axis.scheduler, self.axis.mechanism
        scheduler.record(mechanism.controller, "edge", f"{self.spec.name}.{SLIPS}", float(slips))
        if slips:
            self._held = self.grid_position(now)
        elif self._held is not None:
            self._behind = mechanism.grid_position(now) - self._held
            self._held = None
        scheduler.notify(self.spec.name)

    def is_left_behind(self, now: Nanos) -> bool:
        """Whether it slips, and its axis moves or is elsewhere by now."""
        if self._held is None:
            return False
        return moves(self.axis, now) or self.axis.mechanism.grid_position(now) - self._behind != self._held

    @property
    def moved(self) -> tuple[str, MovedChannel]:
        sign, name = self.axis.mechanism.build.sign, self.spec.name
        return self.axis.spec.name, MovedChannel(
            name, "angle", "degree", float(sign * TURN / self.pulses_per_turn), self.spec.offset, name
        )

    @property
    def behind(self) -> float:
        """Degrees."""
        return float(self._behind / self.pulses_per_turn * TURN)

    def pieces(self, now: Nanos) -> Iterator[Piece]:
        """Pulses of its axis, as far as it has followed it."""
        if self._held is not None:
            yield StillPiece(now, None, float(self._held))
            return
        load = pieces_of_trajectory(self.axis.mechanism.trajectory(now), now)
        yield from geared(load, Gear(1.0, 1.0, float(-self._behind))) if self._behind else load

    @property
    def motion(self) -> Motion:
        """In quarter turns."""
        gear = gear_of(4 / self.pulses_per_turn, float(exact_fraction(self.spec.offset) / 90))
        return Motion(self.version, lambda now: geared(self.pieces(now), gear))

    # ------------------------------------------------------------------ gear

    @property
    def pulses_per_turn(self) -> Fraction:
        """Pulses of the axis in a turn; negative where the shaft turns backwards."""
        return self.axis.scale.pulses_per_unit / exact_fraction(self.spec.ratio)

    def grid_position_at(self, degrees: float) -> Fraction:
        """The position on the grid, not always whole, at an angle of the first turn."""
        return (exact_fraction(degrees) - exact_fraction(self.spec.offset)) / TURN * self.pulses_per_turn

    def angle(self, now: Nanos) -> float:
        """Degrees, more than 360 after more than a turn."""
        return float(self.grid_position(now) / self.pulses_per_turn * TURN + exact_fraction(self.spec.offset))

    def zone(self, cam: CamSpec) -> Zone:
        """Places while a cam is on."""
        end = cam.end if cam.end > cam.begin else cam.end + TURN
        low, high = sorted((self.grid_position_at(cam.begin), self.grid_position_at(end)))
        half = Fraction(1, 2)
        return Zone(floor(low + half), floor(high + half), 0, abs(self.pulses_per_turn))


def _refers(spec: ShaftSpec, described: ElementSpecs) -> Iterator[Reference]:
    drives = {axis.name: axis.drive[0] for axis in described.of(AXIS)}
    controller = drives.get(spec.axis, spec.axis)
    yield Reference(controller, controller, (*spec.path, "axis"))
    for cam in spec.cams:
        yield Reference(controller, cam.target[0], (*cam.path, "to"))


def _build(spec: ShaftSpec, context: ElementContext) -> GearedShaft:
    shaft = GearedShaft(spec, find_axis(spec.axis, context))
    shaft.axis.scheduler.add_part(shaft, (spec.axis, spec.name), spec.name)
    for n, cam in enumerate(spec.cams, start=1):
        context.text.unless_wrong(cam.path, partial(_put_cam, shaft, cam, channel_of(spec.name, n), context))
    return shaft


def _put_cam(shaft: GearedShaft, cam: CamSpec, channel: str, context: ElementContext) -> None:
    moved_by = shaft.spec.axis, shaft.spec.name
    put_switch(shaft.axis.scheduler, shaft, moved_by, shaft.zone(cam), cam, channel, context)


def _signals(shaft: GearedShaft) -> Mapping[str, SignalOf]:
    turning = partial(turning_points_of_axis, shaft.axis)
    source = (shaft.axis.scheduler.source(shaft.spec.name),)
    return {"angle": SignalOf(source, shaft.angle, turning, shaft.version, "degree")}


COUPLING_SLIPS = Message("simulation.coupling-slips", "the coupling of {name} slips")
COUPLING_GRIPS = Message("simulation.coupling-grips", "the coupling of {name} grips, {behind:g} degrees behind")


def _slip(active: ActiveFault, shaft: GearedShaft, begins: bool, now: Nanos) -> str:
    shaft.slip(begins, now)
    name = shaft.spec.name
    return COUPLING_SLIPS(name=name) if begins else COUPLING_GRIPS(name=name, behind=shaft.behind)


def _is_left_behind(active: ActiveFault, shaft: GearedShaft, now: Nanos) -> bool:
    return shaft.is_left_behind(now)


def _moves(spec: ShaftSpec, shaft: GearedShaft) -> Sequence[Movement]:
    axis = shaft.axis
    sources = (axis.spec.name, spec.name)
    return (Movement("angle", shaft.motion, spec.towards(UPRIGHT), 1.0, (axis.mechanism.block,), sources, turns=True),)


SHAFT: Element[ShaftSpec, GearedShaft] = Element(
    spec=ShaftSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
    drawing=lambda shaft: Drawing(DIAL, float(TURN), ("angle",), sensors=tuple(one.zone for one in shaft.spec.cams)),
    moved=lambda shaft: (shaft.moved,),
    moves=_moves,
    faults=(
        FaultKind(
            "slipping-coupling",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A shaft stands while its axis turns; afterwards it goes on from where it stands.",
            effect=ElementEffect(_slip, _is_left_behind),
        ),
    ),
)
