"""``[[vacuum]]``: a suction cup with its ejector and its vacuum switch, which picks workpieces up and puts them down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import ceil
from typing import ClassVar

from steptwin.controller import MILLISECOND, Nanos
from steptwin.messages import Message
from steptwin.motion.exponential import decay, logarithm
from steptwin.simulation.components.beltgrip import BeltGrip
from steptwin.simulation.components.carrier import HELD, Carrier, CarrierSpec, carrier_signals
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.grasp import Grasp
from steptwin.simulation.components.logic import STUCK, Joint, with_terminals
from steptwin.simulation.components.mount import to_nm
from steptwin.simulation.components.workpieces import REACH_NM, Lie
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.bodies import Body, Box, half_height
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, positive_time

EJECTOR = "EJECTOR"


@table("[[vacuum]]")
class VacuumSpec(CarrierSpec):
    ejector: Terminal | None = key(OUTPUT_PIN, "output connected to EJECTOR; without it a wire may be", default=None, order=-1)
    vacuum: float = key(number(0.0, 101.0, above=True), "kPa below the pressure of the air, with a closed cup", default=70.0)
    threshold: float = key(number(0.0, 101.0, above=True), "kPa, from which HELD is on", default=50.0)
    build_up: Nanos = key(positive_time, "from 0 to the threshold", default=100 * MILLISECOND)
    release: Nanos = key(positive_time, "from vacuum to the threshold", default=40 * MILLISECOND)
    diameter: float = key(
        number(0.0, 10_000.0), "in space: mm of the cup, which points down", default=20.0, in_space=True, order=2
    )
    reach: float = key(
        number(0.0, 1000.0, above=True), "in space: mm from which it draws a workpiece", default=2.0, in_space=True, order=2
    )

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(EJECTOR, *self.places), outputs=(HELD,))

    @property
    def own_joint(self) -> Joint | None:
        return None if self.ejector is None else Joint("ejector", EJECTOR, self.ejector)

    def check(self, text: TomlText) -> None:
        super().check(text)
        if self.threshold >= self.vacuum:
            text.wrong(
                (*self.path, "threshold"),
                "D007",
                f"threshold = {self.threshold:g} kPa is not below vacuum = {self.vacuum:g} kPa: nothing would ever be held",
            )


def _grasp(block: TerminalBlock, spec: VacuumSpec, context: ElementContext) -> Grasp:
    reach = to_nm(spec.reach)
    half = (reach + REACH_NM) // 2 + 1  # 1 nm more at both ends: a face that is just there only touches
    probe = Body(spec.name, context.frames.base(spec.name), Box((0, 0, half)), (0, 0, (REACH_NM - reach) // 2))
    return Grasp(block, context, probe, _drawn, to_nm(spec.diameter) // 2)


def _drawn(lie: Lie, body: Body) -> Lie:
    """Its top is at the cup."""
    x, y, _ = lie.at
    return Lie((x, y, -2 * half_height(body.shape)), lie.yaw_q)


class Vacuum(Carrier):
    """The pressure in the cup, below that of the air, goes exponentially to ``vacuum`` while the ejector is on and a workpiece
    closes the cup, else to 0. From 0 it takes ``build_up`` to the threshold, from ``vacuum`` it takes ``release``. HELD is on
    from the threshold on.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_grasp", "spec")
    __slots__ = (*FIXED, "_begin", "_due", "_first", "_goal", "_is_held", "leaks")

    def __init__(self, block: TerminalBlock, spec: VacuumSpec, context: ElementContext) -> None:
        self._grasp = _grasp(block, spec, context) if spec.is_mounted else None
        super().__init__(block, self._grasp or BeltGrip(block, spec, context))
        self.spec = spec
        self.leaks = False
        self._is_held = False
        self._begin: Nanos = block.scheduler.now
        self._first = 0.0
        """Pressure at `_begin`, kPa below that of the air."""
        self._goal = 0.0
        self._due: Nanos | None = None
        """When the pressure comes to the threshold."""

    # ------------------------------------------------------------------ pressure

    def pressure(self, now: Nanos) -> float:
        """kPa below that of the air."""
        time = self._time(self._goal > 0.0)
        return self._goal + (self._first - self._goal) * decay((now - self._begin) / time)

    @property
    def version(self) -> object:
        """Another value whenever the pressure goes another way."""
        return self._begin, self._goal

    def _time(self, is_evacuating: bool) -> float:
        """The time constant, ns."""
        spec = self.spec
        if is_evacuating:
            return spec.build_up / logarithm(spec.vacuum / (spec.vacuum - spec.threshold))
        return spec.release / logarithm(spec.vacuum / spec.threshold)

    def _go(self, goal: float, now: Nanos) -> None:
        """Let the pressure go to another value."""
        self._first, self._begin, self._goal = self.pressure(now), now, goal
        self.block.scheduler.notify(self.block.name)
        threshold = self.spec.threshold
        self._due = None
        if (goal > threshold) is not self._is_held:
            ratio = (self._first - goal) / (threshold - goal)
            self._due = now if ratio <= 1.0 else now + ceil(logarithm(ratio) * self._time(goal > 0.0))

    @property
    def is_on(self) -> bool:
        return self.block.is_on(EJECTOR)

    @property
    def is_held(self) -> bool:
        return self._is_held

    @property
    def since(self) -> Nanos:
        """When the pressure went another way."""
        return self._begin

    # ------------------------------------------------------------------ time

    def update(self, now: Nanos) -> None:
        goal = self.spec.vacuum if self.block.is_on(EJECTOR) and self.is_occupied(now) and not self.leaks else 0.0
        if goal != self._goal:
            self._go(goal, now)
        if self._due is not None and self._due <= now:
            self._due = None
            self._is_held = not self._is_held
            if self._is_held:
                self.take(now)
            else:
                self.let_go(now)
        elif self._grasp is not None and self._is_held and goal > 0.0:
            self.take(now)  # what closes it after it lost another one that it did not carry
        self.block.put(HELD, float(self._is_held))

    def leaks_out(self, now: Nanos) -> bool:
        """Whether only a leak keeps it from a vacuum."""
        return self.leaks and self.block.is_on(EJECTOR) and self.is_occupied(now)

    def deadline(self) -> Nanos | None:
        passing = self.passing(self.block.scheduler.now) if self.block.is_on(EJECTOR) else None
        moments = (moment for moment in (self._due, passing) if moment is not None)
        return min(moments, default=None)


