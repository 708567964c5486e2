"""``[[load]]``: a further load on the motor of an axis: while a condition holds, or as much of it as a table gives."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import BuiltAxis, find_axis
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.quantity import (
    TIME,
    check_condition,
    check_owners,
    condition_of,
    owner_of,
    owners_of,
    signal_of,
)
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.curve import Stepped
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.motor import Burden
from steptwin.simulation.mechanics.scale import Loading, burden_of
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import NameOf, points, text_value
from steptwin.simulation.toml.values import number as number_value
from steptwin.state import Plain

ACTS = "ACTS"
MOST_SHARE = 1000.0


_not_negative = number_value(0.0)


@table("[[load]]")
class LoadSpec(TerminalComponentSpec):
    """``mass`` in kg, ``force`` and ``friction_force`` in N on a linear axis, the others in kg·m² and N·m at the motor."""

    axis: str = key(NameOf("axis"), "the axis whose motor moves it")
    when: str | None = key(text_value, "the condition under which it is there, such as 'cup.held'; default always", default=None)
    mass: float = key(_not_negative, "kg moved by a linear axis", default=0.0)
    force: float = key(number_value(), "N on a linear axis; positive pulls towards lower positions", default=0.0)
    friction_force: float = key(_not_negative, "N against motion of a linear axis", default=0.0)
    inertia: float = key(_not_negative, "kg·m² at the motor", default=0.0)
    load: float = key(number_value(), "N·m at the motor; positive pulls towards lower positions", default=0.0)
    friction: float = key(_not_negative, "N·m against motion, at the motor", default=0.0)
    of: str | None = key(text_value, "the signal that points are over, such as x.position or time", default=None, needs="points")
    points: tuple[tuple[float, float], ...] | None = key(
        points, "[[value, share], ...] of all its values there is, linear between; default 1", default=None, needs="of"
    )
    resolution: float = key(number_value(0.0001, 1.0), "steps in which the share changes", default=0.01, needs="points")

    @property
    def terminals(self) -> Terminals:
        return Terminals(outputs=(ACTS,))

    @property
    def joints(self) -> Iterable[Joint]:
        return ()

    @property
    def loading(self) -> Loading:
        return Loading(self.inertia, self.mass, self.friction, self.friction_force, self.load, self.force)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield "axis", self.axis
        yield from self.over()

    def over(self) -> Iterator[tuple[str, str]]:
        """Its keys that are over signals, and the owners of these."""
        named = () if self.of is None else (owner_of(self.of),)
        for name, owners in (("when", () if self.when is None else owners_of(self.when)), ("of", named)):
            yield from ((name, owner) for owner in owners if owner != TIME)

    def check(self, text: TomlText) -> None:
        if self.when is not None:
            check_condition(text, self.path, self.name, self.when)
        if self.of is not None:
            check_owners(text, (*self.path, "of"), self.name, (owner_of(self.of),))
        if not any(self.loading):
            text.wrong(self.path, "D007", f"{self.name!r} weighs nothing: give it a mass, a force, a friction or an inertia")
        shares = [share for _, share in self.points or ()]
        if not all(0.0 <= share <= MOST_SHARE for share in shares):
            there = f"{min(shares):g} to {max(shares):g}"
            text.wrong((*self.path, "points"), "D003", f"shares of {there}: permitted are 0 to {MOST_SHARE:g}")


class FurtherLoad(TerminalComponent):
    """Loads the motor while its condition holds, with the share of its curve. ACTS is on while there is any."""

    FIXED: ClassVar[tuple[str, ...]] = ("_axis", "_condition", "_reads", "_whole")
    __slots__ = (*FIXED, "_curve", "_due", "_share", "factor")

    def __init__(
        self,
        block: TerminalBlock,
        axis: BuiltAxis,
        whole: Burden,
        condition: SignalCondition | None,
        curve: Stepped | None,
        reads: tuple[str, ...],
    ) -> None:
        super().__init__(block)
        self._reads = reads
        self._axis = axis
        self._whole = whole
        self._condition = condition
        self._curve = curve
        self._share = 0.0
        """How much of it there is."""
        self._due: Nanos | None = None
        """When that may change without an event."""
        self.factor = 1.0
        """Fault: how much of it there is instead of all."""

    @property
    def reads(self) -> tuple[str, ...]:
        return self._reads

    @property
    def most(self) -> float:
        """The greatest share, but for faults."""
        return 1.0 if self._curve is None else self._curve.most

    def share(self, now: Nanos) -> float:
        return self._share

    def update(self, now: Nanos) -> None:
        if self._curve is not None:
            self._curve.update(now)
        self._share = self.factor * self._own_share(now)
        self.block.put(ACTS, float(self._share > 0.0))  # before what it leads to
        self._axis.mechanism.burden(self.block.name, self._whole.times(self._share), now)
        self._due = None if self._condition is None else self._condition.change(now)

    def _own_share(self, now: Nanos) -> float:
        """How much of it there is without faults."""
        whole = 1.0 if self._curve is None else self._curve.value
        return whole if self._condition is None or self._condition.holds(now) else 0.0

    def is_other(self, now: Nanos) -> bool:
        """Whether a fault makes it more or less than it should be."""
        return self._share != self._own_share(now)

    def deadline(self) -> Nanos | None:
        deadlines = (self._due, None if self._curve is None else self._curve.due)
        return min((due for due in deadlines if due is not None), default=None)

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        if self._condition is not None:
            self._condition.forget()


LOAD_IS_CHANGED = Message("simulation.load-is-changed", "{name} is {factor:g} times what it should be")


def _change(active: ActiveFault, load: FurtherLoad, begins: bool, now: Nanos) -> str:
    load.factor = active.fault.number("factor") if begins else 1.0
    return LOAD_IS_CHANGED(name=load.block.name, factor=load.factor)


def _is_other(active: ActiveFault, load: FurtherLoad, now: Nanos) -> bool:
    return load.is_other(now)


def _make(spec: LoadSpec, context: ElementContext) -> FurtherLoad:
    block, axis = context.terminal_block(spec.name), find_axis(spec.axis, context)
    build = axis.mechanism.build
    if build.motor is None:
        raise Misuse(f"axis {spec.axis!r} has no [axis.motor]: without, it moves any load")
    whole = burden_of(spec.loading, axis.scale, "load")
    if build.coasts_unpowered:
        most = max((share for _, share in spec.points or ()), default=1.0)
        build.motor.check_coasting(most * (abs(whole.load) + whole.friction))
    curve = None
    if spec.of is not None and spec.points is not None:
        curve = Stepped(signal_of("of", block, context, spec.of), spec.points, spec.resolution)
    condition = None if spec.when is None else condition_of(spec.when, block, context)
    return FurtherLoad(block, axis, whole, condition, curve, tuple(owner for _, owner in spec.over()))


LOAD = with_terminals(
    LoadSpec,
    make=_make,
    signals=lambda load: {"share": SignalOf((load.block.source,), load.share, bounds=(0.0, load.most))},
    faults=(
        FaultKind(
            "other-load",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A load is a multiple of what it should be.",
            own=(number("factor", "Of its mass, forces and torques; 0: it is missing.", 0.0, MOST_SHARE, default=2.0),),
            effect=ElementEffect(_change, _is_other),
        ),
    ),
)
