"""``[[gantry]]``: a beam that two axes move, one at each end; what one of them does not move, the other one has to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import BuiltAxis, find_axis, mm_per_unit, moves, summed_travel
from steptwin.simulation.components.coordinate import Coordinate, Pulled
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import Movement, MoverSpec
from steptwin.simulation.components.touch import JAM, REPORT, RESET, Contact, Touch
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import MovedChannel
from steptwin.simulation.mechanics.drawing import Drawing, rail
from steptwin.simulation.mechanics.scale import Loading, burden_of
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, NameOf, Terminal, word
from steptwin.simulation.toml.values import number as number_value

SKEWED = "SKEWED"
SKEW = "skew"
SHARES = {SKEW: (1.0, -1.0), "position": (0.5, 0.5)}
"""Shares of the ends in how far the one on its axis is ahead, and in where the middle is."""


@table("[[gantry]]")
class GantrySpec(TerminalComponentSpec, MoverSpec):
    """``limit`` in the unit of its axes, ``mass`` in kg, ``friction_force`` in N."""

    axis: str = key(NameOf("axis"), "the axis that moves one end")
    other: str = key(NameOf("axis"), "the axis that moves the other end")
    limit: float = key(number_value(0.0, above=True), "skew in the unit of the axes, beyond which SKEWED is on")
    mass: float = key(number_value(0.0), "kg of the beam and what is on it; each motor moves half", default=0.0)
    friction_force: float = key(number_value(0.0), "N against its motion; each motor moves half", default=0.0)
    effect: str = key(word(REPORT, JAM), "of too much skew: report, or jam (both axes stand)", default=JAM)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET, which frees jammed axes", default=None)

    @property
    def mounted_as(self) -> str:
        return self.axis

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RESET,), outputs=(SKEWED,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.reset is not None:
            yield Joint("reset", RESET, self.reset)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield "axis", self.axis
        yield "other", self.other

    def check(self, text: TomlText) -> None:
        if self.axis == self.other:
            text.wrong((*self.path, "other"), "D007", f"other = {self.other!r} is its axis already: a gantry has two")


ENDS_ARE_SKEWED = Message("simulation.ends-are-skewed", "the ends of {name} are skewed by {skew:g} {unit}")


class Gantry(Touch):
    """Each motor moves half of the beam while both follow their fields; while one does not, the other one moves all of it.

    SKEWED is on while the ends are further apart than the limit; then the beam is stuck in its guides, with `JAM`.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_loads", "ends", "signals")
    __slots__ = (*FIXED, "_failed", "_looked_at", "_pulling", "is_stiff")

    def __init__(self, block: TerminalBlock, spec: GantrySpec, ends: tuple[BuiltAxis, BuiltAxis]) -> None:
        self.ends = ends
        self.signals = dict(_moving(ends))
        skewed = SignalCondition(f"abs({SKEW}) > {spec.limit!r}", self.signals.__getitem__)
        contact = Contact(skewed, tuple(end.mechanism.block for end in ends), self.touching)
        super().__init__(block, spec.effect == JAM, [contact], (spec.axis, spec.other))
        beam = Loading(mass=spec.mass, friction_force=spec.friction_force)
        self._loads = tuple(burden_of(beam, end.scale, "gantry") for end in ends)
        """The whole beam, for each motor."""
        self._pulling = (True, True)
        self._looked_at: Nanos = -1
        self._failed = (False, False)
        """Which motor has stalled at that moment: without its load it could pull at once, and fail again, without end."""
        self.is_stiff = 1.0
        """Fault: factor of its friction."""

    @property
    def output(self) -> str:
        return SKEWED

    def touching(self) -> str:
        """Text of what happens when its ends are too far apart."""
        skew = self.signals[SKEW].value(self.block.scheduler.now)
        return ENDS_ARE_SKEWED(name=self.block.name, skew=skew, unit=self.unit)

    def update(self, now: Nanos) -> None:
        one, other = (end.mechanism for end in self.ends)
        pulls = one.pulls(now), other.pulls(now)
        if now != self._looked_at:
            self._looked_at, self._failed = now, (False, False)
        stalled = one.at(now).stalled, other.at(now).stalled
        failed = [has or (did and lost) for has, did, lost in zip(self._failed, self._pulling, stalled, strict=True)]
        self._failed = failed[0], failed[1]
        self._pulling = pulls[0] and not failed[0], pulls[1] and not failed[1]
        shares = (0.5, 0.5) if self._pulling[0] is self._pulling[1] else tuple(map(float, self._pulling))
        for end, whole, share in zip(self.ends, self._loads, shares, strict=True):
            held = whole.times(share)
            end.mechanism.burden(self.block.name, held._replace(friction=held.friction * self.is_stiff), now)
        super().update(now)

    def deadline(self) -> Nanos | None:
        now = self.block.scheduler.now
        deadlines = (super().deadline(), *(end.mechanism.next_stall(now) for end in self.ends))
        return min((due for due in deadlines if due is not None), default=None)

    @property
    def drawing(self) -> Drawing:
        return rail(self.ends[0].spec.travel)

    @property
    def moved(self) -> tuple[str, MovedChannel]:
        half, other_half = (end.mechanism.build.sign / (2.0 * float(end.scale.pulses_per_unit)) for end in self.ends)
        other = self.ends[1].mechanism
        axis = other.controller, str(other.number)
        return self.ends[0].spec.name, MovedChannel(
            self.block.name, "position", self.unit, half, other=axis, other_per_pulse=other_half
        )

    @property
    def unit(self) -> str:
        return self.ends[0].scale.unit


