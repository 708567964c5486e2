"""Execution of the commands in the memory, each with its duration (M-19).

Each command is compiled, when it is first met, into a closure that does it and returns the place of the next one. Those that
only compute run in a bare loop; a closure that is not there yet or does more raises `_Look`, and the command is done with the
chip's clock set to its moment. Commands with a hook take the general way, too.
"""

from __future__ import annotations

import enum
from collections.abc import Collection
from typing import ClassVar, NamedTuple, NoReturn, Protocol

from steptwin.controller import MILLISECOND, Nanos
from steptwin.m1486.effects import CommandHost, Effect, WrongData
from steptwin.m1486.encoding import LONGEST, decode
from steptwin.m1486.execute import compile_command
from steptwin.messages import Message, text_of
from steptwin.state import Plain, Stateful
from steptwin.statements import HookedStatements, StatementHook, StatementHooks, hook_before, without

BURST = 1000
"""If commands take no time, this number of them is executed at one moment; then this time passes, so that an endless loop does
not stop time. The time is long enough for a chip that polls a line to cost little."""
BURST_NS: Nanos = MILLISECOND

LOST = -1
"""The place of a loop's beginning, or of a return, that has been overwritten."""


class WaitReason(enum.Enum):
    """Reasons for waiting, besides the duration of commands."""

    NOTHING = "nothing"
    MOTION = "the end of the motion"
    LINE = "a line"


class _Look(Exception):
    """The command is not compiled or does more than compute."""


def _look(now: Nanos) -> NoReturn:
    raise _Look


class _Compiled(NamedTuple):
    effect: Effect
    following: int


class ProgramHost(CommandHost, Protocol):
    """The interface of a chip to its program: effects of commands, and wrong data."""

    def wrong_data(self, what: str, now: Nanos) -> None: ...


