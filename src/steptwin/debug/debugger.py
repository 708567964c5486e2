"""A debugger of the programs in a world, forwards and backwards in time.

It stands between two moments of the world. Before the world goes on, a second one, the look-ahead run, goes ahead and finds the
moment at which the run is to stop (`steptwin.debug.lookahead`); then the world is run to the end of the moment before it. So the
world itself is only run, as ever. The second world also shows the past: a snapshot and the inputs since bring it there
(`steptwin.simulation.world.snapshotlog`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias, TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.debug import scopes
from steptwin.debug.breakpoints import AnyPoint
from steptwin.debug.calculation import number_text
from steptwin.debug.lookahead import Goal, LookAheadRun, Parts
from steptwin.debug.observer import Logged
from steptwin.debug.values import Events, FormattedValue, Location, Scope, SetPoint, StackFrame, Stopped, StopReason
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.kinds.programs import Programs, ProgramState, StatementLocation
from steptwin.simulation.world.inputs import ExternalInput
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.simulation.world.snapshotlog import SnapshotLog, outside_past
from steptwin.simulation.world.unfinished import StandingProgram, StandingPrograms
from steptwin.subject.time import next_due
from steptwin.why.answer import Answer
from steptwin.why.pastquestions import PastQuestions

T = TypeVar("T")

LONGEST_SLICE_NS: Nanos = 10 * SECOND
STATEMENTS_AT_ONCE = 256
MOST_STATEMENTS_AT_ONCE = 1 << 14
MOST_OBSERVED_AT_ONCE = 1 << 12
"""A slice, which is executed without interruption, has so many statements of one program at first. It becomes twice as long where
nothing is found, up to the second number, or to the third while every statement is observed."""

DebugTravel: TypeAlias = Generator[None, None, Stopped]
"""A run in parts: after each of them something else can be done, or the run be ended by `close`."""


NO_KNOWN_PROGRAM = Message("debug.no-known-program", "{name}: no controller has a program whose text is known")
NO_STATEMENT_TIME = Message(
    "debug.no-statement-time", "{name}: statement_time = 0: a debugger stops between statements: give them '1 us' at least"
)
NOT_IN_THE_PAST = Message(
    "debug.not-in-the-past",
    "{name} cannot be set {ago:.9g} s before the present: branch, so that what came later has not happened",
)


class Debugger:
    """Debugs the programs of ``world``. Raises `Misuse` for a world without a program whose text is known, and for one with
    programs whose statements take no time.

    Methods that go forwards or backwards (``step_in``) give the `Stop`; those of the other form (``stepping_in``) do the same in
    parts (`Travel`). They need a world whose time only the debugger advances. A world in real time calls `look_ahead` before.

    ``snapshots``: the past of the world, where it is kept already. ``apply_input`` and ``go_back`` act on a world that others
    use, too.
    """

    def __init__(
        self,
        world: Simulation,
        snapshots: SnapshotLog | None = None,
        apply_input: Callable[[ExternalInput], None] | None = None,
        go_back: Callable[[SimulationSnapshot], None] | None = None,
    ) -> None:
        debugged = {name: programs for name, programs in world.programs.items() if programs.texts}
        if not debugged:
            raise Misuse(NO_KNOWN_PROGRAM(name=world.spec.name))
        for name, programs in debugged.items():
            if programs.statement_time == 0:
                raise Misuse(NO_STATEMENT_TIME(name=name))
        self._world = world
        self._statement = min(programs.statement_time for programs in debugged.values())
        self._apply_input = apply_input or world.apply_input
        self._go_back = go_back or self._take_back
        world.sync_all()
        for programs in world.programs.values():
            programs.execute_all(True, world.now)
        self._owns_snapshots = snapshots is None
        self._snapshots = SnapshotLog(world) if snapshots is None else snapshots
        self._snapshots.take()
        self._why = PastQuestions(self._snapshots)
        self._lookahead = LookAheadRun(self._snapshots)
        self._is_past = False

    def close(self) -> None:
        """Debug no more; the world goes on as ever."""
        if self._owns_snapshots:
            self._snapshots.close()
        self._world.sync_all()
        for programs in self._world.programs.values():
            programs.execute_all(False, self._world.now)

    @property
    def on_log(self) -> Callable[[Logged], None]:
        """Called with the text of log points, once for each time that they are passed."""
        return self._lookahead.on_log

    @on_log.setter
    def on_log(self, on_log: Callable[[Logged], None]) -> None:
        self._lookahead.on_log = on_log

    # ------------------------------------------------------------------ where it stands

    @property
    def view(self) -> Simulation:
        """The world as it is where the debugger stands; it may be read only."""
        return self._lookahead.world if self._is_past else self._world

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
        return self._snapshots.begin

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

    def texts(self, controller: str) -> Mapping[str, SourceText]:
        return self._programs(controller).texts

    def statement_lines(self, controller: str, text: str) -> Sequence[int]:
        """The lines in which breakpoints can be."""
        statements = self._programs(controller).statements(text)
        return [statement.line for statement in statements if statement.start < statement.end]

    def _programs(self, controller: str) -> Programs:
        return self.view.programs_of(controller)

    def stack(self, controller: str) -> Sequence[StackFrame]:
        """The statement that is executed, or comes next, then those to which it returns; empty where no program runs."""
        frames = self._programs(controller).stack(self.now)
        return [StackFrame(frame.name, self.location(controller, frame.location)) for frame in frames]

    def location(self, controller: str, location: StatementLocation) -> Location:
        programs = self._programs(controller)
        statement, source = programs.statements(location.text)[location.number], programs.texts[location.text]
        line, column = source.position(statement.start)
        end_line, end_column = source.position(statement.end)
        return Location(controller, location.text, source.name, line, column, end_line, end_column)

    # ------------------------------------------------------------------ values

    def why(self, question: str) -> Answer:
        """Why something is as it is where the debugger stands (`steptwin.why`). Raises `Misuse`."""
        return _finished(self._why.asking(question, self.now))

    def scope(self, controller: str, name: str) -> Scope:
        """A group of values, one of `steptwin.debug.scopes.SCOPES`. Raises `Misuse`."""
        return scopes.scope(self.view, controller, name)

    def evaluate(self, controller: str, text: str) -> FormattedValue:
        """An expression (`steptwin.debug.calculation`). Raises `Misuse`."""
        return scopes.evaluate(self.view, controller, text)

    def set_value(self, controller: str, name: str, text: str) -> FormattedValue:
        """Give a variable, an input or a register the value of an expression. Raises `Misuse`, in the past in any case."""
        if self._is_past:
            ago = (self.present - self.now) / SECOND
            raise Misuse(NOT_IN_THE_PAST(name=name, ago=ago))
        value = scopes.evaluate(self._world, controller, text).number or 0.0
        self._apply_input(scopes.setting(self._world, controller, name, value))
        self._lookahead.changed(self.now)
        return FormattedValue(name, number_text(value), value, is_settable=True)

    def branch(self) -> None:
        """Have the world go on from here: what came later has not happened."""
        if self._is_past:
            self._go_back(self._lookahead.world.snapshot(with_inputs=False))
            self.gone_back()

    def _take_back(self, snapshot: SimulationSnapshot) -> None:
        self._world.restore(snapshot)
        self._snapshots.gone_back()

    def gone_back(self) -> None:
        """The world has gone back to its present moment."""
        self._is_past = False
        self._lookahead.changed(self.now)

    # ------------------------------------------------------------------ breakpoints

    def set_breakpoints(self, points: Sequence[AnyPoint]) -> Sequence[SetPoint]:
        """Set these breakpoints and no others; what became of each."""
        self._lookahead.release()
        return self._lookahead.points.set(points, self.view if self._owns_snapshots else None)

    def set_events(self, events: Iterable[Events]) -> None:
        """Stop at these events and no others."""
        self._lookahead.stop_at([code for event in events for code in event.codes])

    # ------------------------------------------------------------------ what steps look for

    def into(self, controller: str) -> Goal:
        """The next statement of a controller."""
        self._programs(controller)
        return Goal((controller,))

    def over(self, controller: str) -> Goal:
        """The next statement that is not in a call or interrupt which begins here."""
        programs = self._programs(controller)
        stack = programs.stack(self.now)
        comes_back = not stack or programs.comes_back(stack[0].location)
        return Goal((controller,), programs.depth() if comes_back else None)

    def out(self, controller: str) -> Goal:
        """The statement after the call in which the program is."""
        return Goal((controller,), self._programs(controller).depth() - 1)

    # ------------------------------------------------------------------ forwards

    def run(self, until: Nanos | None = None) -> Stopped:
        """Go on to the next breakpoint or event, at most to a moment."""
        return _finished(self.running(until))

    def step_in(self, controller: str) -> Stopped:
        """To the next statement of a controller."""
        return _finished(self.stepping_in(controller))

    def step_over(self, controller: str) -> Stopped:
        """To the next statement that is not in a call or interrupt which begins here."""
        return _finished(self.stepping_over(controller))

    def step_out(self, controller: str) -> Stopped:
        """To the statement after the call in which the program is."""
        return _finished(self.stepping_out(controller))

    def run_to_entry(self) -> Stopped:
        """Before the first statement of any program."""
        return _finished(self.running_to_entry())

    def running(self, until: Nanos | None = None) -> DebugTravel:
        return self.forwards(Goal(), until)

    def stepping_in(self, controller: str) -> DebugTravel:
        return self.forwards(self.into(controller))

    def stepping_over(self, controller: str) -> DebugTravel:
        return self.forwards(self.over(controller))

    def stepping_out(self, controller: str) -> DebugTravel:
        return self.forwards(self.out(controller))

    def running_to_entry(self) -> DebugTravel:
        return self.forwards(Goal(self.threads, None, StopReason.ENTRY))

    def forwards(self, goal: Goal, until: Nanos | None = None) -> DebugTravel:
        """Go on to the goal, or to what else is a reason to stop, at most to a moment."""
        start = self.now
        if not self._is_past:
            self._snapshots.take()
        yield from self._lookahead.look_at(start)
        slices = self._slices(goal)
        while until is None or self._lookahead.now < until:
            begin = self._lookahead.now
            end = self._slice_end(begin, begin + next(slices), until)
            if end is None:
                yield from self._stand_at(begin)
                return Stopped(StopReason.IDLE, self.now, text=self._why_idle())
            stop = yield from self._lookahead.find(end, goal, start)
            if stop is not None:
                yield from self._stand_at(stop.time)
                return stop
            if end > self.present:
                self._bring_world(end)
            yield
        yield from self._stand_at(self._lookahead.now)
        return Stopped(StopReason.LIMIT, self.now)

    def _slices(self, goal: Goal) -> Iterator[Nanos]:
        """The lengths of slices, one after the other."""
        most = MOST_OBSERVED_AT_ONCE if goal.controllers else MOST_STATEMENTS_AT_ONCE
        count = STATEMENTS_AT_ONCE
        while True:
            yield min(LONGEST_SLICE_NS, count * self._statement)
            count = min(2 * count, most)

    def _slice_end(self, begin: Nanos, end: Nanos, until: Nanos | None) -> Nanos | None:
        """Up to where the look-ahead run goes next; None where nothing will happen any more."""
        if begin < self.present:
            end = min(end, self.present)
        elif (due := next_due(self._lookahead.world)) is not None:
            end = max(end, due)
        elif until is None:
            return None
        else:
            end = until
        return end if until is None else min(end, until)

    # ------------------------------------------------------------------ a world that goes on by itself

    def look_ahead(self, until: Nanos, goal: Goal, after: Nanos) -> Stopped | None:
        """The first reason to stop between the present and ``until``, after another moment; the world is brought to it, or to
        ``until``, before the next call."""
        lookahead = self._lookahead
        self._is_past = False
        if not lookahead.looks_for(goal):
            return None
        stop, slices = _finished(lookahead.catch_up(goal)), self._slices(goal)
        while stop is None and lookahead.now < until:
            stop = _finished(lookahead.find(min(lookahead.now + next(slices), until), goal, after))
        if stop is not None:
            lookahead.stopped()
        return stop

    def stand(self) -> None:
        """Look at the present, at which the world stands now."""
        self._is_past = False
        self._snapshots.take()
        _finished(self._lookahead.look_at(self.present))

    # ------------------------------------------------------------------ backwards

    def step_back(self, controller: str) -> Stopped:
        """To the statement before, or to the beginning of the one in progress."""
        return _finished(self.stepping_back(controller))

    def run_back(self) -> Stopped:
        """To the last breakpoint or event before this moment, or to the oldest moment that is kept."""
        return _finished(self.running_back())

    def go(self, moment: Nanos) -> Stopped:
        """To a moment between `begin` and `present`. Raises `Misuse` for another one."""
        return _finished(self.going(moment))

    def stepping_back(self, controller: str) -> DebugTravel:
        return self._backwards(self.into(controller))

    def running_back(self) -> DebugTravel:
        return self._backwards(Goal())

    def going(self, moment: Nanos) -> DebugTravel:
        if not self.begin <= moment <= self.present:
            raise Misuse(outside_past(moment, self.begin, self.present))
        return self._going(moment)

    def _going(self, moment: Nanos) -> DebugTravel:
        yield from self._stand_at(moment)
        return Stopped(StopReason.PAUSE, self.now)

    def _backwards(self, goal: Goal) -> DebugTravel:
        before = upper = self.now
        if not self._is_past:
            self._snapshots.take()
        slices = self._slices(goal)
        while upper > self.begin:
            lower = max(self._snapshots.state_at(upper - 1)[0].now, upper - next(slices))
            stop = yield from self._lookahead.find_back(lower, upper, goal, self.begin, before)
            if stop is not None:
                yield from self._stand_at(stop.time)
                return stop
            upper = lower
            yield
        yield from self._stand_at(self.begin)
        return Stopped(StopReason.BEGIN, self.now, text="no older moment is kept")

    # ------------------------------------------------------------------ the two worlds

    def pause(self) -> Stopped:
        """Stand where the run that was ended has come to."""
        _finished(self._going(max(self.begin, min(self._lookahead.now, self.present))))
        return Stopped(StopReason.PAUSE, self.now)

    def _stand_at(self, moment: Nanos) -> Parts:
        """Look at a moment that has been, or run the world to one that comes."""
        if moment < self.present:
            yield from self._lookahead.look_at(moment)
            self._is_past = True
            return
        self._is_past = False
        self._bring_world(moment)

    def _bring_world(self, moment: Nanos) -> None:
        while self._world.now < moment:
            self._world.run_to(moment)
        self._snapshots.take()

    def _why_idle(self) -> str:
        if self.has_ended:
            return "the program has ended"
        stand = " and ".join(map(_standing, StandingPrograms(self.view)))
        return f"nothing will happen any more: {stand}"


def _standing(one: StandingProgram) -> str:
    state = one.stand.state
    is_over = state is ProgramState.STOPPED
    text = "waits for ever" if state is ProgramState.RUNS else "runs no program" if is_over else f"is {state.value}"
    return f"{one.controller} {text} in line {one.line}" if one.line and not is_over else f"{one.controller} {text}"


def _finished(travel: Generator[None, None, T]) -> T:
    while True:
        try:
            next(travel)
        except StopIteration as end:
            return end.value
