"""The execution of a program: one statement every statement time (WBC-6), waits, the return stack, interrupts.

Useless evaluations are skipped (WBC-18). A WAIT with a false condition, and a loop that has run once without any change,
*rest*: the first moment at which one of their conditions can change is computed, and until then nothing is executed. Any event
meanwhile ends the rest (`disturb`). The place of the program at any moment follows from the rest, so resting changes nothing
but the computing time.

How a loop is found: at a jump backwards the state is *marked*, and every statement from there on is recorded. Back at the mark
with the same state, and without any effect on the controller on the way, the loop does the same again and again.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.state import Stateful
from steptwin.statements import HookedStatements, StatementHook, StatementHooks, hook_before, without
from steptwin.wbc.code import Cells, Code, Execution, InterruptEntry, StepCode
from steptwin.wbc.controller import ProgramController
from steptwin.wbc.resting import NEVER, RestingLoop, Visit

# WBC-6
STATEMENT_TIME: Nanos = MILLISECOND
SHORTEST_STATEMENT_TIME: Nanos = MICROSECOND
LONGEST_STATEMENT_TIME: Nanos = SECOND

# WBC-1
RETURNS = 16

# WBC-24
STATEMENTS_AT_ONCE = 1000
STATEMENTS_OF_AN_ACTION = 20
UNTIMED_INTERVAL: Nanos = MILLISECOND
"""With a statement time of 0, this number of statements takes no time (one that acts on the controller counts as several); then
this time passes. A wait is evaluated at this interval and after every event."""

LONGEST_LOOP = 512
"""Most statements of a loop that can rest."""
MARKS = 40
"""After this number of recordings without a loop, only one of `MOST_UNMARKED` jumps backwards is recorded. Filling the return
stack alone takes sixteen rounds."""
MOST_UNMARKED = 256


class Interpreter(Stateful):
    """One program in execution, or none. `Misuse` for a ``statement_time`` that is not permitted.

    All state is plain data: a snapshot in the middle of a program is complete but for the program itself.
    """

    FIXED = ("_hooked", "_hooks", "_repeated", "controller", "rests", "rests_in_loops", "statement_time")
    __slots__ = (
        *FIXED,
        "_mark",
        "_marks",
        "_moment",
        "_resting",
        "_spent",
        "_trail",
        "_unmarked",
        "acted",
        "began",
        "cells",
        "due",
        "forgotten",
        "handling",
        "has_effect",
        "not_before",
        "now",
        "paused_at",
        "pc",
        "pending",
        "running",
        "stack",
        "waiting",
    )

    def __init__(self, controller: ProgramController, statement_time: Nanos = STATEMENT_TIME) -> None:
        if statement_time and not SHORTEST_STATEMENT_TIME <= statement_time <= LONGEST_STATEMENT_TIME:
            permitted = f"0 and {SHORTEST_STATEMENT_TIME / MILLISECOND:g} to {LONGEST_STATEMENT_TIME / MILLISECOND:g} ms"
            raise Misuse(f"statement time = {statement_time / MILLISECOND:g} ms: permitted are {permitted}")
        self.controller = controller
        self.rests = True
        """If off, every condition is evaluated, for comparison in tests."""
        self.rests_in_loops = True
        """If off, every statement of a loop is executed; only WAIT rests."""
        self._hooks: StatementHooks = ()
        self._hooked: tuple[Code, Code] | None = None
        """Code, and the same with hooks."""
        self._repeated = -1
        """The step that is in progress already: it is evaluated again without a call of its hooks."""
        self.statement_time = statement_time
        self.cells = array("f")
        self.now: Nanos = 0
        """The moment of the statement being executed."""
        self.acted = False
        """A statement has acted on the controller since this was set to False."""
        self.has_effect = False
        """Something outside the cells has changed since the mark."""
        self._moment: Nanos = -1
        self._spent = 0
        """Statements executed at that moment, also before a restart by the program itself; counted if they take no time."""
        self.stack: deque[tuple[int, Nanos]]
        """Steps to which RETURN goes, each with its earliest moment (a DELAY that was interrupted, WBC-19)."""
        self.not_before: Nanos
        self._trail: list[Visit] | None
        self._mark: Nanos
        self._resting: RestingLoop | None
        self.paused_at: Nanos | None
        self.due: Nanos | None
        """The moment of the next statement; None if only an event leads to one."""
        self.stop()
        self.clear()

    def clear(self) -> None:
        """Reset the state to that before the first statement."""
        self.pc = 0
        self.stack = deque(maxlen=RETURNS)
        self.forgotten = False
        """A step for RETURN was dropped since the stack was last empty (WBC-1)."""
        self.handling = False
        """An interrupt is being handled; others wait (WBC-2)."""
        self.pending = 0
        """Events that wait, one bit each."""
        self.waiting = False
        """The statement at ``pc`` is in progress: its condition was false."""
        self.began: tuple[int, Nanos] | None = None
        """The step that waits, and since when; of an earlier one while none waits."""
        self.not_before = 0
        self._marks = 0
        self._unmarked = 0
        self._forget()

    def _forget(self) -> None:
        """End the recording and the rest of loops."""
        self._trail = None
        self._mark = 0
        self._resting = None

    # ------------------------------------------------------------------ start, stop, pause

    def start(self, code: Code, now: Nanos) -> None:
        """The first statement is executed one statement time from now. Variables are 0 (WBC-4)."""
        self.cells = code.cells[:]
        self.clear()
        self.running = True
        self.paused_at = None
        self.due = now + self.statement_time

    def restart(self, code: Code) -> None:
        """PROGRESET."""
        self.cells[:] = code.cells
        self.clear()

    def stop(self) -> None:
        self.running = False
        self.paused_at = None
        self.due = None
        self._forget()

    def pause(self, now: Nanos) -> None:
        """WBC-9: all waits are suspended."""
        self.disturb(self.after(now))
        self.running = False
        self.paused_at = now

    def resume(self, code: Code, begun: Nanos, now: Nanos) -> None:
        """Continue after the pause that has ``begun``; the end of every wait moves by its length."""
        self.paused_at = None
        later = now - begun
        if self.due is not None:
            self.due += later
        if self.not_before > begun:
            self.not_before += later
        frames = [(step, until + later if until > begun else until) for step, until in self.stack]
        self.stack = deque(frames, maxlen=RETURNS)
        self.running = True
        self._interrupt(code, now)

    # ------------------------------------------------------------------ what happens meanwhile

    def after(self, now: Nanos) -> Nanos:
        """Earliest moment of the next statement after the events at ``now``: with a statement time of 0, the same moment."""
        return now + 1 if self.statement_time else now

    def disturb(self, first: Nanos) -> None:
        """An event: conditions evaluated from ``first`` on may have other results."""
        self._trail = None
        if self._resting is not None:
            self._settle(self._resting, first)
        if self.waiting and self.statement_time == 0 and self.running:
            self.due = first

    def request_interrupt(self, code: Code, event: int, now: Nanos, first: Nanos) -> None:
        """Request the interrupt of ``event`` (its number in `EVENTS`), which is enabled; one of each can be pending (WBC-2).

        ``first`` is the moment of the next statement that could have been executed without it.
        """
        if event in code.entries:
            self.pending |= 1 << event
            if self.running:
                self.disturb(first)
                self._interrupt(code, now)

    def _interrupt(self, code: Code, now: Nanos) -> None:
        """INT_ interrupts the statement in progress (WBC-19)."""
        if not self.handling:
            event = next((e for e in self._pending_events() if not code.entries[e].hard), None)
            if event is not None:
                self._enter(code, event, now)

    def _pending_events(self) -> Iterator[int]:
        pending = self.pending
        return (event for event in range(pending.bit_length()) if pending >> event & 1)

    def deferred(self, entries: Mapping[int, InterruptEntry]) -> Sequence[int]:
        """The steps of the interrupts that have come and wait for the end of a statement or of another interrupt."""
        return [entries[e].step for e in self._pending_events() if self.handling or entries[e].hard]

    def _enter(self, code: Code, event: int, now: Nanos) -> None:
        self.pending &= ~(1 << event)
        self.push(self.pc, self.not_before)
        self.pc = code.entries[event].step
        self.handling = True
        self.waiting = False
        self.began = None
        self.not_before = 0
        self.due = now
        self._trail = None

    def push(self, step: int, not_before: Nanos) -> None:
        """Push a step for RETURN; of more than `RETURNS` steps the oldest is dropped (WBC-1)."""
        self.forgotten = bool(self.stack) and (self.forgotten or len(self.stack) == RETURNS)
        self.stack.append((step, not_before))

    # ------------------------------------------------------------------ execution

    def acting(self) -> ProgramController:
        """The controller, for the statement in execution, which acts on it."""
        self.acted = True
        return self.controller

    def run(self, code: Code, now: Nanos, until: Nanos) -> None:
        """Execute what is due at ``now``, and further statements up to ``until`` as long as they concern the program alone.

        A `ProgramFault` leaves ``pc`` at its statement.
        """
        if self._resting is not None:
            self._settle(self._resting, now)
        self.now = now
        if self.pending and self.waiting:
            until = now  # HARDINT comes when the wait has ended
        elif self.pending and not self.handling:
            at_end = now >= self.not_before
            event = next((e for e in self._pending_events() if at_end or not code.entries[e].hard), None)
            if event is not None:
                self._enter(code, event, now)
        if now < self.not_before:  # the interrupt that made a DELAY due earlier has been dropped meanwhile
            self.due = self.not_before
            return
        if self.statement_time == 0:
            if now != self._moment:
                self._moment, self._spent = now, 0
            self._execute_untimed(code)
            return
        while True:
            if self._trail is None:
                if not self._execute(code, until):
                    return
            elif not self._record(code, self._trail, until):
                return

    # ------------------------------------------------------------------ hooks

    def add_hook(self, hook: StatementHook, numbers: Collection[int] | None = None) -> None:
        """Call ``hook`` before each of these statements from now on; None: before all."""
        self._hooks = (*self._hooks, HookedStatements(hook, numbers))
        self._hooked = None

    def remove_hook(self, hook: StatementHook) -> None:
        self._hooks = without(self._hooks, hook)
        self._hooked = None

    def _with_hooks(self, code: Code) -> Code:
        """Code that is executed for it, with hooks."""
        if not self._hooks:
            return code
        self._repeated = self.pc if self.waiting else -1
        if self._hooked is None or self._hooked[0] is not code:
            steps = tuple(self._with_hook(number, step) for number, step in enumerate(code.steps))
            without_hook = [step is own for step, own in zip(steps, code.steps, strict=True)]
            straight = (
                found if found is not None and all(without_hook[first : first + found.further + 1]) else None
                for first, found in enumerate(code.straight)
            )
            self._hooked = code, replace(code, steps=steps, straight=tuple(straight))
        return self._hooked[1]

    def _with_hook(self, number: int, own: StepCode) -> StepCode:
        hook = hook_before(self._hooks, number)
        if hook is None:
            return own

        def step(execution: Execution, cells: Cells) -> int:
            if self._repeated == number:
                self._repeated = -1
            else:
                hook(execution.now, number)
            return own(execution, cells)

        return step

    # ------------------------------------------------------------------ the statements

    def _execute(self, code: Code, until: Nanos) -> bool:
        """Execute until an event has to be checked. True: continue, with recording."""
        executed, cells, pause = self._with_hooks(code), self.cells, self.statement_time
        steps, straight = executed.steps, executed.straight
        pc, now, unmarked = self.pc, self.now, self._unmarked
        marks = self.rests and self.rests_in_loops
        self.waiting = False
        self.not_before = 0
        try:
            while True:
                several = straight[pc]
                if several is None or now + several.further * pause > until:
                    following = steps[pc](self, cells)
                    if following < 0:
                        pc = self.pc = ~following
                        self._check_events(code)
                        due = self._due_undisturbed(until)
                        if due is None:
                            return False
                        now = self.now = due
                        self.not_before = 0
                        continue
                else:
                    following = several.run(self, cells)
                    pc += several.further
                    now += several.further * pause
                    self.now = now
                if following <= pc and marks:
                    if unmarked == 0:
                        unmarked = self._set_mark(now + pause)
                        pc = following
                        self.due = now + pause
                        if self.due > until:
                            return False
                        self.now = self.due
                        return True
                    unmarked -= 1
                pc = following
                now += pause
                if now > until:
                    self.due = now
                    return False
                self.now = now
        finally:
            self.pc = pc
            self._unmarked = unmarked

    def _execute_untimed(self, code: Code) -> None:
        """`_execute` without time: up to `STATEMENTS_AT_ONCE` statements at this moment, then `UNTIMED_INTERVAL` passes."""
        steps, cells = self._with_hooks(code).steps, self.cells
        pc, executed, acted = self.pc, self._spent, 0
        self.waiting = False
        self.not_before = 0
        try:
            for executed in range(self._spent + 1, STATEMENTS_AT_ONCE + 1):  # noqa: B007
                pc = steps[pc](self, cells)
                if pc < 0:
                    pc = self.pc = ~pc
                    self._check_events(code)
                    acted = STATEMENTS_OF_AN_ACTION - 1
                    return
            self.due = self.now + UNTIMED_INTERVAL
        finally:
            self.pc = pc
            self._spent = executed + acted

    def _check_events(self, code: Code) -> None:
        """Check for waits and interrupts after a statement that returned ``~number``."""
        if not self.running:
            self.due = None
            return
        if self.waiting:
            self._wait(code)
            return
        self.due = self.now + self.statement_time
        if self.not_before > self.due and not self._can_interrupt(code):
            self.due = self.not_before

    def _due_undisturbed(self, until: Nanos) -> Nanos | None:
        """When the next statement is due, mostly after a DELAY; None if something else may happen before, or a hook looks."""
        if self.acted or self.waiting or self.pending or self._hooks or self.due is None or self.due > until:
            return None
        return self.due

    def _can_interrupt(self, code: Code) -> bool:
        return not self.handling and any(not code.entries[e].hard for e in self._pending_events())

    # ------------------------------------------------------------------ rest

    def _wait(self, code: Code) -> None:
        """A condition is false: rest until it can be true."""
        self._trail = None
        self._marks = self._unmarked = 0
        period = self.statement_time or UNTIMED_INTERVAL
        self.due = self.now + period
        if self.rests:
            self._rest(code, RestingLoop((self._visit(0),), self.now, period))

    def _visit(self, offset: Nanos) -> Visit:
        return Visit(self.pc, offset, self.not_before > 0, self.handling, tuple(self.stack), self.cells.tobytes())

    def _set_mark(self, now: Nanos) -> int:
        """Begin to record at ``now``. Returns the number of jumps backwards that are not marked after it."""
        self._trail = []
        self._mark = now
        self.has_effect = False
        return 0 if self._marks < MARKS else MOST_UNMARKED

    def _record(self, code: Code, trail: list[Visit], until: Nanos) -> bool:
        """As `_execute`, noting every visit, until the loop is closed or turns out to be none. True: go on, not recording."""
        steps, cells, pause = self._with_hooks(code).steps, self.cells, self.statement_time
        while len(trail) < LONGEST_LOOP:
            now = self.now
            visit = self._visit(now - self._mark)
            if trail and visit.step <= trail[-1].step:
                again = next((i for i, earlier in enumerate(trail) if earlier.step == visit.step), None)
                if again is not None:
                    if not self.has_effect and self._close(code, trail[again:], visit):
                        return False
                    break
            trail.append(visit)
            self.waiting = False
            self.not_before = 0
            following = steps[self.pc](self, cells)
            if following < 0:
                self.pc = ~following
                self._check_events(code)
                return False
            self.pc = following
            self.due = now + pause
            if self.due > until:
                return False
            self.now = self.due
        self._trail = None
        self._marks += 1
        return True

    def _close(self, code: Code, loop: list[Visit], again: Visit) -> bool:
        """Rest in a loop that has come round to ``again``; False if its state is another, or if it cannot be foreseen."""
        begin = loop[0].offset
        if again._replace(offset=begin) != loop[0]:
            return False
        visits = tuple(visit._replace(offset=visit.offset - begin) for visit in loop)
        if not self._rest(code, RestingLoop(visits, self._mark + begin, again.offset - begin)):
            return False
        self._trail = None
        self._marks = 0
        return True

    def _rest(self, code: Code, loop: RestingLoop) -> bool:
        """Execute nothing before a condition of ``loop`` can have another result; False if that moment is not known."""
        change = loop.next_change(code, self.controller)
        if change is None:
            return False
        self._resting = loop
        self.due = None if change == NEVER else change
        return True

    def _settle(self, loop: RestingLoop, first: Nanos) -> None:
        """End the rest: stand before the first statement of the loop at or after ``first``."""
        self.due, visit = loop.next_visit(first)
        self.pc = visit.step
        self.handling = visit.handling
        self.stack = deque(visit.stack, maxlen=RETURNS)
        self.cells = visit.values()
        self.not_before = self.due if visit.held else 0
        self._resting = None

    def cells_at(self, now: Nanos) -> Sequence[float]:
        """Variables, then constants, as the statement in execution at ``now`` finds them."""
        return self.cells if self._resting is None else self._resting.next_visit(self.after(now))[1].values()

    @property
    def resting_loop(self) -> RestingLoop | None:
        """The loop in which nothing can change, and whose passes are therefore not executed one by one."""
        return None if self.waiting else self._resting

    def waits(self, now: Nanos) -> bool:
        """Whether the step in execution waits, for a condition or for the end of a DELAY."""
        return self.running and self.resting_loop is None and (self.waiting or self.not_before > now)

    def waits_since(self, now: Nanos) -> Nanos | None:
        """Since when the step in execution waits; None if that is not known, as of a DELAY that an interrupt was in."""
        if self.began is None or not self.waits(now):
            return None
        step, since = self.began
        return since if step == self.place(now) else None

    def place(self, now: Nanos) -> int:
        """The step in execution at ``now`` (a DELAY until it ends), or executed next."""
        if self._resting is not None:
            _, visit = self._resting.next_visit(self.after(now))
            return visit.step - 1 if visit.held else visit.step
        if self.paused_at is not None:
            now = self.paused_at
        return self.pc - 1 if self.not_before > self.after(now) else self.pc
