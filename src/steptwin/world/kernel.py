"""The event kernel: machines, wires between their pins, switches that an axis runs over.

A kernel is itself a machine in virtual time. Machines that share no wire belong into kernels of their own, so that each is
advanced only when something happens to it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import Edge, Nanos, PinMachine
from steptwin.motion import Profile

MAX_ROUNDS_PER_INSTANT = 1000
"""Signals propagate in zero time; more rounds than this at one moment are a loop of wires."""


class Drive(Protocol):
    """An axis whose commanded profile can be read. ``revision`` counts replacements of ``profile``."""

    @property
    def profile(self) -> Profile: ...
    @property
    def revision(self) -> int: ...


class DrivingMachine(PinMachine, Protocol):
    """A machine with pins and axes."""

    changed: Callable[[], None]

    @property
    def axes(self) -> Sequence[Drive]: ...


class PinName(NamedTuple):
    machine: str
    pin: str

    def __str__(self) -> str:
        return f"{self.machine}.{self.pin}"


@dataclass(frozen=True, slots=True)
class Wire:
    """From an output to an input; ``inverted`` turns the level round."""

    source: PinName
    target: PinName
    inverted: bool = False


@dataclass(frozen=True, slots=True)
class PositionSwitch:
    """A switch that is on while an axis stands from ``low`` to ``high`` (counted pulses since power-on; None is open).

    ``axis`` counts from 1. ``normally_closed`` gives 0 while the switch is on.
    """

    machine: str
    axis: int
    low: int | None
    high: int | None
    target: PinName
    normally_closed: bool = False

    def __post_init__(self) -> None:
        if self.low is not None and self.high is not None and self.low > self.high:
            raise Misuse(f"switch on {self.target}: low {self.low} imp is above high {self.high} imp")

    def on(self, count: int) -> bool:
        return (self.low is None or count >= self.low) and (self.high is None or count <= self.high)

    def next_change(self, profile: Profile, now: Nanos) -> Nanos | None:
        """First moment after ``now`` at which the axis crosses an edge of the switch. Counts go one by one."""
        count = profile.count(now)
        if self.low is not None and count < self.low:
            ahead = [self.low]
        elif self.high is not None and count > self.high:
            ahead = [self.high]
        else:
            ahead = [] if self.low is None else [self.low - 1]
            ahead += [] if self.high is None else [self.high + 1]
        times = [t for edge in ahead if (t := profile.pulse_time(edge, now)) is not None]
        return min(times, default=None)


class _Watched:
    """A switch with its prediction."""

    __slots__ = ("due", "revision", "switch")

    def __init__(self, switch: PositionSwitch) -> None:
        self.switch = switch
        self.revision = -1
        self.due: Nanos | None = None


class Kernel:
    """Runs machines together. Ties in time are broken by the order in which machines were added.

    Whoever commands a machine directly (a request, a pin) at a moment first advances the kernel to that moment, so that
    nothing on a wire is late; what the command leads to settles with the next `advance`, `deadline` or `settle`.
    """

    def __init__(self, now: Nanos = 0) -> None:
        self.now = now
        self.machines: dict[str, DrivingMachine] = {}
        self.observers: list[Callable[[str, Edge], None]] = []
        """Called with machine name and edge, in order, for every output edge."""
        self._wires: dict[PinName, list[Wire]] = {}
        self._watched: list[_Watched] = []
        self._due: Nanos | None = None
        self.stale = False
        """Something changed since signals last settled."""

    def add(self, name: str, machine: DrivingMachine) -> None:
        """Add a machine that is not ahead of the kernel's time (`TimeReversal`); its ``changed`` hook is taken."""
        if name in self.machines:
            raise Misuse(f"there is a machine {name!r} already")
        machine.advance(self.now)
        self.machines[name] = machine
        machine.changed = self._mark
        self._mark()

    def replace(self, name: str, machine: DrivingMachine) -> None:
        """Let another machine stand where ``name`` stands: one around it, with the same pins and axes."""
        if name not in self.machines:
            raise Misuse(f"no machine {name!r}: there are {', '.join(self.machines) or 'none'}")
        self.machines[name] = machine
        machine.changed = self._mark
        self._mark()

    def connect(self, wire: Wire) -> None:
        """Add a wire; the target takes the source's present level at once."""
        self._check(wire.source)
        self._check(wire.target)
        self._drive(wire, self.machines[wire.source.machine].pins()[wire.source.pin])
        self._wires.setdefault(wire.source, []).append(wire)
        self._mark()

    def place(self, switch: PositionSwitch) -> None:
        """Add a switch; its input takes its present state at once."""
        self._check(switch.target)
        machine = self.machines.get(switch.machine)
        axes = 0 if machine is None else len(machine.axes)
        if not 1 <= switch.axis <= axes:
            raise Misuse(f"switch on {switch.target}: no axis {switch.axis} of {switch.machine!r}, which has {axes} axes")
        watched = _Watched(switch)
        self._look(watched)
        self._watched.append(watched)
        self._mark()

    def _check(self, name: PinName) -> None:
        machine = self.machines.get(name.machine)
        if machine is None:
            raise Misuse(f"no machine {name.machine!r}: there are {', '.join(self.machines) or 'none'}")
        if name.pin not in machine.pins():
            raise Misuse(f"{name.machine!r} has no pin {name.pin!r}: pins are {', '.join(machine.pins())}")

    def _mark(self) -> None:
        self.stale = True

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        if self.stale:
            self.settle()
        while self._due is not None and self._due <= now:
            self.now = self._due
            for machine in self.machines.values():
                due = machine.deadline()
                if due is not None and due <= self.now:
                    machine.advance(self.now)
            self.settle()
        self.now = now

    def deadline(self) -> Nanos | None:
        """The next moment at which something happens by itself."""
        if self.stale:
            self.settle()
        return self._due

    def settle(self) -> None:
        """Carry edges along wires and states of switches to inputs until nothing changes; find the next deadline."""
        for _ in range(MAX_ROUNDS_PER_INSTANT):
            self.stale = False
            self._look_at_switches()
            for name, machine in self.machines.items():
                for edge in machine.take_edges():
                    for observer in self.observers:
                        observer(name, edge)
                    for wire in self._wires.get(PinName(name, edge.pin), ()):
                        self._drive(wire, edge.value)
            if not self.stale:
                break
        else:
            raise Runaway(f"signals did not settle after {MAX_ROUNDS_PER_INSTANT} rounds at {self.now} ns: a loop of wires")
        dues = [due for machine in self.machines.values() if (due := machine.deadline()) is not None]
        dues += [watched.due for watched in self._watched if watched.due is not None]
        self._due = min(dues, default=None)

    def _drive(self, wire: Wire, value: float) -> None:
        level = (0.0 if value else 1.0) if wire.inverted else value
        self.machines[wire.target.machine].set_pin(wire.target.pin, level, self.now)

    def _look_at_switches(self) -> None:
        for watched in self._watched:
            drive = self._drive_of(watched.switch)
            if watched.revision != drive.revision or (watched.due is not None and watched.due <= self.now):
                self._look(watched)

    def _look(self, watched: _Watched) -> None:
        switch = watched.switch
        drive = self._drive_of(switch)
        watched.revision = drive.revision
        watched.due = switch.next_change(drive.profile, self.now)
        level = float(switch.on(drive.profile.count(self.now)) is not switch.normally_closed)
        target = self.machines[switch.target.machine]
        if target.pins()[switch.target.pin] != level:
            target.set_pin(switch.target.pin, level, self.now)

    def _drive_of(self, switch: PositionSwitch) -> Drive:
        return self.machines[switch.machine].axes[switch.axis - 1]
