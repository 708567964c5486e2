"""Active faults: when each one occurs, and the set of faults of a world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar, NamedTuple, Protocol, TypeAlias
from weakref import WeakSet

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import NONE, Message, MessageText
from steptwin.simulation.faults.table import Fault, Layer
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.state import Stateful

_MULTIPLE = 0x10
_LAST_WITH_COUNT = 4
_LAST_ADDRESSED = 6


class ActiveFault(Stateful):
    """An active fault, its counters and its random stream. Times count from ``since``."""

    FIXED: ClassVar[tuple[str, ...]] = ("_count", "_every", "_from", "_nth", "_probability", "_until", "fault", "name", "since")
    __slots__ = (*FIXED, "chance", "doing", "due", "left", "seen", "struck", "worn")

    def __init__(self, fault: Fault, name: str, seed: int, since: Nanos) -> None:
        self.fault = fault
        self.name = name
        self.since = since
        self._from = self._moment("from_s") or since
        self._until = self._moment("until_s")
        self._nth = fault.whole("nth")
        self._every = fault.whole("every") or 1
        self._count = fault.whole("count")
        self._probability = fault.number("probability") if fault.kind.parameter("probability") else 1.0
        self.chance = Chance(seed, name)
        self.seen = 0
        """Number of occasions so far."""
        self.struck = 0
        """Number of occurrences."""
        self.left = 0
        """Bytes still to be lost."""
        self.doing: object = None
        """The effect that it has at present, while it lasts; nothing if that is false."""
        self.due: Nanos | None = self._moment("at_s")
        """The next moment of a timed fault."""
        self.worn: list[int] = []
        """Addresses of worn bytes of the memory."""

    def _moment(self, name: str) -> Nanos | None:
        seconds = self.fault.get(name)
        return None if not isinstance(seconds, float) else self.since + round(seconds * SECOND)

    @property
    def begin(self) -> Nanos:
        return self._from

    @property
    def end(self) -> Nanos | None:
        return self._until

    def strikes(self, now: Nanos) -> bool:
        """Count an occasion; returns whether the fault occurs."""
        if now < self._from or (self._until is not None and now > self._until):
            return False
        if self._count is not None and self.struck >= self._count:
            return False
        self.seen += 1
        if (self._nth is not None and self.seen != self._nth) or self.seen % self._every:
            return False
        if self._probability < 1.0 and not self.chance.happens(self._probability):
            return False
        self.struck += 1
        return True

    def step(self) -> None:
        """Find the moment after ``due``."""
        period = self.fault.get("period_s")
        if self.due is None or not isinstance(period, float):
            self.due = None
            return
        self.due += round(period * SECOND)
        if (self._until is not None and self.due > self._until) or (self._count is not None and self.struck >= self._count):
            self.due = None

    def ns(self, name: str) -> Nanos:
        """A duration, whichever unit its name has."""
        return round(self.fault.number(name) * (SECOND if name.endswith("_s") else SECOND // 1000))

    def matches(self, unit: int, pdu: bytes) -> bool:
        """Whether a request is addressed."""
        get = self.fault.get
        wanted, function, span = get("unit"), get("function"), get("address")
        if (wanted is not None and wanted != unit) or (function is not None and (not pdu or pdu[0] != function)):
            return False
        if not isinstance(span, tuple):
            return True
        touched = addresses(pdu)
        return touched is not None and touched.start <= span[1] and span[0] < touched.stop

    def is_on(self, link: str, line: str) -> bool:
        """Whether it is meant for ``link`` (empty: not known; ``tcp``: each of it) of ``line`` (empty: none of a world)."""
        get = self.fault.get
        wanted = get("link")
        return (not link or wanted in (None, link, link.rpartition("-")[0])) and get("line") in (None, line)


def addresses(pdu: bytes) -> range | None:
    """The addresses of a request; None if it names none."""
    if len(pdu) < 5 or not (0 < pdu[0] <= _LAST_ADDRESSED or pdu[0] == _MULTIPLE):
        return None
    first = pdu[1] << 8 | pdu[2]
    single = _LAST_WITH_COUNT < pdu[0] <= _LAST_ADDRESSED
    return range(first, first + (1 if single else pdu[3] << 8 | pdu[4]))


ANOTHER_LASTS = Message("simulation.another-fault-lasts", "it ends, but fault {other} lasts")
HELD_AT = Message("simulation.held-at", "held at {level:g} by fault {fault}")


class HeldLevel(NamedTuple):
    """Level at which a fault keeps a pin or terminal; ``fault``: its name."""

    fault: str
    level: float

    def description(self) -> MessageText:
        """As "held at 0 by fault stuck"."""
        return HELD_AT(level=self.level, fault=self.fault)


class FaultActs(NamedTuple):
    """How often a fault has made a difference, with the first and the last moment."""

    count: int
    first: Nanos
    last: Nanos


class ActSubscriber(Protocol):
    """It is called when a fault acts; with ``begins`` False, when a lasting one no longer makes a difference."""

    def __call__(self, active: ActiveFault, now: Nanos, *, begins: bool) -> object: ...


FaultReporter: TypeAlias = Callable[[ActiveFault, str], None]
"""Reports that a fault has happened, and what it did."""


class Failing(Protocol):
    """A machine or an element, and the faults of it that are set."""

    def check(self, fault: Fault) -> None:
        """Raises `Misuse` for a fault that is impossible there."""
        ...

    def begin(self, active: ActiveFault) -> None:
        """A fault was set."""
        ...

    def end(self, active: ActiveFault, now: Nanos) -> None:
        """Remove a fault and release what it holds."""
        ...

    def held(self) -> Iterator[tuple[str, HeldLevel]]:
        """The pins or terminals that faults hold."""
        ...


class FailingElement(Failing, Protocol):
    """An element with faults."""

    def watch(self) -> None:
        """The set of faults has changed: watch the element while it has one."""
        ...


class FailingPort(Protocol):
    """A port whose bytes and frames faults alter."""

    def choose(self) -> None:
        """The set of faults has changed."""
        ...


FAULT_IS_SET_ALREADY = Message("simulation.fault-is-set-already", "there is a fault {name!r} already")
UNKNOWN_FAULT = Message("simulation.unknown-fault", "no fault {name!r}: set are {names}")
NO_CONTROLLER_OF_A_FAULT = Message("simulation.no-controller-of-a-fault", "fault {name}: choose a controller: there are {names}")
UNKNOWN_CONTROLLER_OF_A_FAULT = Message(
    "simulation.unknown-controller-of-a-fault", "fault {name}: machine = {controller}: there are {names}"
)
UNKNOWN_ELEMENT_OF_A_FAULT = Message(
    "simulation.unknown-element-of-a-fault", "fault {name}: element = {element}: those that can fail are {names}"
)


class Faults(Stateful):
    """The faults of a world. The random stream of a fault depends only on ``seed`` and its name.

    ``sinks`` are called with every occurrence, as a record of kind ``fault``, and with the edges that faults cause. ``acts`` has,
    by name, how often each fault has made a difference, also of those that were removed. The set of faults is not part of its
    state: a state is restored into the same set.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_found",
        "act_subscribers",
        "reserved",
        "controllers",
        "elements",
        "has_supplies",
        "link",
        "ports",
        "seed",
        "sinks",
    )
    __slots__ = (*FIXED, "_active", "acts")

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed
        self._active: tuple[ActiveFault, ...] = ()
        self._found: dict[tuple[str, object], tuple[ActiveFault, ...]] = {}
        """Those of a layer, controller or element, as far as they have been asked for."""
        self.sinks: list[RecordSink] = []
        self.acts: dict[str, FaultActs] = {}
        self.act_subscribers: list[ActSubscriber] = []
        self.reserved: set[str] = set()
        """Names that no fault gets that has none: of faults that are left out of a run."""
        self.controllers: dict[str, Failing] = {}
        """Controllers prepared for faults of physics."""
        self.elements: dict[str, FailingElement] = {}
        """Elements with faults."""
        self.link = ""
        """The link whose request is being served."""
        self.has_supplies = False
        """Whether controllers may be without supply, so that they do not answer."""
        self.ports: WeakSet[FailingPort] = WeakSet()
        """Ports in use, which change with programs and clients."""

    @property
    def active(self) -> tuple[ActiveFault, ...]:
        """In the order in which they were set."""
        return self._active

    @active.setter
    def active(self, active: tuple[ActiveFault, ...]) -> None:
        self._active = active
        self._found.clear()
        for element in self.elements.values():
            element.watch()

    @property
    def interfere(self) -> bool:
        """Whether what ports receive and send may be altered."""
        return bool(self.active) or self.has_supplies

    def expect_supplies(self) -> None:
        """Controllers may be without supply from now on."""
        self.has_supplies = True
        self._changed()

    def add(self, fault: Fault, now: Nanos = 0) -> ActiveFault:
        """Set a fault at ``now``. Raises `Misuse` for a name in use, or an unknown controller, pin or axis."""
        if fault.name and self.find(fault.name) is not None:
            raise Misuse(FAULT_IS_SET_ALREADY(name=fault.name))
        active = ActiveFault(fault, self.name_of(fault), self.seed, now)
        failing = self.check(fault)
        self.active = (*self.active, active)
        if failing is not None:
            failing.begin(active)
        self._changed()
        return active

    def check(self, fault: Fault) -> Failing | None:
        """The controller or element of the fault, if any. `Misuse` for a controller, pin, axis or element that does not exist."""
        failing = self._failing(fault)
        if failing is not None:
            failing.check(fault)
        return failing

    def _failing(self, fault: Fault) -> Failing | None:
        if fault.kind.layer is Layer.ELEMENT:
            return self._element(fault)
        return self._controller(fault) if fault.kind.layer is Layer.PHYSICS else None

    def remove(self, name: str, now: Nanos) -> None:
        """Remove a fault and release what it holds. Raises `Misuse` with the existing names."""
        active = self.called(name)
        self.active = tuple(a for a in self.active if a is not active)
        failing = self._failing(active.fault)
        if failing is not None:
            failing.end(active, now)
        self.does(active, None, now)
        self._changed()

    def called(self, name: str) -> ActiveFault:
        """The active fault called ``name``. Raises `Misuse` with the existing names."""
        active = self.find(name)
        if active is None:
            raise Misuse(UNKNOWN_FAULT(name=name, names=[a.name for a in self.active] or NONE()))
        return active

    def clear(self, now: Nanos) -> None:
        for active in self.active:
            self.remove(active.name, now)

    def find(self, name: str) -> ActiveFault | None:
        """The active fault called ``name``; None if there is none."""
        return next((active for active in self.active if active.name == name), None)

    def name_of(self, fault: Fault) -> str:
        """The name that a fault has if it is set now."""
        kind, number = fault.kind.name, 1
        name = fault.name or kind
        while not fault.name and (self.find(name) is not None or name in self.reserved):
            number += 1
            name = f"{kind}-{number}"
        return name

    def _controller(self, fault: Fault) -> Failing:
        wanted = fault.get("machine")
        if wanted is None and len(self.controllers) == 1:
            return next(iter(self.controllers.values()))
        there = list(self.controllers) or NONE()
        if wanted is None:
            raise Misuse(NO_CONTROLLER_OF_A_FAULT(name=fault.kind.name, names=there))
        controller = self.controllers.get(str(wanted))
        if controller is None:
            raise Misuse(UNKNOWN_CONTROLLER_OF_A_FAULT(name=fault.kind.name, controller=repr(wanted), names=there))
        return controller

    def _element(self, fault: Fault) -> Failing:
        wanted = fault.get("element")
        found = self.elements.get(str(wanted))
        if found is None:
            there = list(self.elements) or NONE()
            raise Misuse(UNKNOWN_ELEMENT_OF_A_FAULT(name=fault.kind.name, element=repr(wanted), names=there))
        return found

    def of_element(self, name: str) -> tuple[ActiveFault, ...]:
        """The faults of an element."""
        return self._those("element", name, lambda fault: fault.get("element") == name)

    def of(self, controller: str) -> tuple[ActiveFault, ...]:
        """The faults of physics of a controller."""
        only = len(self.controllers) == 1

        def belongs(fault: Fault) -> bool:
            named = fault.get("machine")
            return fault.kind.layer is Layer.PHYSICS and (named == controller or (only and not named))

        return self._those("controller", (controller, only), belongs)

    def of_layer(self, layer: Layer) -> tuple[ActiveFault, ...]:
        """The faults of one layer."""
        return self._those("layer", layer, lambda fault: fault.kind.layer is layer)

    def _those(self, by: str, key: object, belongs: Callable[[Fault], bool]) -> tuple[ActiveFault, ...]:
        """Those that belong to a key: every event asks for them, and they change with `active` only."""
        found = self._found.get((by, key))
        if found is None:
            found = self._found[by, key] = tuple(active for active in self._active if belongs(active.fault))
        return found

    def held(self, owner: str) -> dict[str, HeldLevel]:
        """The pins of a controller, or terminals of an element, that faults hold at present, as conditions name them."""
        failing = self.controllers.get(owner) or self.elements.get(owner)
        return {} if failing is None else {f"{owner}.{terminal}": held for terminal, held in failing.held()}

    def refusing(self) -> tuple[ActiveFault, ...]:
        """The faults that refuse a request."""
        return self._those("refusing", None, lambda fault: fault.refuses)

    def _changed(self) -> None:
        for port in list(self.ports):
            port.choose()

    def act(self, active: ActiveFault, now: Nanos) -> None:
        """Count that a fault makes a difference."""
        before = self.acts.get(active.name)
        self.acts[active.name] = FaultActs(1, now, now) if before is None else FaultActs(before.count + 1, before.first, now)
        for subscriber in self.act_subscribers:
            subscriber(active, now, begins=True)

    def does(self, active: ActiveFault, doing: object, now: Nanos) -> None:
        """Note what a lasting fault does; false: nothing. It acts when that becomes something else."""
        if doing == active.doing:
            return
        was, active.doing = active.doing, doing
        if doing:
            self.act(active, now)
        elif was:
            for subscriber in self.act_subscribers:
                subscriber(active, now, begins=False)

    def report(self, active: ActiveFault, place: str, now: Nanos, text: str) -> None:
        """Report an occurrence at a controller or link."""
        self.record(TraceRecord(now, place, "fault", active.name, text))

    def record(self, record: TraceRecord) -> None:
        for sink in self.sinks:
            sink(record)
