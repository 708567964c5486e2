"""The event kernel: machines, wires between their pins, and what stands between them.

A kernel is itself a machine in virtual time. Machines that share no wire belong into kernels of their own, so that each is
advanced only when something happens to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import Drive, Fact, MotionController, Nanos, PinEdge
from steptwin.motion import Profile
from steptwin.motion.divisions import profile_of
from steptwin.state import Plain
from steptwin.world.trace import Recorder, TraceRecord

MAX_ROUNDS_PER_INSTANT = 1000
"""Signals propagate in zero time; more rounds than this at one moment are a loop of wires."""


class KernelPart(Protocol):
    """What stands between machines: mechanics, a switch, a source, a line. Its state is plain (`steptwin.state.Stateful`)."""

    def deadline(self) -> Nanos | None:
        """When something happens by itself; as for a machine."""
        ...

    def look(self, now: Nanos) -> None:
        """Do what is due by ``now`` and react to what machines did; called until nothing changes. Levels go to `Kernel.drive`."""
        ...

    def copy_state(self) -> Plain: ...
    def set_state(self, plain: Plain) -> None: ...


class PinName(NamedTuple):
    machine: str
    pin: str

    def __str__(self) -> str:
        return f"{self.machine}.{self.pin}"


@dataclass(frozen=True, slots=True)
class Wire:
    """From an output to an input; ``inverted`` turns the level round, which arrives ``delay`` later."""

    source: PinName
    target: PinName
    inverted: bool = False
    delay: Nanos = 0

    def __post_init__(self) -> None:
        if self.delay < 0:
            raise Misuse(f"wire to {self.target}: a delay of {self.delay} ns is negative")

    def carried(self, level: float) -> float:
        """What arrives for a level of the source."""
        return (0.0 if level else 1.0) if self.inverted else level


class Flight(NamedTuple):
    """A level on its way along a wire."""

    arrival: Nanos
    target: PinName
    level: float


class KernelState(NamedTuple):
    """State of a kernel and of everything in it."""

    now: Nanos
    machines: tuple[Any, ...]
    parts: tuple[Plain, ...]
    levels: Mapping[PinName, float]
    flights: tuple[Flight, ...]


class Kernel:
    """Runs machines together. Ties in time are broken by the order in which machines and parts were added.

    Whoever commands a machine directly (a request, a pin) at a moment first advances the kernel to that moment, so that
    nothing on a wire is late; what the command leads to settles with the next `advance`, `deadline` or `settle`.

    ``record`` gets the first level of each driven input, every edge of an output and of an input, and every new plan of an axis.
    """

    def __init__(self, now: Nanos = 0, record: Recorder | None = None) -> None:
        self.now = now
        self.machines: dict[str, MotionController] = {}
        self.parts: list[KernelPart] = []
        self.observers: list[Callable[[str, PinEdge], None]] = []
        """Called with machine name and edge, in order, for every output edge."""
        self.stale = False
        """Something changed since signals last settled."""
        self.is_attentive = False
        """Whether a condition is on what a request may change without an event: then every request is one."""
        self.on_change: Callable[[Kernel], None] | None = None
        """Called with the kernel whenever something has happened in it, or something has changed from outside."""
        self._record = record
        self._wires: dict[PinName, list[Wire]] = {}
        self._levels: dict[PinName, float] = {}
        """What was driven to each input last."""
        self._given: dict[PinName, tuple[Nanos, float]] = {}
        """The last edge recorded of each input that was driven."""
        self._flights: list[Flight] = []
        self._plans: list[_Plans] = []
        """Of each machine, as recorded last."""
        self._due: Nanos | None = None

    # ------------------------------------------------------------------ what is in it

    def add(self, name: str, machine: MotionController) -> None:
        """Add a machine that is not ahead of the kernel's time (`TimeReversal`); its ``changed`` hook is taken."""
        if name in self.machines:
            raise Misuse(f"there is a machine {name!r} already")
        machine.advance(self.now)
        self.machines[name] = machine
        self._plans.append(_Plans(name, machine))
        machine.changed = self.mark
        self.mark()

    def replace(self, name: str, machine: MotionController) -> None:
        """Replace the machine ``name`` by another one: one around it, with the same pins and axes."""
        if name not in self.machines:
            raise Misuse(f"no machine {name!r}: there are {', '.join(self.machines) or 'none'}")
        self.machines[name] = machine
        machine.changed = self.mark
        self.mark()

    def add_part(self, part: KernelPart) -> None:
        """Add something between machines; it looks at them when signals settle next."""
        self.parts.append(part)
        self.mark()

    def connect(self, wire: Wire) -> None:
        """Add a wire, along which the present level of the source has come to the target long ago."""
        self.check(wire.source)
        self.check(wire.target)
        self.drive(wire.target, wire.carried(self.machines[wire.source.machine].pins()[wire.source.pin]))
        self._wires.setdefault(wire.source, []).append(wire)
        self.mark()

    def check(self, name: PinName) -> None:
        """`Misuse` unless there is such a machine with such a pin."""
        machine = self.machines.get(name.machine)
        if machine is None:
            raise Misuse(f"no machine {name.machine!r}: there are {', '.join(self.machines) or 'none'}")
        if name.pin not in machine.pins():
            raise Misuse(f"{name.machine!r} has no pin {name.pin!r}: pins are {', '.join(machine.pins())}")

    def drive_of(self, machine: str, axis: int) -> Drive:
        """The drive of ``axis`` (from 1). `Misuse` where there is none."""
        found = self.machines.get(machine)
        axes = () if found is None else found.axes
        if not 1 <= axis <= len(axes):
            raise Misuse(f"no axis {axis} of {machine!r}, which has {len(axes)} axes")
        return axes[axis - 1]

    def mark(self) -> None:
        """Something changed: signals have to settle."""
        self.stale = True
        if self.on_change is not None:
            self.on_change(self)

    # ------------------------------------------------------------------ levels

    def drive(self, target: PinName, level: float) -> None:
        """Give an input a level now; only a change is passed on."""
        before = self._levels.get(target)
        if before == level:
            return
        self._levels[target] = level
        self.give(target, level, is_first=before is None)

    def give(self, target: PinName, level: float, *, is_first: bool = False) -> None:
        """Drive an input now. Its resulting level, which a fault may hold, is recorded where it changes or ``is_first``.

        The machine's own report of the same edge is not recorded again.
        """
        machine, (_, pin) = self.machines[target.machine], target
        if self._record is None:
            machine.set_pin(pin, level, self.now)
            return
        known = self._given.get(target)
        before = machine.pins()[pin] if known is None else known[1]
        machine.set_pin(pin, level, self.now)
        after = machine.pins()[pin]
        if is_first or after != before:
            self.take_as_recorded(target, self.now, after)
            self._record(TraceRecord(self.now, target.machine, "edge", pin, after))

    def take_as_recorded(self, target: PinName, now: Nanos, level: float) -> None:
        """Mark an edge of an input as recorded, in case its machine reports it too."""
        self._given[target] = now, level

    def _send(self, wire: Wire, value: float) -> None:
        level = wire.carried(value)
        if wire.delay:
            self._flights.append(Flight(self.now + wire.delay, wire.target, level))
        else:
            self.drive(wire.target, level)

    def report(self, machine: str, kind: str, subject: str, value: object, *facts: Fact) -> None:
        """Something worth recording happens to a machine now."""
        if self._record is not None:
            self._record(TraceRecord(self.now, machine, kind, subject, value, facts))

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        if self.stale:
            self.settle()
        due = self._due
        if due is not None and due <= now:
            self._run(now)
        self.now = now

    def _run(self, now: Nanos) -> None:
        """Everything that is due by ``now``, in order."""
        if len(self.machines) == 1 and not self.parts and not self._wires:
            self._advance_alone(now)
        while self._due is not None and self._due <= now:
            self.now = self._due
            for machine in self.machines.values():
                due = machine.deadline()
                if due is not None and due <= self.now:
                    machine.advance(self.now)
            if self._flights:
                self._arrive()
            self.settle()

    def _advance_alone(self, now: Nanos) -> None:
        """What `advance` and `settle` do where there is one machine and nothing that could act on it."""
        ((name, machine),) = self.machines.items()
        (plans,) = self._plans
        due = self._due
        if due is None or due > now:
            return
        while due is not None and due <= now:
            self.now = due
            machine.advance(due)
            for edge in machine.take_edges():
                self._edge(name, edge)
            if self._record is not None:
                plans.report(self._record, due)
            due = machine.deadline()
        self._due = due
        self.stale = False
        if self.on_change is not None:
            self.on_change(self)

    def deadline(self) -> Nanos | None:
        """The next moment at which something happens by itself."""
        if self.stale:
            self.settle()
        return self._due

    def settle(self) -> None:
        """Carry edges along wires and let parts look until nothing changes; find the next deadline."""
        for _ in range(MAX_ROUNDS_PER_INSTANT):
            self.stale = False
            for part in self.parts:
                part.look(self.now)
            for name, machine in self.machines.items():
                for edge in machine.take_edges():
                    self._edge(name, edge)
            if not self.stale:
                break
        else:
            raise Runaway(f"signals did not settle after {MAX_ROUNDS_PER_INSTANT} rounds at {self.now} ns: a loop of wires")
        if self._record is not None:
            for plans in self._plans:
                plans.report(self._record, self.now)
        soonest = min(self._flights).arrival if self._flights else None
        for one in (*self.machines.values(), *self.parts):
            due = one.deadline()
            if due is not None and (soonest is None or due < soonest):
                soonest = due
        self._due = soonest
        if self.on_change is not None:
            self.on_change(self)

    def _edge(self, name: str, edge: PinEdge) -> None:
        pin = PinName(name, edge.pin)
        if self._record is not None and self._given.get(pin) != (edge.time, edge.value):
            self._record(TraceRecord(edge.time, name, "edge", edge.pin, edge.value))
            if pin in self._given:
                self._given[pin] = edge.time, edge.value
        for observer in self.observers:
            observer(name, edge)
        for wire in self._wires.get(pin, ()):
            self._send(wire, edge.value)

    def _arrive(self) -> None:
        """Levels that have come to the end of their wires."""
        arrived = [flight for flight in self._flights if flight.arrival <= self.now]
        self._flights = [flight for flight in self._flights if flight.arrival > self.now]
        for flight in arrived:
            self.drive(flight.target, flight.level)

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> KernelState:
        """State of everything at the kernel's moment."""
        if self.stale:
            self.settle()
        return KernelState(
            self.now,
            tuple(machine.snapshot() for machine in self.machines.values()),
            tuple(part.copy_state() for part in self.parts),
            self._levels.copy(),
            tuple(self._flights),
        )

    def restore(self, state: KernelState) -> None:
        """Take the state of a kernel with the same machines and parts."""
        self.now = state.now
        for machine, its_state in zip(self.machines.values(), state.machines, strict=True):
            machine.restore(its_state)
        for part, its_state in zip(self.parts, state.parts, strict=True):
            part.set_state(its_state)
        self._levels = dict(state.levels)
        self._given.clear()
        self._flights = list(state.flights)
        for plans in self._plans:
            plans.take_as_reported()
        self.settle()