# ---------------------------------------------------------------------- the element


LEAKS = Message("simulation.leaks", "{name} leaks")
IS_TIGHT_AGAIN = Message("simulation.is-tight-again", "{name} is tight again")


def _leak(active: ActiveFault, vacuum: Vacuum, begins: bool, now: Nanos) -> str:
    vacuum.leaks = begins
    return (LEAKS if begins else IS_TIGHT_AGAIN)(name=vacuum.block.name)


def _loses(active: ActiveFault, vacuum: Vacuum, now: Nanos) -> bool:
    return vacuum.leaks_out(now)


HOLDS_NOTHING = Message("simulation.holds-nothing", "is switched on, and holds nothing")


def _stands(vacuum: Vacuum, now: Nanos) -> Stands | None:
    return Stands(HOLDS_NOTHING(), vacuum.since) if vacuum.is_on and not vacuum.is_held else None


def _signals(vacuum: Vacuum) -> Mapping[str, SignalOf]:
    source = (vacuum.block.source,)

    def turning(now: Nanos) -> Iterator[Nanos]:
        yield from ()

    bounds = (0.0, vacuum.spec.vacuum)
    return {
        "pressure": SignalOf(source, vacuum.pressure, turning, lambda: vacuum.version, unit="kPa", bounds=bounds),
        **carrier_signals(vacuum),
    }


VACUUM = with_terminals(
    VacuumSpec,
    moves=lambda spec, vacuum: (),
    make=lambda spec, context: Vacuum(context.terminal_block(spec.name), spec, context),
    signals=_signals,
    stands=_stands,
    faults=(
        *STUCK,
        FaultKind(
            "leak",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A suction cup does not hold a vacuum.",
            effect=ElementEffect(_leak, _loses),
        ),
    ),
)
