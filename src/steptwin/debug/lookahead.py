"""The look-ahead run of a debugger: a second world with the state of the first, which goes ahead of it or back, and is observed.

The first one is only run, as ever, to where the look-ahead run has found a reason to stop.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.debug.breakpoints import Breakpoints
from steptwin.debug.calculation import ResolvedExpression
from steptwin.debug.observer import Begun, Logged, Observer
from steptwin.debug.values import LabelPoint, Stopped, StopReason
from steptwin.simulation.world.snapshotlog import PastWorld, SnapshotLog
from steptwin.subject.time import next_due

Parts: TypeAlias = Generator[None, None, None]
"""Parts of a run that can be interrupted."""
Finding: TypeAlias = Generator[None, None, "Stopped | None"]


class Goal(NamedTuple):
    """Target of a step: a statement of one of these controllers, at most ``depth`` deep in calls where that is given."""

    controllers: Collection[str] = ()
    depth: int | None = None
    reason: StopReason = StopReason.STEP

    def reached(self, begun: Begun) -> bool:
        return begun.controller in self.controllers and (self.depth is None or begun.depth <= self.depth)


class Candidate(NamedTuple):
    """A reason to stop; ``begun`` where conditions may be undecided."""

    stop: Stopped
    begun: Begun | None = None


class LookAheadRun:
    """Look-ahead run of the world of ``snapshots``."""

    def __init__(self, snapshots: SnapshotLog) -> None:
        self._snapshots = snapshots
        self._past = PastWorld(snapshots)
        self.world = self._past.world
        self.points = Breakpoints(snapshots.world.programs, partial(ResolvedExpression, self.world))
        for programs in self.world.programs.values():
            programs.execute_all(True, self.world.now)
        self._observer = Observer(self.world, self.points)
        self._watched: list[float | None] | None = None
        """The values of data breakpoints at the moment up to which was observed; None where it was moved since."""
        self.on_log: Callable[[Logged], None] = lambda logged: None
        """Called with the text of log points, once for each time that they are passed."""
        self._logged: Nanos = snapshots.world.now
        """Up to this moment they have been."""

    @property
    def now(self) -> Nanos:
        return self.world.now

    @property
    def present(self) -> Nanos:
        return self._snapshots.world.now

    def stop_at(self, codes: Collection[str]) -> None:
        """At events with these codes and no others."""
        self._observer.codes = frozenset(codes)

    def release(self) -> None:
        """Breakpoints may be others from now on."""
        self._observer.release()

    def looks_for(self, goal: Goal) -> bool:
        """Whether there is anything at which it would stop."""
        return bool(goal.controllers or self.points.at or self.points.watches or self._observer.codes)

    def stopped(self) -> None:
        """The world stops before it: there is no use any more for where it has gone ahead."""
        self._past.forget()

    def changed(self, moment: Nanos) -> None:
        """Forget what comes after a moment: it will be different from what it was."""
        self.points.forget_after(moment)
        self._logged = min(self._logged, moment)
        self._past.forget()

    def look_at(self, moment: Nanos) -> Parts:
        """Bring it to a moment that has been, or ahead of the world; what happens meanwhile is not observed."""
        self._watched = None
        self._observer.release()
        if moment <= self.present:
            yield from self._past.go(moment)
            return
        yield from self._past.go(self.present)
        while self.now < moment:
            self.world.run_to(moment)
        self._past.forget()

    # ------------------------------------------------------------------ observing

    def find(self, end: Nanos, goal: Goal, after: Nanos) -> Finding:
        """Go on to a moment; the first reason to stop after another one. Where there is none, it is at ``end`` then."""
        self._observer.observe(goal.controllers)
        self._observer.clear()
        found = yield from self._go_ahead(end)
        stop = yield from self._first_stop([one for one in self._candidates(goal) if one.stop.time > after])
        if stop is None or (found is not None and found.time < stop.time):
            stop = found
        self._pass_logs(self.now if stop is None else stop.time)
        return stop

    def find_back(self, lower: Nanos, upper: Nanos, goal: Goal, begin: Nanos, before: Nanos) -> Finding:
        """The last reason to stop between two moments, from ``begin`` on and before another moment."""
        yield from self.look_at(lower)
        self._observer.observe(goal.controllers)
        self._observer.clear()
        found: Stopped | None = None
        while (hit := (yield from self._go_ahead(upper))) is not None and hit.time < before:
            found = hit
        there = [one for one in self._candidates(goal) if begin <= one.stop.time < before]
        stop = (yield from self._last_stop(there)) or found
        return found if stop is not None and found is not None and found.time > stop.time else stop

    def catch_up(self, goal: Goal) -> Finding:
        """Be at the present. What has come from outside since it was there, and what that has led to at once, is observed: it has
        happened, so a stop is at the present, too."""
        present = self.present
        if not self._past.is_in_step or not self._past.can_go_on:
            if not len(self._snapshots):  # more came in than is kept
                self._snapshots.take()
            yield from self.look_at(present)
        if not self._past.lacks_inputs:
            return None
        self._observer.observe(goal.controllers)
        self._observer.clear()
        found = yield from self._go_ahead(present)
        for logged in self._observer.logged:
            self.on_log(logged)
        stop = (yield from self._first_stop(self._candidates(goal))) or found
        self._observer.release()
        return None if stop is None else replace(stop, time=present)

    def _go_ahead(self, end: Nanos) -> Finding:
        """Go on to a moment, or to the first one at which a data breakpoint is hit or the world is stopped."""
        self._observer.is_on = True
        try:
            return (yield from self._observe(end))
        finally:
            self._observer.is_on = False

    def _observe(self, end: Nanos) -> Finding:
        watches = self.points.watches
        before = self._watched
        if before is None or len(before) != len(watches):
            before = [watch.value(self.now) for watch in watches]
        if self.now == self.present and self._past.lacks_inputs:
            yield from self._past.go_on(self.present)
            if (hit := self._hit(before)) is not None:
                return hit
        while self.now < end:
            moment = self._next_look(end) if watches else end
            if self.now < self.present:
                yield from self._past.go_on(min(moment, self.present))
            elif (stopped := self.world.run_to(moment)) is not None and self.now < moment:
                return Stopped(StopReason.WORLD, self.now, text=stopped)
            if (hit := self._hit(before)) is not None:
                return hit
            before = self._watched or []
        return None

    def _next_look(self, end: Nanos) -> Nanos:
        """The next moment at which a value can have changed."""
        due = next_due(self.world)
        return end if due is None else min(max(due, self.now + 1), end)

    def _hit(self, before: list[float | None]) -> Stopped | None:
        """The first data breakpoint that is hit now, by values that were others before."""
        watches = self.points.watches
        self._watched = after = [watch.value(self.now) for watch in watches]
        for watch, old, new in zip(watches, before, after, strict=True):
            if watch.is_hit(old, new):
                text = watch.text if watch.has_condition else f"{watch.name}: {old:.9g} → {new:.9g}"
                return Stopped(StopReason.DATA, self.now, watch.controller, text, (watch.number,))
        return None

    # ------------------------------------------------------------------ reasons to stop

    def _candidates(self, goal: Goal) -> list[Candidate]:
        """Observations, each with the stop that it is a reason for, in the order of time."""
        found = [Candidate(_stop_at(begun), begun) for begun in self._observer.begun if begun.hit or begun.undecided]
        found += [
            Candidate(Stopped(goal.reason, begun.stand, begun.controller))
            for begun in self._observer.begun
            if goal.reached(begun) and not begun.hit
        ]
        events = self._observer.happened
        found += [Candidate(Stopped(StopReason.EXCEPTION, event.time, event.controller, event.text)) for event in events]
        return sorted(found, key=lambda candidate: candidate.stop.time)

    def _first_stop(self, candidates: list[Candidate]) -> Finding:
        for candidate in candidates:
            stop = yield from self._decided(candidate)
            if stop is not None:
                return stop
        return None

    def _last_stop(self, candidates: list[Candidate]) -> Finding:
        latest = sorted(candidates, key=lambda candidate: candidate.stop.time, reverse=True)
        return (yield from self._first_stop(latest))

    def _decided(self, candidate: Candidate) -> Finding:
        """The stop, unless all conditions turn out not to hold where the world stands before the statement."""
        begun = candidate.begun
        if begun is None or begun.hit:
            return candidate.stop
        was, watched = self.now, self._watched
        yield from self.look_at(begun.stand)
        held = [point for point in begun.undecided if point.holds(begun.controller, begun.stand) and point.counts(begun.time)]
        hit = tuple(point for point in held if not self._observer.log(begun.time, begun.controller, begun.location, point))
        yield from self.look_at(was)
        self._watched = watched
        return None if not hit else _stop_at(begun._replace(hit=hit))

    def _pass_logs(self, until: Nanos) -> None:
        """Log what was passed for the first time."""
        for logged in sorted(self._observer.logged, key=attrgetter("time")):
            if self._logged < logged.time <= until:
                self.on_log(logged)
        self._logged = max(self._logged, until)


def _stop_at(begun: Begun) -> Stopped:
    points = begun.hit or begun.undecided
    is_label = all(isinstance(point.asked, LabelPoint) for point in points)
    reason = StopReason.FUNCTION if is_label else StopReason.BREAKPOINT
    return Stopped(reason, begun.stand, begun.controller, points=tuple(point.number for point in begun.hit))