class _Plans:
    """The plans and coordinates of a machine's axes, as recorded last."""

    __slots__ = ("_drives", "_name", "_origins", "_profiles", "_revisions")

    def __init__(self, name: str, machine: MotionController) -> None:
        self._name = name
        self._drives = [(i, str(i + 1), drive) for i, drive in enumerate(machine.axes)]
        self._revisions = [-1] * len(self._drives)
        self._profiles: list[Profile | None] = [None] * len(self._drives)
        self._origins = [0] * len(self._drives)

    def report(self, record: Recorder, now: Nanos) -> None:
        """Record new plans, and changes of coordinates. An axis at rest where its plan ended has no new plan."""
        for i, number, drive in self._drives:
            origin = drive.offset_p
            if origin != self._origins[i]:
                self._origins[i] = origin
                record(TraceRecord(now, self._name, "coordinate", number, origin))
            if self._revisions[i] == drive.revision:
                continue
            plan = drive.plan
            before, profile = self._profiles[i], profile_of(plan)
            self._revisions[i], self._profiles[i] = drive.revision, profile
            if before is None or not _only_rests(before, profile):
                record(TraceRecord(now, self._name, "plan", number, plan))

    def take_as_reported(self) -> None:
        for i, _, drive in self._drives:
            self._revisions[i], self._profiles[i] = drive.revision, profile_of(drive.plan)
            self._origins[i] = drive.offset_p


def _only_rests(before: Profile, after: Profile) -> bool:
    """Whether ``after`` is only the rest at the position where ``before`` has ended."""
    if after.segments or before.end is None or before.end > after.start:
        return False
    return before.base + before.counts[-1] == after.base
