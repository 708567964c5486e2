"""Signals: what conditions may speak of and scripts may read, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488
from steptwin.mic488.program import ProgramState
from steptwin.motion import Profile
from steptwin.motion.divisions import profile_of
from steptwin.wbc.nearmiss import NearMiss
from steptwin.world.build import Fitted, Plan
from steptwin.world.kernel import Kernel
from steptwin.world.lines import Line
from steptwin.world.names import Unknown


@dataclass(frozen=True, slots=True)
class SignalOf:
    """A signal, and the kernels that have to be at the moment asked for."""

    kernels: tuple[Kernel, ...]
    read: Callable[[Nanos], float]
    turning: Callable[[Nanos], Iterable[Nanos]] | None = None
    versions: Callable[[], object] | None = None

    @property
    def continuous(self) -> bool:
        return self.turning is not None

    def bring(self, now: Nanos) -> tuple[Kernel, ...]:
        """Bring the kernels on which the value at ``now`` depends to that moment; gives them. Until one of them changes, the
        value stays as it is or goes on as it goes."""
        for kernel in self.kernels:
            kernel.advance(now)
        return self.kernels

    def value(self, now: Nanos) -> float:
        return self.read(now)

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from () if self.turning is None else self.turning(now)

    def version(self) -> object:
        return None if self.versions is None else self.versions()


class Idle:
    """Whether all machines are idle, and nothing is on its way on a line. While one of them is busy the others do not matter."""

    continuous = False

    def __init__(self, plan: Plan) -> None:
        self._kernels = tuple(plan.kernels)
        self._things: list[tuple[Kernel, Callable[[Nanos], bool]]] = [
            *((plan.kernel_of[name], partial(is_idle, machine)) for name, machine in plan.machines.items()),
            *((plan.kernel_of[name], partial(_is_quiet, line)) for name, line in plan.lines.items()),
        ]
        self._busy: int | None = None
        """The thing that was found busy last."""

    def bring(self, now: Nanos) -> tuple[Kernel, ...]:
        """As `SignalOf.bring`: the kernel of what is busy, all of them when nothing is."""
        for n in (*(() if self._busy is None else (self._busy,)), *range(len(self._things))):
            kernel, is_at_rest = self._things[n]
            kernel.advance(now)
            if not is_at_rest(now):
                self._busy = n
                return (kernel,)
        self._busy = None
        return self._kernels

    def value(self, now: Nanos) -> float:
        """After `bring`."""
        return float(self._busy is None)

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from ()

    def version(self) -> object:
        return None


def find_signal(plan: Plan, name: str) -> SignalOf | Idle:
    """The signal called ``name``. `Misuse` with what there is."""
    if name == "time":
        return SignalOf((), lambda now: now / SECOND, lambda now: (), lambda: name)
    if name == "idle":
        return Idle(plan)
    owner, _, rest = name.partition(".")
    if owner in plan.axes:
        return _of_axis(plan.axes[owner], rest, name)
    if owner in plan.buttons:
        button, kernel = plan.buttons[owner]
        return _chosen({"pressed": SignalOf((kernel,), lambda now: float(button.pressed))}, rest, name)
    machine = plan.machines.get(owner)
    if machine is None:
        known = [*plan.machines, *plan.axes, *plan.buttons, "time", "idle"]
        near = NearMiss().of(owner, known)
        hint = f" (did you mean {near!r}?)" if near else ""
        raise Unknown(owner, f"no signal {name!r}: nothing is called {owner!r}{hint}; there are {', '.join(known)}")
    kernel = plan.kernel_of[owner]
    pins = machine.pins()
    if rest.upper() in pins:
        pin = rest.upper()
        return SignalOf((kernel,), lambda now: float(machine.pins()[pin]))
    if isinstance(machine, Mic488):
        return _of_mic488(machine, kernel, rest, name)
    return _of_m1486(machine, kernel, rest, name)


def _is_quiet(line: Line, now: Nanos) -> bool:
    """Whether nothing is on its way on a line."""
    return line.deadline() is None


def is_idle(machine: Mic488 | M1486, now: Nanos) -> bool:
    """Whether all axes stand and no program runs."""
    if isinstance(machine, M1486):
        return machine.is_idle()
    running = machine.program.state is ProgramState.RUNNING
    return not running and not any(axis.profile.moving(now) for axis in machine.axes)


def _chosen(known: Mapping[str, SignalOf], rest: str, name: str, others: str = "") -> SignalOf:
    found = known.get(rest.lower())
    if found is None:
        near = NearMiss().of(rest, known)
        hint = f" (did you mean {near!r}?)" if near else ""
        raise Misuse(f"no signal {name!r}{hint}; there are {', '.join(known)}{others}")
    return found


def _turns_of(profile: Callable[[], Profile]) -> Callable[[Nanos], Iterator[Nanos]]:
    def turns(now: Nanos) -> Iterator[Nanos]:
        present = profile()
        for end in present.ends:
            if end != float("inf") and present.start + int(end) > now:
                yield present.start + int(end)

    return turns


def _of_mic488(device: Mic488, kernel: Kernel, rest: str, name: str) -> SignalOf:
    number, _, quantity = rest.partition(".")
    if quantity and number.upper() in {f"M{axis.number}" for axis in device.axes}:
        axis = device.axes[int(number[1:]) - 1]
        return _chosen(_mic488_axis(axis, kernel), quantity, name)
    known = {
        "status": SignalOf((kernel,), lambda now: float(device.status())),
        "program": SignalOf((kernel,), lambda now: float(device.program.state)),
    }
    return _chosen(known, rest, name, ", M1.position and so on, and pins")


def _mic488_axis(axis: Axis, kernel: Kernel) -> dict[str, SignalOf]:
    turning = _turns_of(lambda: axis.profile)

    def version() -> object:
        return axis.revision, axis.offset_p

    return {
        "status": SignalOf((kernel,), lambda now: float(axis.status)),
        "enabled": SignalOf((kernel,), lambda now: float(axis.enabled)),
        "moving": SignalOf((kernel,), lambda now: float(axis.profile.moving(now)), turning, version),
        "position": SignalOf((kernel,), lambda now: axis.coordinate_p(now) / axis.gear, turning, version),
        "velocity": SignalOf((kernel,), lambda now: axis.profile.velocity(now) / axis.gear, turning, version),
        "encoder": SignalOf((kernel,), lambda now: float(axis.encoder_counts(now)), turning),
    }


def _of_m1486(chip: M1486, kernel: Kernel, rest: str, name: str) -> SignalOf:
    def velocity(now: Nanos) -> float:
        return chip.drive.profile.velocity(now)

    def version() -> object:
        return chip.drive.revision

    turning = _turns_of(lambda: chip.drive.profile)
    known = {
        "position": SignalOf((kernel,), lambda now: float(chip.drive.true_u(now)), turning, version),
        "velocity": SignalOf((kernel,), velocity, turning, version),
        "counter": SignalOf((kernel,), lambda now: float(chip.drive.counter_u(now)), turning),
        "moving": SignalOf((kernel,), lambda now: float(chip.drive.is_busy)),
        "variable": SignalOf((kernel,), lambda now: float(chip.unit.variable)),
    }
    return _chosen(known, rest, name, ", and pins")


def _of_axis(axis: Fitted, rest: str, name: str) -> SignalOf:
    mechanism = axis.mechanism

    def turning(now: Nanos) -> Iterator[Nanos]:
        course = mechanism.course(now)
        ends = set(_turns_of(lambda: profile_of(course.plan))(now)) | {piece.begin for piece in course.pieces}
        yield from sorted(moment for moment in ends if moment > now)

    kernel = (axis.kernel,)
    known = {
        "position": SignalOf(kernel, lambda now: axis.units(mechanism.place(now)), turning, mechanism.version),
        "lost": SignalOf(kernel, lambda now: float(mechanism.lost(now)), turning, mechanism.version),
        "stalled": SignalOf(kernel, lambda now: float(mechanism.at(now).stalled), turning, mechanism.version),
    }
    return _chosen(known, rest, name)
