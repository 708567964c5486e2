"""``[[integrator]]``: a quantity that a rate fills and empties: the level of a tank, what a bottle weighs, a length, a dancer.

The rate is an expression over signals each of which stands between events, or goes on in a straight line; the value is the
parabola of `steptwin.simulation.mechanics.integral`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import floor
from typing import ClassVar

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, Reference
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import Movement, MoverSpec
from steptwin.simulation.components.quantity import TIME, check_expression, owners_in, signal_of
from steptwin.simulation.components.switch import SwitchSpec, channel_of, put_switch, zone_of
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number as parameter
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.expression import parse_expression
from steptwin.simulation.logic.linear import check_linear, straight_of
from steptwin.simulation.logic.quantities import Quantity
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.drawing import SLIDE, Drawing
from steptwin.simulation.mechanics.integral import Integral, Limits, Straight
from steptwin.simulation.mechanics.scale import LENGTHS, exact_fraction
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.frames import NM_PER_MM
from steptwin.simulation.space.pieces import Motion, Piece, SteadyPiece, StillPiece
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, tables_in
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, text_value
from steptwin.state import Plain

RESET, AT_LOW, AT_HIGH = "RESET", "AT_LOW", "AT_HIGH"
GRID_PER_UNIT = 10**24
"""Steps of the grid of its switches in a unit, which may be a cubic metre of what drips: finer than what is measured in it."""

NO_STRAIGHT_LINE = Message(
    "simulation.no-straight-line",
    "rate: {signal!r} changes between events, and is not known to go on in a straight line, as positions of cylinders, speeds of "
    "DC motors and rates of integrators do",
)


@table("[[integrator]]")
class IntegratorSpec(TerminalComponentSpec, MoverSpec):
    rate: str = key(text_value, "what it gains in a second, over signals: '0.5 * pump.no - 0.02 * valve.position'")
    unit: str = key(text_value, "of its value: l, kg, mm or anything", default="mm")
    start: float = key(number(), "its value when the world begins", default=0.0)
    low: float | None = key(number(), "the value that it does not fall below", default=None)
    high: float | None = key(number(), "the value that it does not rise above", default=None)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET; it is at start while that is on", default=None)
    mm_per_unit: float | None = key(
        number(0.0, above=True),
        "mm that it moves what is on it per unit, where its unit is no length",
        default=None,
        in_space=True,
        order=2,
    )
    switches: tuple[SwitchSpec, ...] = tables_in("switch", SwitchSpec)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RESET,), outputs=(AT_LOW, AT_HIGH))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.reset is not None:
            yield Joint("reset", RESET, self.reset)

    @property
    def limits(self) -> Limits:
        low, high = (None if end is None else exact_fraction(end) for end in (self.low, self.high))
        return Limits(low, high)

    def others(self, described: ElementSpecs) -> Iterable[tuple[str, str]]:
        return (("rate", owner) for owner in owners_in(self.rate) if owner != TIME)

    def check(self, text: TomlText) -> None:
        check_expression(text, (*self.path, "rate"), self.name, self.rate)
        low, high = self.low, self.high
        if low is not None and high is not None and low >= high:
            text.wrong((*self.path, "low"), "D007", f"low = {low:g} is not below high = {high:g}")
        elif self.limits.clip(exact_fraction(self.start)) != exact_fraction(self.start):
            there = " and ".join(f"{key} = {end:g}" for key, end in (("low", low), ("high", high)) if end is not None)
            text.wrong((*self.path, "start"), "D007", f"start = {self.start:g} is beyond {there}")


class Integrator(TerminalComponent):
    """Is at ``start`` while RESET is on, and otherwise follows its rate within its limits. AT_LOW and AT_HIGH are on at
    them. It is a moving part for switches."""

    FIXED: ClassVar[tuple[str, ...]] = ("_limits", "_moving", "_rate", "_reads", "_resting", "_seen", "spec")
    __slots__ = (*FIXED, "factor", "plan")

    def __init__(self, block: TerminalBlock, spec: IntegratorSpec, rate: Quantity, signals: Mapping[str, SignalOf]) -> None:
        super().__init__(block)
        self.spec = spec
        self._rate = rate
        self._limits = spec.limits
        self._moving = {name: signal for name, signal in signals.items() if signal.continuous}
        self._resting = tuple(signal for signal in signals.values() if not signal.continuous)
        self._reads = {name: signal.value for name, signal in signals.items()}
        self._seen: object = None
        """Values that its plan is made from."""
        self.factor = 1.0
        """Fault: what its rate is multiplied by."""
        now = block.scheduler.now
        self.plan = Integral(now, exact_fraction(spec.start), Fraction(0), Fraction(0), None, self._limits)

    @property
    def reads(self) -> tuple[str, ...]:
        return owners_in(self.spec.rate)

    def update(self, now: Nanos) -> None:
        is_reset, end = self.block.is_on(RESET), self.plan.end
        present = (*(one.version() for one in self._moving.values()), *(one.value(now) for one in self._resting))
        seen = is_reset, self.factor, present
        if seen != self._seen or (end is not None and end <= now):
            self._seen = seen
            self._renew(is_reset, now)

    def _renew(self, is_reset: bool, now: Nanos) -> None:
        rate = Straight(Fraction(0)) if is_reset else self._per_ns(exact_fraction(self.factor), now)
        value = exact_fraction(self.spec.start) if is_reset else self.plan.at(now)
        plan = Integral.of(rate, value, self._limits, now)
        if not self.plan.goes_on_as(plan):
            self.plan = plan
            self.block.scheduler.notify(self.block.name)
        stands = plan.rate == plan.slope == 0
        self.block.put(AT_LOW, float(stands and value == self._limits.low))
        self.block.put(AT_HIGH, float(stands and value == self._limits.high))

    def _per_ns(self, factor: Fraction, now: Nanos) -> Straight:
        lines = {name: signal.straight(now) for name, signal in self._moving.items() if signal.straight is not None}
        value, slope, until = straight_of(self._rate, lines, lambda name: self._reads[name](now))
        scale = factor / SECOND
        return Straight(value * scale, slope * scale, until)

    def deadline(self) -> Nanos | None:
        return self.plan.end

    def has_other_rate(self, now: Nanos) -> bool:
        """Whether a fault gives it another rate than it should have."""
        value, slope, _ = self._per_ns(Fraction(1), now)
        return self.factor != 1.0 and not self.block.is_on(RESET) and bool(value or slope)

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._seen = None  # restored signals may have versions that they had in another past

    # ------------------------------------------------------------------ the moving part of switches

    def version(self) -> object:
        return self.plan

    def grid_position(self, now: Nanos) -> int:
        return _on_grid(self.plan.at(now))

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        if (position - self.grid_position(after)) * direction <= 0:
            return None
        return self.plan.first(after, lambda value: (_on_grid(value) - position) * direction >= 0)

    # ------------------------------------------------------------------ signals and places

    def value(self, now: Nanos) -> float:
        return float(self.plan.at(now))

    def rate(self, now: Nanos) -> float:
        """Units per second."""
        return float(self.plan.rate_at(now) * SECOND)

    def rate_line(self, now: Nanos) -> Straight:
        plan = self.plan
        return Straight(plan.rate_at(now) * SECOND, plan.slope * SECOND, plan.end)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return self.plan.turning_points(now)

    def ends(self, now: Nanos) -> Iterator[Nanos]:
        """The moment after one at which its rate is on another line, if that is known."""
        if self.plan.end is not None and self.plan.end > now:
            yield self.plan.end

    def pieces(self, now: Nanos, per_unit: Fraction) -> Iterator[Piece]:
        """Whole nm, ``per_unit`` of them for a unit."""
        plan = self.plan
        end = next(self.ends(now), None)
        if plan.rate or plan.slope:
            fastest = max(abs(plan.rate_at(at)) for at in (now, now if end is None else end))
            per_s = float(fastest * per_unit * SECOND)
            yield SteadyPiece(now, end, partial(_place, plan, per_unit), per_s, float(plan.slope * per_unit * SECOND * SECOND))
            if end is None:
                return
            now = end
        yield StillPiece(now, None, float(_place(plan, per_unit, now)))

    @property
    def drawing(self) -> Drawing:
        """A slide between its limits, or those of its switches."""
        spec, sensors = self.spec, tuple(one.zone for one in self.spec.switches)
        ends = [spec.start, *(end for end in (spec.low, spec.high) if end is not None)]
        ends += (end for one in sensors for end in (one.low, one.high) if end is not None)
        return Drawing(SLIDE, max(ends) - min(ends) or 1.0, ("value",), sensors=sensors, low=min(ends))


def _on_grid(value: Fraction, per_unit: Fraction | int = GRID_PER_UNIT) -> int:
    return floor(value * per_unit + Fraction(1, 2))


def _place(plan: Integral, per_unit: Fraction, now: Nanos) -> int:
    return _on_grid(plan.at(now), per_unit)


OTHER_RATE = Message("simulation.other-rate", "the rate of {name} is {factor:g} times what it should be")


def _change(active: ActiveFault, integrator: Integrator, begins: bool, now: Nanos) -> str:
    integrator.factor = active.fault.number("factor") if begins else 1.0
    return OTHER_RATE(name=integrator.block.name, factor=integrator.factor)


def _has_other_rate(active: ActiveFault, integrator: Integrator, now: Nanos) -> bool:
    return integrator.has_other_rate(now)


# ---------------------------------------------------------------------- the element


def _make(spec: IntegratorSpec, context: ElementContext) -> Integrator:
    block = context.terminal_block(spec.name)
    rate = parse_expression(spec.rate)
    found = {name: signal_of("rate", block, context, name) for name in dict.fromkeys(rate.names())}
    signals = {name: signal for name, signal in found.items() if isinstance(signal, SignalOf)}
    for name, signal in signals.items():
        if signal.continuous and signal.straight is None:
            raise Misuse(NO_STRAIGHT_LINE(signal=name))
    check_linear(rate, [name for name, signal in signals.items() if signal.continuous])
    rate = rate.in_unit("", lambda name: signals[name].unit)
    return Integrator(block, spec, rate, signals)


def _refers_of_switches(spec: IntegratorSpec) -> Iterator[Reference]:
    for switch in spec.switches:
        yield Reference(spec.name, switch.target[0], (*switch.path, "to"))


def _put_switches(spec: IntegratorSpec, integrator: Integrator, context: ElementContext) -> None:
    for n, switch in enumerate(spec.switches, start=1):
        context.text.unless_wrong(switch.path, partial(_put_switch, integrator, switch, channel_of(spec.name, n), context))


def _put_switch(integrator: Integrator, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    period = None if spec.period is None else exact_fraction(spec.period) * GRID_PER_UNIT
    zone = zone_of(spec, lambda units: _on_grid(exact_fraction(units)), period)
    block = integrator.block
    put_switch(block.scheduler, integrator, block.name, zone, spec, channel, context)


def _signals(integrator: Integrator) -> Mapping[str, SignalOf]:
    source, spec, version = (integrator.block.source,), integrator.spec, integrator.version
    bounds = None if spec.low is None or spec.high is None else (spec.low, spec.high)
    return {
        "value": SignalOf(source, integrator.value, integrator.turning_points, version, spec.unit, bounds),
        "rate": SignalOf(source, integrator.rate, integrator.ends, version, f"{spec.unit}/s", straight=integrator.rate_line),
    }


def _moves(spec: IntegratorSpec, integrator: Integrator) -> Sequence[Movement]:
    metres, given = LENGTHS.get(spec.unit), spec.mm_per_unit
    if given is not None and metres is not None:
        raise Misuse(f"mm_per_unit = {given:g}: {spec.name!r} is in {spec.unit}, which is a length already")
    if given is None and metres is None:
        raise Misuse(f"{spec.name!r} counts in {spec.unit}: what is on it needs its mm_per_unit")
    mm = exact_fraction(given) if given is not None else (metres or 0) * 1000
    motion = Motion(integrator.version, lambda now: integrator.pieces(now, Fraction(mm * NM_PER_MM)))
    ends = None if spec.low is None or spec.high is None else (spec.low, spec.high)
    return (Movement("value", motion, spec.towards(), float(mm), (), (spec.name,), travel=ends),)


INTEGRATOR = with_terminals(
    IntegratorSpec,
    make=_make,
    signals=_signals,
    drawing=lambda integrator: integrator.drawing,
    moves=_moves,
    faults=(
        *STUCK,
        FaultKind(
            "other-rate",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "An integrator fills and empties at a multiple of its rate, as with a clogged nozzle or a wheel that slips.",
            own=(parameter("factor", "What its rate is multiplied by.", 0.0, 100.0, default=0.5),),
            effect=ElementEffect(_change, _has_other_rate),
        ),
    ),
    refers=_refers_of_switches,
    fit=_put_switches,
)
