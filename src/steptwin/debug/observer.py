"""Observer of a world that runs, for a debugger: statements, breakpoints, events, values that change."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.debug.breakpoints import Breakpoint, Breakpoints
from steptwin.errors import Misuse
from steptwin.simulation.kinds.programs import Programs, StatementLocation
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation
from steptwin.statements import StatementHook


class Begun(NamedTuple):
    """A statement that was executed, with the breakpoints at it.

    ``hit`` are those whose conditions hold, ``undecided`` those whose conditions are known only where the world stands before it.
    """

    time: Nanos
    controller: str
    location: StatementLocation
    depth: int
    hit: tuple[Breakpoint, ...]
    undecided: tuple[Breakpoint, ...]

    @property
    def stand(self) -> Nanos:
        """The last moment before it."""
        return self.time - 1


class Logged(NamedTuple):
    time: Nanos
    controller: str
    location: StatementLocation
    text: str


class ObservedEvent(NamedTuple):
    """An event of a controller."""

    time: Nanos
    controller: str
    code: str
    text: str


class Observer:
    """Observes the world ``world``, which has no other user.

    Of controllers in ``stepping`` every statement is noted; of others those at breakpoints. It notes only while ``is_on``.
    """

    def __init__(self, world: Simulation, points: Breakpoints) -> None:
        self.world = world
        self.points = points
        self.is_on = False
        self.stepping: Collection[str] = ()
        self.codes: Collection[str] = ()
        """Kinds of events that are noted."""
        self.begun: list[Begun] = []
        self.logged: list[Logged] = []
        self.happened: list[ObservedEvent] = []
        self._hooks = {controller: self._hook(controller, programs) for controller, programs in world.programs.items()}
        self._hooked: dict[str, frozenset[StatementLocation] | None] = {}
        """The locations before which hooks are called, by controller; None: all."""
        world.trace.subscribers.append(self._recorded)

    def clear(self) -> None:
        self.begun.clear()
        self.logged.clear()
        self.happened.clear()

    def observe(self, stepping: Collection[str]) -> None:
        """Have hooks at all statements of controllers in ``stepping``, of others at the breakpoints that are set now.

        Between those programs run at full speed.
        """
        self.stepping = stepping
        for controller, programs in self.world.programs.items():
            locations = None if controller in stepping else frozenset(self.points.at.get(controller, ()))
            if locations == self._hooked.get(controller, frozenset()):
                continue
            if controller in self._hooked:
                programs.remove_hook(self._hooks[controller])
                del self._hooked[controller]
            if locations != frozenset():
                programs.add_hook(self._hooks[controller], locations)
                self._hooked[controller] = locations
        scheduler_of = self.world.objects.scheduler_of
        self.world.synced_first = [scheduler_of[controller] for controller in self.points.reading_others()]

    def release(self) -> None:
        """Have no hooks: breakpoints or texts may be others by the next `observe`."""
        for controller in self._hooked:
            self.world.programs[controller].remove_hook(self._hooks[controller])
        self._hooked.clear()

    def _hook(self, controller: str, programs: Programs) -> StatementHook:
        def hook(now: Nanos, number: int) -> None:
            points = self.points.at.get(controller)
            if not self.is_on or (not points and controller not in self.stepping):
                return
            location = programs.location(number)
            if location is not None:
                at = points.get(location, ()) if points else ()
                if at or controller in self.stepping:
                    self._begins(now, controller, programs, location, at)

        return hook

    def _begins(
        self, now: Nanos, controller: str, programs: Programs, location: StatementLocation, points: Collection[Breakpoint]
    ) -> None:
        hit: list[Breakpoint] = []
        undecided: list[Breakpoint] = []
        for point in points:
            if not point.is_known(controller, now):
                undecided.append(point)
            elif (
                point.holds_at_statement(controller, now) and point.counts(now) and not self.log(now, controller, location, point)
            ):
                hit.append(point)
        if hit or undecided or controller in self.stepping:
            self.begun.append(Begun(now, controller, location, programs.depth(), tuple(hit), tuple(undecided)))

    def log(self, now: Nanos, controller: str, location: StatementLocation, point: Breakpoint) -> bool:
        """Log what a breakpoint that is hit has to log. False where it has nothing: then it stops."""
        if point.log is None:
            return False
        try:
            text = point.log.formatted(now)
        except Misuse as error:
            text = f"log: {error}"
        self.logged.append(Logged(now, controller, location, text))
        return True

    def _recorded(self, record: TraceRecord) -> None:
        if self.is_on and record.kind == "event" and record.subject in self.codes:
            self.happened.append(ObservedEvent(record.time, record.controller, record.subject, str(record.value)))
