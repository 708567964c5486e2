"""Faults of elements of a world: each lasts from one moment to another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import NONE, Message
from steptwin.simulation.faults.active import ANOTHER_LASTS, ActiveFault, Faults, HeldLevel
from steptwin.simulation.faults.table import Fault, FaultKind
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.state import Stateful

FAULT_OF_ANOTHER_ELEMENT = Message(
    "simulation.fault-of-another-element", "fault {name}: element = {element!r}, whose faults are {names}"
)


class FaultyElement(Stateful):
    """A part of the scheduler beside an element, which applies the effects of its faults to the built object."""

    FIXED: ClassVar[tuple[str, ...]] = ("_faults", "_is_watching", "_scheduler", "_kinds", "_part", "_signals", "name")
    __slots__ = (*FIXED, "_lasting")

    def __init__(
        self,
        scheduler: Scheduler,
        name: str,
        faults: Faults,
        kinds: Iterable[FaultKind],
        part: Any,
        signals: Callable[[], Mapping[str, SignalOf]],
    ) -> None:
        self.name = name
        self._signals = signals
        self._is_watching = False
        self._scheduler = scheduler
        self._faults = faults
        self._kinds = tuple(kinds)
        self._part = part
        self._lasting: tuple[str, ...] = ()
        """Names of the faults that have begun, in this order."""

    def check(self, fault: Fault) -> None:
        """`Misuse` for a fault of another kind of element."""
        if fault.kind not in self._kinds:
            there = [kind.name for kind in self._kinds] or NONE()
            raise Misuse(FAULT_OF_ANOTHER_ELEMENT(name=fault.kind.name, element=self.name, names=there))
        if fault.kind.check is not None:
            fault.kind.check(self._part, fault)

    def begin(self, active: ActiveFault) -> None:
        """A fault has been set."""
        self._scheduler.notify()

    def end(self, active: ActiveFault, now: Nanos) -> None:
        """A fault has been removed."""
        if active.name in self._lasting:
            self._turn(active, now, begins=False)
        self._scheduler.notify()

    def held(self) -> Iterator[tuple[str, HeldLevel]]:
        """The terminals that faults hold, in small letters."""
        for active in self._begun():
            holds = active.fault.kind.effect.holds
            if holds:
                yield str(active.fault.get(holds)).lower(), HeldLevel(active.name, active.fault.number("level"))

    def update(self, now: Nanos) -> None:
        for active in self._faults.of_element(self.name):
            lasts = active.begin <= now and (active.end is None or now < active.end)
            if lasts is not (active.name in self._lasting):
                self._turn(active, now, begins=lasts)

    def _turn(self, active: ActiveFault, now: Nanos, *, begins: bool) -> None:
        others = tuple(name for name in self._lasting if name != active.name)
        self._lasting = (*others, active.name) if begins else others
        if begins:
            active.struck += 1
        act = active.fault.kind.effect.act
        other = None if begins else self._newest_like(active)
        if other is None:
            text = act(active, self._part, begins, now)
        else:
            act(other, self._part, True, now)
            text = ANOTHER_LASTS(other=other.name)
        self._scheduler.notify()  # the part may have been updated already at this moment
        self._faults.report(active, self.name, now, text)

    # ------------------------------------------------------------------ subscriber of its scheduler, while it has faults

    def watch(self) -> None:
        """As `FailingElement.watch`."""
        watches = bool(self._faults.of_element(self.name))
        if watches and not self._is_watching:
            sources = {source for signal in self._signals().values() for source in signal.sources}
            self._scheduler.subscribe(self, sorted(one.name for one in sources if one.scheduler is self._scheduler))
        elif self._is_watching and not watches:
            self._scheduler.unsubscribe(self)
        self._is_watching = watches

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        """Note what its faults do."""
        begun = self._begun()
        for active in self._faults.of_element(self.name):
            is_newest = active in begun and self._newest_like(active) is active
            self._faults.does(active, active.fault.kind.effect.acts(active, self._part, now) if is_newest else None, now)

    def _begun(self) -> list[ActiveFault]:
        """Those that have begun, in this order."""
        begun = (active for active in self._faults.of_element(self.name) if active.name in self._lasting)
        return sorted(begun, key=lambda active: self._lasting.index(active.name))

    def _newest_like(self, ended: ActiveFault) -> ActiveFault | None:
        """The fault of the same kind and part of the element that has begun last."""
        return next((other for other in reversed(self._begun()) if _part_of(other.fault) == _part_of(ended.fault)), None)

    def deadline(self) -> Nanos | None:
        now = self._scheduler.now
        moments = (moment for active in self._faults.of_element(self.name) for moment in (active.begin, active.end))
        return min((moment for moment in moments if moment is not None and moment > now), default=None)


def _part_of(fault: Fault) -> tuple[object, ...]:
    """The part of its element that a fault concerns: words name it, numbers are what happens to it."""
    given = (fault.get(parameter.name) for parameter in fault.kind.parameters)
    return (fault.kind.name, *(word.lower() for word in given if isinstance(word, str)))
