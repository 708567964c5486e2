"""A signal: a named quantity that conditions use, and that scripts and external programs read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.mechanics.integral import Straight
from steptwin.simulation.scheduler.scheduler import Source

IT_CAN_ONLY_BE_WRITTEN = Message("simulation.it-can-only-be-written", "it can only be written")
CAN_ONLY_BE_WRITTEN = Message("simulation.can-only-be-written", "{name} can only be written")


class SignalsOf(dict[str, "SignalOf"]):
    """The signals of an element by name."""

    __slots__ = ("absent",)

    def __init__(self, there: Mapping[str, SignalOf], absent: Mapping[str, str]) -> None:
        """``absent``: why it lacks signals that others of its kind have."""
        super().__init__(there)
        self.absent = absent


@dataclass(frozen=True, slots=True)
class SignalOf:
    """A signal, and the controllers, lines and elements that compute it: their schedulers must be advanced before it is read."""

    sources: tuple[Source, ...]
    read: Callable[[Nanos], float] | None
    """None if it is write-only."""
    turning: Callable[[Nanos], Iterable[Nanos]] | None = None
    versions: Callable[[], object] | None = None
    unit: str = ""
    bounds: tuple[float, float] | None = None
    """The lowest and highest value, where that is known."""
    is_kept: bool = False
    """Whether a request may change it without an event of its scheduler."""
    freeze: Callable[[Nanos], Callable[[Nanos], float]] | None = None
    """Gives the trajectory at a moment as a function that does not change when another trajectory follows; None: it cannot."""
    straight: Callable[[Nanos], Straight] | None = None
    """The straight line on which a value that changes between events is from a moment on; None: it has none, or not always."""
    check: Callable[[], None] = lambda: None
    """Raises `Misuse` if conditions cannot use it, because it changes between events at unknown moments."""

    @property
    def is_readable(self) -> bool:
        return self.read is not None

    @property
    def continuous(self) -> bool:
        return self.turning is not None

    def sync(self, now: Nanos) -> tuple[Source, ...]:
        """Advance what the value depends on to ``now`` and return it. Until one of these changes, the value is constant or
        follows its trajectory."""
        for source in self.sources:
            source.scheduler.advance(now)
        return self.sources

    def value(self, now: Nanos) -> float:
        """The value, after `sync`. Raises `Misuse` for a write-only signal."""
        if self.read is None:
            raise Misuse(IT_CAN_ONLY_BE_WRITTEN())
        return self.read(now)

    def watch(self, name: str) -> None:
        """Prepare for use in a condition. Raises `Misuse` if that is impossible."""
        if self.read is None:
            raise Misuse(CAN_ONLY_BE_WRITTEN(name=name))
        self.check()
        if self.is_kept:
            for source in self.sources:
                source.scheduler.is_step_exact = True

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return iter(() if self.turning is None else self.turning(now))

    def version(self) -> object:
        return None if self.versions is None else self.versions()
