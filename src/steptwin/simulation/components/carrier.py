"""Common part of suction cups and grippers: they take workpieces in space, or from a belt where a terminal says that they are."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Protocol

from steptwin.controller import Nanos
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import Joint, TerminalComponent, TerminalComponentSpec
from steptwin.simulation.components.mount import MountSpec
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduledparts import Depends
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, NameOf, Terminal, number

PICK, PLACE, HELD = "PICK", "PLACE", "HELD"


@table()
class CarrierSpec(TerminalComponentSpec, MountSpec):
    """With a place in space it takes what it meets there; otherwise PICK and PLACE say where it is."""

    pick: Terminal | None = key(OUTPUT_PIN, "output connected to PICK: it is where it picks up", default=None, in_space=False)
    place: Terminal | None = key(OUTPUT_PIN, "output connected to PLACE: it is where it puts down", default=None, in_space=False)
    source: str | None = key(
        NameOf("conveyor"),
        "conveyor that it picks from; without one a workpiece is there whenever PICK is on",
        default=None,
        name="from",
        in_space=False,
    )
    pick_at: float = key(number(0.0), "with from: mm from the beginning of the belt", default=0.0, needs="from")
    onto: str | None = key(NameOf("conveyor"), "with from: conveyor that it puts on", default=None, needs="from", in_space=False)
    place_at: float = key(
        number(0.0), "with onto: mm from the beginning of the belt, of the front of the workpiece", default=0.0, needs="onto"
    )

    @property
    @abstractmethod
    def own_joint(self) -> Joint | None:
        """Joint of its own key, besides the places."""

    @property
    def joints(self) -> Iterable[Joint]:
        own = self.own_joint
        if own is not None:
            yield own
        if self.is_mounted:
            return
        for name, terminal, source in (("pick", PICK, self.pick), ("place", PLACE, self.place)):
            if source is not None:
                yield Joint(name, terminal, source)

    @property
    def places(self) -> tuple[str, ...]:
        """Terminals that say where it is."""
        return () if self.is_mounted else (PICK, PLACE)

    @property
    def holds_workpieces(self) -> bool:
        return True

    def others(self, described: ElementSpecs) -> Iterable[tuple[str, str]]:
        if self.is_mounted:
            yield from (("at", name) for name in described.holders if name != self.name)
        if self.source is not None:
            yield "from", self.source
        if self.onto is not None:
            yield "onto", self.onto


class Grip(Protocol):
    """How something takes workpieces, and puts them down."""

    dropped: int
    """How many have fallen."""

    @property
    def workpiece(self) -> Workpiece | None:
        """The one that it holds."""
        ...

    @property
    def mass(self) -> float:
        """kg of that and of all that lies on it."""
        ...

    @property
    def depends_on(self) -> Depends:
        """As `TerminalComponent.depends_on`."""
        ...

    def is_met(self, now: Nanos) -> bool:
        """Whether there is one to take."""
        ...

    def hold(self, now: Nanos) -> None:
        """Take the one that is there."""
        ...

    def release(self, now: Nanos) -> None:
        """Let go of the one that it holds."""
        ...

    def change(self, now: Nanos) -> Nanos | None:
        """When there may be another one to take without an event."""
        ...


class Carrier(TerminalComponent):
    """It carries a workpiece while it holds it."""

    __slots__ = ("grip",)

    def __init__(self, block: TerminalBlock, grip: Grip) -> None:
        super().__init__(block)
        self.grip = grip

    @property
    def depends_on(self) -> Depends:
        return self.grip.depends_on

    def is_occupied(self, now: Nanos) -> bool:
        """Whether it carries a workpiece, or one is where it would pick it up."""
        return self.grip.workpiece is not None or self.grip.is_met(now)

    def take(self, now: Nanos) -> None:
        """It holds what is there from now on."""
        if self.grip.workpiece is None:
            self.grip.hold(now)

    def let_go(self, now: Nanos) -> None:
        """It does not hold anything from now on."""
        self.grip.release(now)

    def passing(self, now: Nanos) -> Nanos | None:
        """When a workpiece comes to where it picks up, or leaves that place."""
        return None if self.grip.workpiece is not None else self.grip.change(now)


def carrier_signals(carrier: Carrier) -> Mapping[str, SignalOf]:
    source, grip = (carrier.block.source,), carrier.grip
    return {
        "dropped": SignalOf(source, lambda now: float(grip.dropped)),
        "mass": SignalOf(source, lambda now: grip.mass, unit="kg"),
    }