def _moving(ends: tuple[BuiltAxis, BuiltAxis]) -> Iterator[tuple[str, SignalOf]]:
    """The signals that also change between events."""
    sources, unit = tuple(end.source for end in ends), ends[0].scale.unit
    for name, shares in SHARES.items():
        its = Coordinate(ends, shares, (Pulled(), Pulled()))
        yield name, SignalOf(sources, its.value, its.turning_points, its.version, unit)


GUIDES_ARE_STIFF = Message("simulation.guides-are-stiff", "the guides of {name} have {factor:g} times their friction")


def _stiffen(active: ActiveFault, gantry: Gantry, begins: bool, now: Nanos) -> str:
    gantry.is_stiff = active.fault.number("factor") if begins else 1.0
    return GUIDES_ARE_STIFF(name=gantry.block.name, factor=gantry.is_stiff)


def _rubs(active: ActiveFault, gantry: Gantry, now: Nanos) -> bool:
    return any(moves(end, now) for end in gantry.ends)


def _make(spec: GantrySpec, context: ElementContext) -> Gantry:
    block = context.terminal_block(spec.name)
    one, other = find_axis(spec.axis, context), find_axis(spec.other, context)
    for end in (one, other):
        if end.mechanism.build.motor is None:
            raise Misuse(f"axis {end.spec.name!r} has no [axis.motor]: a gantry shares the load of two")
    if one.scale.unit != other.scale.unit:
        raise Misuse(f"{spec.axis!r} is in {one.scale.unit} and {spec.other!r} in {other.scale.unit}: a gantry has one unit")
    for name, gantry in context.objects.built(GANTRY).items():
        if taken := [end.spec.name for end in (one, other) if any(one.mechanism is end.mechanism for one in gantry.ends)]:
            raise Misuse(f"axis {taken[0]!r} moves the gantry {name!r} already")
    return Gantry(block, spec, (one, other))


def _signals(gantry: Gantry) -> Mapping[str, SignalOf]:
    return {**gantry.signals, "count": SignalOf((gantry.block.source,), lambda now: float(gantry.count))}


def _moves(spec: GantrySpec, gantry: Gantry) -> Sequence[Movement]:
    one, other = gantry.ends
    motion = Coordinate(gantry.ends, SHARES["position"], (Pulled(), Pulled())).motion
    blocks, sources = (one.mechanism.block, other.mechanism.block), (one.spec.name, other.spec.name)
    towards = spec.towards(one.spec.towards())
    travel = summed_travel(gantry.ends, SHARES["position"])
    return (Movement("position", motion, towards, float(mm_per_unit(one)), blocks, sources, travel=travel),)


GANTRY = with_terminals(
    GantrySpec,
    make=_make,
    signals=_signals,
    drawing=lambda gantry: gantry.drawing,
    moved=lambda gantry: (gantry.moved,),
    moves=_moves,
    faults=(
        *STUCK,
        FaultKind(
            "stiff-guides",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The guides of a gantry have a multiple of their friction.",
            own=(number("factor", "Of its friction.", 1.0, 1000.0, default=3.0),),
            effect=ElementEffect(_stiffen, _rubs),
        ),
    ),
)