class ProgramExecution(Stateful):
    """The state of the program: place, loops, present wait.

    ``statement_ns`` is the time of a command (M-19). ``loop_starts`` and ``loop_counts`` are the loops in progress, from the
    outermost in; ``back`` is the place after the call in progress.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_chip", "_code", "_compiled", "_hooks", "_linked", "statement_ns")
    __slots__ = (
        *FIXED,
        "_burst",
        "_burst_at",
        "back",
        "began",
        "is_killed",
        "is_limited",
        "line",
        "line_level",
        "loop_counts",
        "loop_starts",
        "pc",
        "place",
        "ready",
        "waiting",
    )

    def __init__(self, chip: ProgramHost, places: int, statement_ns: Nanos) -> None:
        self._chip = chip
        self._code: list[Effect] = [_look] * places
        self._compiled: dict[int, _Compiled] = {}
        self._linked: set[int] = set()
        """Places of commands whose closures know where labels are."""
        self._hooks: StatementHooks = ()
        self.statement_ns = statement_ns
        self._burst = 0
        self._burst_at: Nanos = 0
        self.ready: Nanos
        """The earliest moment of the next command; a reset ends a wait."""
        self.began: Nanos
        """When the last command began that did more than compute."""
        self.place: int
        """Where that command lies."""
        self.loop_starts: list[int]
        self.loop_counts: list[int]
        self.back: int | None
        self.reset(0)

    def reset(self, now: Nanos) -> None:
        """As after power-up, with an empty memory."""
        self.pc = self.place = 0
        self.ready = self.began = now
        self.is_killed = False
        self.is_limited = False
        self._forget_nesting()

    def _forget_nesting(self) -> None:
        self.loop_starts = []
        self.loop_counts = []
        self.back = None
        self.waiting = WaitReason.NOTHING
        self.line = 0
        self.line_level = 0

    # ------------------------------------------------------------------ whether it runs

    @property
    def is_held(self) -> bool:
        """Whether it is held by K or LIMIT without function 51."""
        return self.is_killed or self.is_limited

    @property
    def is_at_end(self) -> bool:
        """Whether no command is left; the present one may still wait."""
        return self.pc == self._chip.memory.end and self.waiting is WaitReason.NOTHING

    def in_progress(self, now: Nanos) -> int | None:
        """The place of the command that is not over: it waits, or takes time."""
        return self.place if self.waiting is not WaitReason.NOTHING or self.ready - now > self.statement_ns else None

    def deadline(self, now: Nanos) -> Nanos | None:
        if self.waiting is not WaitReason.NOTHING or self.pc == self._chip.memory.end or self.is_held:
            return None
        return max(self.ready, now)

    def abandon(self, now: Nanos) -> None:
        """Abandon the stored commands; commands received from now on are executed (M-11)."""
        self.pc = self._chip.memory.end
        self.ready = min(self.ready, now + self.statement_ns)
        self._forget_nesting()

    def restart(self, begin: int | None, now: Nanos) -> None:
        """Run from ``begin`` on, or nothing."""
        self.reset(now)
        self.pc = self._chip.memory.end if begin is None else begin

    # ------------------------------------------------------------------ waiting

    def wait_until(self, moment: Nanos) -> None:
        self.ready = max(self.ready, moment)

    def wait_for_motion(self) -> None:
        self.waiting = WaitReason.MOTION

    def wait_for_line(self, line: int, level: int) -> None:
        self.waiting = WaitReason.LINE
        self.line = line
        self.line_level = level

    def motion_ended(self) -> None:
        if self.waiting is WaitReason.MOTION:
            self.waiting = WaitReason.NOTHING

    def line_changed(self, line: int, level: int) -> None:
        if self.waiting is WaitReason.LINE and (line, level) == (self.line, self.line_level):
            self.waiting = WaitReason.NOTHING

    # ------------------------------------------------------------------ running

    def run(self, now: Nanos, until: Nanos) -> Nanos:
        """Execute commands from ``now`` to ``until``, at most to the first that does more than compute.

        Returns the moment that the chip has reached.
        """
        statement = self.statement_ns
        most = (until - now) // statement + 1 if statement else self._left_at(now)
        code = self._code
        place = self.pc
        done = 0
        try:
            for done in range(most):  # noqa: B007 - the count is wanted where the loop breaks
                place = code[place](now)
            done = most
        except _Look:
            self.pc = place
            self._pass(now, done)
            now += done * statement
            self._look_at(place, now)
            return now
        except WrongData as wrong:
            self.pc = self._compiled[place].following
            self._pass(now, done + 1)
            now += done * statement
            self._chip.wrong_data(text_of(wrong), now)
            return now
        self.pc = place
        self._pass(now, done)
        return now

    def _left_at(self, now: Nanos) -> int:
        if self._burst_at != now:
            self._burst_at = now
            self._burst = 0
        return BURST - self._burst

    def _pass(self, now: Nanos, commands: int) -> None:
        """Let the time of a number of commands pass."""
        if self.statement_ns:
            self.ready = now + commands * self.statement_ns
            return
        self._burst += commands
        if self._burst >= BURST:
            self.ready = now + BURST_NS

    def _look_at(self, place: int, now: Nanos) -> None:
        """Execute the command at ``place``."""
        if place == self._chip.memory.end:
            return
        compiled = self._compiled.get(place) or self._compile(place)
        if self._hooks and (hook := hook_before(self._hooks, place)) is not None:
            hook(now, place)
        self._pass(now, 1)
        self.began = now
        self.place = place
        self.pc = compiled.following
        try:
            self.pc = compiled.effect(now)
        except WrongData as wrong:
            self._chip.wrong_data(text_of(wrong), now)

    def _compile(self, place: int) -> _Compiled:
        chip = self._chip
        stored = decode(chip.memory.fetch(place))
        if stored is None:
            compiled = _Compiled(_no_command, self._after(place, 1))
        else:
            command, size = stored
            following = self._after(place, size)
            code = compile_command(chip, command, place, following)
            compiled = _Compiled(code.effect, following)
            if code.computes and not any(one.has(place) for one in self._hooks):
                self._code[place] = code.effect
            if code.is_linked:
                self._linked.add(place)
        self._compiled[place] = compiled
        return compiled

    def _after(self, place: int, size: int) -> int:
        return (place + size) % len(self._code)

    # ------------------------------------------------------------------ changes of the memory

    def bytes_changed(self, first: int, count: int) -> None:
        size = len(self._code) // 2
        if count == size:
            self._forget_code()
        else:
            for byte in range(first - LONGEST + 1, first + count):
                for place in (byte % size, byte % size + size):
                    self._code[place] = _look
                    self._compiled.pop(place, None)
        memory = self._chip.memory
        for level, start in enumerate(self.loop_starts):
            if start != LOST and memory.is_lost(start):
                self.loop_starts[level] = LOST
        if self.back is not None and self.back != LOST and memory.is_lost(self.back):
            self.back = LOST

    def labels_changed(self) -> None:
        for place in self._linked:
            self._code[place] = _look
            self._compiled.pop(place, None)
        self._linked.clear()

    def _forget_code(self) -> None:
        self._code[:] = [_look] * len(self._code)
        self._compiled.clear()
        self._linked.clear()

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._forget_code()

    # ------------------------------------------------------------------ hooks

    def add_hook(self, hook: StatementHook, places: Collection[int] | None = None) -> None:
        """Call ``hook`` before each command at these places from now on; None: before all."""
        self._set_hooks((*self._hooks, HookedStatements(hook, places)))

    def remove_hook(self, hook: StatementHook) -> None:
        self._set_hooks(without(self._hooks, hook))

    def _set_hooks(self, hooks: StatementHooks) -> None:
        self._hooks = hooks
        self._forget_code()


BYTES_ARE_NO_COMMAND = Message("m1486.bytes-are-no-command", "these bytes of the command memory are no command")


def _no_command(now: Nanos) -> NoReturn:
    raise WrongData(BYTES_ARE_NO_COMMAND())
