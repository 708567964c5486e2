"""Signals: what conditions may speak of and scripts may read, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488
from steptwin.mic488.program import ProgramState
from steptwin.motion import Profile
from steptwin.wbc.nearmiss import NearMiss
from steptwin.world.build import Fitted, Plan
from steptwin.world.course import profile_of
from steptwin.world.kernel import Kernel


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

    def value(self, now: Nanos) -> float:
        return self.read(now)

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from () if self.turning is None else self.turning(now)

    def version(self) -> object:
        return None if self.versions is None else self.versions()


def find_signal(plan: Plan, name: str) -> SignalOf:
    """The signal called ``name``. `Misuse` with what there is."""
    if name == "time":
        return SignalOf((), lambda now: now / SECOND, lambda now: (), lambda: name)
    if name == "idle":
        return SignalOf(tuple(plan.kernels), lambda now: float(_all_idle(plan, now)))
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
        raise Misuse(f"no signal {name!r}: nothing is called {owner!r}{hint}; there are {', '.join(known)}")
    kernel = plan.kernel_of[owner]
    pins = machine.pins()
    if rest.upper() in pins:
        pin = rest.upper()
        return SignalOf((kernel,), lambda now: float(machine.pins()[pin]))
    if isinstance(machine, Mic488):
        return _of_mic488(machine, kernel, rest, name)
    return _of_m1486(machine, kernel, rest, name)


def _all_idle(plan: Plan, now: Nanos) -> bool:
    """Whether all machines are idle, and nothing is on its way on a line."""
    machines = all(is_idle(machine, now) for machine in plan.machines.values())
    return machines and all(line.deadline() is None for line in plan.lines.values())


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
