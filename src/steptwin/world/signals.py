"""Signals: what conditions may speak of, and scripts and programs outside may read, by name. Points of controllers are those of
their data sheets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from steptwin.errors import Misuse
from steptwin.machine import SECOND, MotionController, Nanos
from steptwin.nearmiss import NearMiss
from steptwin.world.kernel import Kernel
from steptwin.world.names import Unknown

if TYPE_CHECKING:
    from steptwin.world.kind import AnyKind
    from steptwin.world.lines import Line
    from steptwin.world.parts import WorldParts

T = TypeVar("T")

MOST_NAMED = 8
"""Points in a message."""


@dataclass(frozen=True, slots=True)
class SignalOf:
    """A signal, and the kernels that have to be at the moment asked for."""

    kernels: tuple[Kernel, ...]
    read: Callable[[Nanos], float] | None
    """None where it can only be written."""
    turning: Callable[[Nanos], Iterable[Nanos]] | None = None
    versions: Callable[[], object] | None = None
    unit: str = ""
    is_kept: bool = False
    """Whether it may change by a request that is not an event of its kernel."""
    check: Callable[[], None] = lambda: None
    """Raises `Misuse` where no condition can be on it: it changes between events at moments that are not known."""

    @property
    def is_readable(self) -> bool:
        return self.read is not None

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
        """After `bring`. Raises `Misuse` for what can only be written."""
        if self.read is None:
            raise Misuse("it can only be written")
        return self.read(now)

    def watch(self, name: str) -> None:
        """A condition is on it from now on. Raises `Misuse` where it cannot be."""
        if self.read is None:
            raise Misuse(f"{name} can only be written")
        self.check()
        if self.is_kept:
            for kernel in self.kernels:
                kernel.is_attentive = True

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from () if self.turning is None else self.turning(now)

    def version(self) -> object:
        return None if self.versions is None else self.versions()


class Idle:
    """Whether all machines are idle, and nothing is on its way on a line. While one of them is busy the others do not matter."""

    continuous = False
    is_readable = True
    unit = ""

    def __init__(self, plan: WorldParts) -> None:
        self._kernels = tuple(plan.kernels)
        self._things: list[tuple[Kernel, Callable[[Nanos], bool]]] = [
            *((plan.kernel_of[name], partial(plan.kind_of[name].is_idle, machine)) for name, machine in plan.machines.items()),
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

    def watch(self, name: str) -> None:
        """A condition may be on it."""

    def value(self, now: Nanos) -> float:
        """After `bring`."""
        return float(self._busy is None)

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from ()

    def version(self) -> object:
        return None


def find_signal(plan: WorldParts, name: str) -> SignalOf | Idle:
    """The signal called ``name``. `Misuse` with what there is."""
    if name == "time":
        return SignalOf((), lambda now: now / SECOND, lambda now: (), lambda: name, unit="s")
    if name == "idle":
        return Idle(plan)
    owner, _, rest = name.partition(".")
    of_element = plan.element_signals(owner)
    if of_element is not None:
        return _chosen(of_element, rest, name)
    machine = plan.machines.get(owner)
    if machine is None:
        known = [*plan.machines, *plan.element_names, "time", "idle"]
        hint = NearMiss().hint(owner, known)
        raise Unknown(owner, f"no signal {name!r}: nothing is called {owner!r}{hint}; there are {', '.join(known)}")
    return _of_machine(plan.kind_of[owner], machine, plan.kernel_of[owner], rest, name)


def _of_machine(kind: AnyKind, machine: MotionController, kernel: Kernel, rest: str, name: str) -> SignalOf:
    """A pin, or else a point of the data sheet."""
    pin = rest.upper()
    if pin in machine.pins():
        found = next(found for found in kind.datasheet(machine).pins if found.name == pin)
        return SignalOf(
            (kernel,), lambda now: machine.pins()[pin], unit=found.unit, check=partial(kind.refuse_taken, machine, pin)
        )
    point = kind.point(machine, rest)
    if point is None:
        raise _unknown([point.path for point in kind.datasheet(machine).points], rest, name, ", and pins")
    return SignalOf((kernel,), point.read, point.turns, point.version, point.point.unit, is_kept=point.is_kept)


def _is_quiet(line: Line, now: Nanos) -> bool:
    """Whether nothing is on its way on a line."""
    return line.deadline() is None


def _chosen(known: Mapping[str, T], rest: str, name: str) -> T:
    found = known.get(rest.lower())
    if found is None:
        raise _unknown(list(known), rest, name)
    return found


def _unknown(known: Sequence[str], rest: str, name: str, others: str = "") -> Misuse:
    """Names of the same axis, where it is of one."""
    axis, dot, _ = rest.rpartition(".")
    of_axis = [path for path in known if dot and path.upper().startswith(f"{axis.upper()}.")]
    shown = of_axis or known[:MOST_NAMED]
    more = "" if of_axis or len(shown) == len(known) else f" and more, {len(known)} in all"
    return Misuse(
        f"no signal {name!r}{NearMiss().hint(rest, known)}; there are {', '.join(shown)}{more}{'' if of_axis else others}"
    )
