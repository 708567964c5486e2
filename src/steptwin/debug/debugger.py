"""A debugger of the programs in a world, forwards and backwards in time.

It stands between two moments of the world. Before the world goes on, a second one, the scout, goes ahead and finds the moment at
which the run is to stop; then the world is run to the end of the moment before it. So the world itself is only run, as ever. The
scout is also what is looked at in the past, to which it is brought by a state and the inputs since (`steptwin.world.history`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

from steptwin.debug import scopes
from steptwin.debug.expression import number_text
from steptwin.debug.observer import Begun, Logged, Observer
from steptwin.debug.points import AnyPoint, Points, Watch
from steptwin.debug.values import Events, LabelPoint, Location, Scope, SetPoint, StackFrame, Stop, StopReason, Value
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.subject.time import next_due
from steptwin.world.history import History, Past
from steptwin.world.plant import Plant
from steptwin.world.programs import Place, Programs

LONGEST_SLICE_NS: Nanos = SECOND // 4
STATEMENTS_AT_ONCE = 256
"""A slice, which is executed without interruption, has at most so many statements of one program."""

Travel: TypeAlias = Generator[None, None, Stop]
"""A run in parts: after each of them something else can be done, or the run be ended by `close`."""


class _Goal(NamedTuple):
    """What a step looks for: a statement of one of these controllers, at most ``depth`` deep in calls where that is given."""

    machines: Collection[str] = ()
    depth: int | None = None

    def reached(self, begun: Begun) -> bool:
        return begun.machine in self.machines and (self.depth is None or begun.depth <= self.depth)


class Debugger:
    """Debugs the programs of ``world``, whose time nobody else advances meanwhile. Raises `Misuse` for a world without a program
    whose text is known, and for one with programs whose statements take no time.

    Methods that go forwards or backwards (``step_in``) give the `Stop`; those of the other form (``stepping_in``) do the same in
    parts (`Travel`).
    """

    def __init__(self, world: Plant) -> None:
        debugged = {name: programs for name, programs in world.programs.items() if programs.texts}
        if not debugged:
            raise Misuse(f"{world.spec.name}: no controller has a program whose text is known")
        for name, programs in debugged.items():
            if programs.statement_time == 0:
                raise Misuse(f"{name}: statement_time = 0: a debugger stops between statements, which must take 1 µs at least")
        self._world = world
        shortest = min(programs.statement_time for programs in debugged.values())
        self._slice = min(LONGEST_SLICE_NS, STATEMENTS_AT_ONCE * shortest)
        self._points = Points(world.programs)
        self.on_log: Callable[[Logged], None] = lambda logged: None
        """Called with the text of log points, once for each time that they are passed."""
        self._logged: Nanos = world.now
        """Up to this moment they have been."""
        world.settle_all()
        for programs in world.programs.values():
            programs.execute_all(True, world.now)
        self._history = History(world)
        self._past = Past(self._history)
        self._scout = self._past.world
        for programs in self._scout.programs.values():
            programs.execute_all(True, self._scout.now)
        self._observer = Observer(self._scout, self._points)
        self._is_past = False

    def close(self) -> None:
        """Debug no more; the world goes on as ever."""
        self._history.close()
        for programs in self._world.programs.values():
            programs.execute_all(False, self._world.now)

    # ------------------------------------------------------------------ where it stands

    @property
    def view(self) -> Plant:
        """The world as it is where the debugger stands; to look at only."""
        return self._scout if self._is_past else self._world

    @property
    def now(self) -> Nanos:
        return self.view.now

    @property
    def present(self) -> Nanos:
        """The latest moment that the world has come to."""
        return self._world.now

    @property
    def begin(self) -> Nanos:
        """The oldest moment that can be gone back to."""
        return self._history.begin

    @property
    def is_past(self) -> bool:
        return self._is_past

    @property
    def has_ended(self) -> bool:
        """Whether no program runs, and nothing will happen by itself."""
        return next_due(self.view) is None and not any(programs.stack(self.now) for programs in self.view.programs.values())

    @property
    def threads(self) -> Sequence[str]:
        """The controllers with programs."""
        return [name for name, programs in self._world.programs.items() if programs.texts]

    def texts(self, machine: str) -> Mapping[str, SourceText]:
        return self._programs(machine).texts

    def statement_lines(self, machine: str, text: str) -> Sequence[int]:
        """The lines in which breakpoints can be."""
        statements = self._programs(machine).statements(text)
        return [statement.line for statement in statements if statement.start < statement.end]

    def _programs(self, machine: str) -> Programs:
        return self.view.programs_of(machine)

    def stack(self, machine: str) -> Sequence[StackFrame]:
        """The statement that is executed, or comes next, then those to which it returns; empty where no program runs."""
        frames = self._programs(machine).stack(self.now)
        return [StackFrame(frame.name, self.location(machine, frame.place)) for frame in frames]

    def location(self, machine: str, place: Place) -> Location:
        programs = self._programs(machine)
        statement, source = programs.statements(place.text)[place.number], programs.texts[place.text]
        line, column = source.position(statement.start)
        end_line, end_column = source.position(statement.end)
        return Location(machine, place.text, source.name, line, column, end_line, end_column)

    # ------------------------------------------------------------------ values

    def scope(self, machine: str, name: str) -> Scope:
        """A group of values, one of `steptwin.debug.scopes.SCOPES`. Raises `Misuse`."""
        return scopes.scope(self.view, machine, name)

    def evaluate(self, machine: str, text: str) -> Value:
        """An expression (`steptwin.debug.expression`). Raises `Misuse`."""
        return scopes.evaluate(self.view, machine, text)

    def set_value(self, machine: str, name: str, text: str) -> Value:
        """Give a variable, an input or a register the value of an expression. Raises `Misuse`, in the past in any case."""
        if self._is_past:
            ago = (self.present - self.now) / SECOND
            raise Misuse(f"{name} cannot be set {ago:.9g} s before the present: branch, so that what came later has not happened")
        value = scopes.evaluate(self._world, machine, text).number or 0.0
        self._world.apply_input(scopes.setting(self._world, machine, name, value))
        self._changed()
        return Value(name, number_text(value), value, is_settable=True)

    def branch(self) -> None:
        """Have the world go on from here: what came later has not happened."""
        if self._is_past:
            self._world.restore(self._scout.snapshot(with_inputs=False))
            self._history.gone_back()
            self._is_past = False
            self._changed()

    def _changed(self) -> None:
        """What comes later will be different."""
        self._points.forget_after(self.now)
        self._logged = min(self._logged, self.now)
        self._past.forget()

    # ------------------------------------------------------------------ breakpoints

    def set_breakpoints(self, points: Sequence[AnyPoint]) -> Sequence[SetPoint]:
        """Set these breakpoints and no others; what became of each."""
        return self._points.set(points)

    def set_events(self, events: Iterable[Events]) -> None:
        """Stop at these events and no others."""
        self._observer.codes = frozenset(code for event in events for code in event.codes)

    # ------------------------------------------------------------------ forwards

    def run(self, until: Nanos | None = None) -> Stop:
        """Go on to the next breakpoint or event, at most to a moment."""
        return _finished(self.running(until))

    def step_in(self, machine: str) -> Stop:
        """To the next statement of a controller."""
        return _finished(self.stepping_in(machine))

    def step_over(self, machine: str) -> Stop:
        """To the next statement that is not in a call or interrupt which begins here."""
        return _finished(self.stepping_over(machine))

    def step_out(self, machine: str) -> Stop:
        """To the statement after the call in which the program is."""
        return _finished(self.stepping_out(machine))

    def run_to_entry(self) -> Stop:
        """Before the first statement of any program."""
        return _finished(self.running_to_entry())

    def running(self, until: Nanos | None = None) -> Travel:
        return self._forwards(_Goal(), StopReason.STEP, until)

    def stepping_in(self, machine: str) -> Travel:
        self._programs(machine)
        return self._forwards(_Goal((machine,)), StopReason.STEP)

    def stepping_over(self, machine: str) -> Travel:
        programs = self._programs(machine)
        stack = programs.stack(self.now)
        comes_back = not stack or programs.comes_back(stack[0].place)
        return self._forwards(_Goal((machine,), programs.depth() if comes_back else None), StopReason.STEP)

    def stepping_out(self, machine: str) -> Travel:
        return self._forwards(_Goal((machine,), self._programs(machine).depth() - 1), StopReason.STEP)

    def running_to_entry(self) -> Travel:
        return self._forwards(_Goal(self.threads), StopReason.ENTRY)

    def _forwards(self, goal: _Goal, reason: StopReason, until: Nanos | None = None) -> Travel:
        self._observer.stepping = goal.machines
        start = self.now
        if not self._is_past:
            self._history.take()
        yield from self._look_at(start)
        while until is None or self._scout.now < until:
            begin = self._scout.now
            end = self._slice_end(begin, until)
            if end is None:
                yield from self._stand_at(begin)
                return Stop(StopReason.IDLE, self.now, text=self._why_idle())
            self._observer.clear()
            found = yield from self._go_ahead(end)
            stop = yield from self._first_stop(goal, reason, start)
            if stop is None or (found is not None and found.time < stop.time):
                stop = found
            self._pass_logs(self._scout.now if stop is None else stop.time)
            if stop is not None:
                yield from self._stand_at(stop.time)
                return stop
            if end > self.present:
                self._bring_world(end)
            yield
        yield from self._stand_at(self._scout.now)
        return Stop(StopReason.LIMIT, self.now)

    def _slice_end(self, begin: Nanos, until: Nanos | None) -> Nanos | None:
        """Up to where the scout goes next; None where nothing will happen any more."""
        end = begin + self._slice
        if begin < self.present:
            end = min(end, self.present)
        elif (due := next_due(self._scout)) is not None:
            end = max(end, due)
        elif until is None:
            return None
        else:
            end = until
        return end if until is None else min(end, until)

    def _go_ahead(self, end: Nanos) -> Generator[None, None, Stop | None]:
        """Bring the scout to a moment, or to the first one at which a data breakpoint is hit or the world is stopped."""
        self._observer.is_on = True
        try:
            return (yield from self._observe(end))
        finally:
            self._observer.is_on = False

    def _observe(self, end: Nanos) -> Generator[None, None, Stop | None]:
        scout, watches = self._scout, self._points.watches
        before = [self._watched(watch) for watch in watches]
        while scout.now < end:
            moment = end
            if watches:
                due = next_due(scout)
                moment = end if due is None else min(max(due, scout.now + 1), end)
            if scout.now < self.present:
                yield from self._past.go_on(min(moment, self.present))
            else:
                stopped = scout.run_to(moment)
                self._past.forget()
                if stopped is not None and scout.now < moment:
                    return Stop(StopReason.WORLD, scout.now, text=stopped)
            after = [self._watched(watch) for watch in watches]
            for watch, old, new in zip(watches, before, after, strict=True):
                if watch.is_hit(old, new):
                    text = watch.expression.text if watch.has_condition else f"{watch.name}: {old:.9g} → {new:.9g}"
                    return Stop(StopReason.DATA, scout.now, watch.machine, text, (watch.number,))
            before = after
        return None

    def _watched(self, watch: Watch) -> float | None:
        return watch.value(lambda name: scopes.read(self._scout, watch.machine, name))

    def _first_stop(self, goal: _Goal, reason: StopReason, after: Nanos) -> Generator[None, None, Stop | None]:
        """The first of what was observed that is a reason to stop after a moment."""
        found = [stop for stop in self._stops(goal, reason) if stop.stop.time > after]
        for candidate in sorted(found, key=lambda candidate: candidate.stop.time):
            stop = yield from self._decided(candidate)
            if stop is not None:
                return stop
        return None

    def _stops(self, goal: _Goal, reason: StopReason) -> list[_Candidate]:
        """What was observed, each with the stop that it is a reason for."""
        found = [_Candidate(_stop_at(begun), begun) for begun in self._observer.begun if begun.hit or begun.undecided]
        found += [
            _Candidate(Stop(reason, begun.stand, begun.machine))
            for begun in self._observer.begun
            if goal.reached(begun) and not begun.hit
        ]
        events = self._observer.happened
        return [*found, *(_Candidate(Stop(StopReason.EXCEPTION, event.time, event.machine, event.text)) for event in events)]

    def _decided(self, candidate: _Candidate) -> Generator[None, None, Stop | None]:
        """The stop, unless all conditions turn out not to hold where the world stands before the statement."""
        begun = candidate.begun
        if begun is None or begun.hit:
            return candidate.stop
        was = self._scout.now
        yield from self._look_at(begun.stand)
        names = _names(self._scout, begun.machine)
        hit = tuple(point for point in begun.undecided if point.holds(names) and point.counts(begun.time))
        yield from self._look_at(was)
        return None if not hit else _stop_at(begun._replace(hit=hit))

    def _pass_logs(self, until: Nanos) -> None:
        """Log what was passed for the first time."""
        for logged in self._observer.logged:
            if self._logged < logged.time <= until:
                self.on_log(logged)
        self._logged = max(self._logged, until)

    # ------------------------------------------------------------------ backwards

    def step_back(self, machine: str) -> Stop:
        """To the statement before, or to the beginning of the one in progress."""
        return _finished(self.stepping_back(machine))

    def run_back(self) -> Stop:
        """To the last breakpoint or event before this moment, or to the oldest moment that is kept."""
        return _finished(self.running_back())

    def go(self, moment: Nanos) -> Stop:
        """To a moment between `begin` and `present`. Raises `Misuse` for another one."""
        return _finished(self.going(moment))

    def stepping_back(self, machine: str) -> Travel:
        self._programs(machine)
        return self._backwards(_Goal((machine,)), StopReason.STEP)

    def running_back(self) -> Travel:
        return self._backwards(_Goal(), StopReason.STEP)

    def going(self, moment: Nanos) -> Travel:
        if not self.begin <= moment <= self.present:
            raise Misuse(f"{moment} ns: the past is kept from {self.begin} to {self.present} ns")
        return self._going(moment)

    def _going(self, moment: Nanos) -> Travel:
        yield from self._stand_at(moment)
        return Stop(StopReason.PAUSE, self.now)

    def _backwards(self, goal: _Goal, reason: StopReason) -> Travel:
        self._observer.stepping = goal.machines
        before = upper = self.now
        if not self._is_past:
            self._history.take()
        while upper > self.begin:
            lower = max(self._history.state_at(upper - 1)[0].now, upper - self._slice)
            yield from self._look_at(lower)
            self._observer.clear()
            found: Stop | None = None
            while (hit := (yield from self._go_ahead(upper))) is not None and hit.time < before:
                found = hit
            stop = (yield from self._last_stop(goal, reason, before)) or found
            if stop is not None and found is not None and found.time > stop.time:
                stop = found
            if stop is not None:
                yield from self._stand_at(stop.time)
                return stop
            upper = lower
            yield
        yield from self._stand_at(self.begin)
        return Stop(StopReason.BEGIN, self.now, text="no older moment is kept")

    def _last_stop(self, goal: _Goal, reason: StopReason, before: Nanos) -> Generator[None, None, Stop | None]:
        found = [stop for stop in self._stops(goal, reason) if self.begin <= stop.stop.time < before]
        for candidate in sorted(found, key=lambda candidate: candidate.stop.time, reverse=True):
            stop = yield from self._decided(candidate)
            if stop is not None:
                return stop
        return None

    # ------------------------------------------------------------------ the two worlds

    def pause(self) -> Stop:
        """Stand where the run that was ended has come to."""
        _finished(self._going(max(self.begin, min(self._scout.now, self.present))))
        return Stop(StopReason.PAUSE, self.now)

    def _look_at(self, moment: Nanos) -> Generator[None, None, None]:
        """Bring the scout to a moment that has been, or ahead of the world."""
        if moment <= self.present:
            yield from self._past.go(moment)
            return
        yield from self._past.go(self.present)
        while self._scout.now < moment:
            self._scout.run_to(moment)
        self._past.forget()

    def _stand_at(self, moment: Nanos) -> Generator[None, None, None]:
        """Look at a moment that has been, or run the world to one that comes."""
        if moment < self.present:
            yield from self._look_at(moment)
            self._is_past = True
            return
        self._is_past = False
        self._bring_world(moment)

    def _bring_world(self, moment: Nanos) -> None:
        while self._world.now < moment:
            self._world.run_to(moment)
        self._history.take()

    def _why_idle(self) -> str:
        if self.has_ended:
            return "the program has ended"
        waiting = [f"{name} in line {stack[0].location.line}" for name in self.threads if (stack := self.stack(name))]
        return f"nothing will happen any more: {' and '.join(waiting)} waits for ever"


class _Candidate(NamedTuple):
    """A reason to stop; ``begun`` where conditions may be undecided."""

    stop: Stop
    begun: Begun | None = None


def _stop_at(begun: Begun) -> Stop:
    points = begun.hit or begun.undecided
    is_label = all(isinstance(point.asked, LabelPoint) for point in points)
    reason = StopReason.FUNCTION if is_label else StopReason.BREAKPOINT
    return Stop(reason, begun.stand, begun.machine, points=tuple(point.number for point in begun.hit))


def _names(world: Plant, machine: str) -> Callable[[str], float]:
    return lambda name: scopes.read(world, machine, name)


def _finished(travel: Travel) -> Stop:
    while True:
        try:
            next(travel)
        except StopIteration as end:
            return end.value
