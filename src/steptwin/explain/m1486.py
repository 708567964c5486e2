"""Explanation of the program of an M1486: one for each chip that it is for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import pairwise

from steptwin.controlflow import ControlFlow
from steptwin.controller import MILLISECOND, Nanos
from steptwin.diagnostics import Severity, SourceText
from steptwin.errors import Misuse
from steptwin.explain.blocks import Timing, blocks_of
from steptwin.explain.loops import TextLoop, executed, text_loops
from steptwin.explain.model import EndlessLoop, ExplainedStatement, Explanation, LongWait, MemorySection, MemoryUse, Usage
from steptwin.m1486.check import check
from steptwin.m1486.commands import ArgType, When, when
from steptwin.m1486.commands import rows as find_rows
from steptwin.m1486.commanduse import ChipState, Control, NextMove, Wait
from steptwin.m1486.drive import speed_curve
from steptwin.m1486.flow import FlowAnalysis, Settings, follow
from steptwin.m1486.functions import USER_FLAGS
from steptwin.m1486.lines import LINES, STEP_DIRECTION, Interface
from steptwin.m1486.microsteps import HIGHEST_SPEED
from steptwin.m1486.structure import CommandStream, is_computed, stored_bits, streams
from steptwin.m1486.successors import flow_of
from steptwin.m1486.syntax import ChipCommand, JumpCondition, parse
from steptwin.m1486.variants import DEFAULT, Store, Variant
from steptwin.motion.ramps import plan_distance
from steptwin.tables import complete

_ERRORS = "steptwin check finds errors in this program: a chip drops such commands and, unless function 44 is ON, stops there"
_NO_INTERRUPTS = "an M1486 has no interrupts: K and LIMIT stop its motion, and function 51 decides whether the program goes on"


def explain(
    source: SourceText, variant: Variant = DEFAULT, interface: Interface = STEP_DIRECTION, statement_time: Nanos | None = None
) -> list[Explanation]:
    """One for each chip of a chain. Raises `Misuse` for a text with wrong commands."""
    program, found = parse(source.text)
    if found:
        line = source.position(found[0].span.start)[0]
        raise Misuse(f"{source.name}:{line}: {found[0].message}: steptwin check shows all errors")
    time = variant.statement_ns if statement_time is None else statement_time
    has_errors = any(one.severity is Severity.ERROR for one in check(source.text, variant, interface).diagnostics)
    return [_Chip(source, stream, variant, interface, time).explanation(has_errors=has_errors) for stream in streams(program)]


def move_duration(state: Settings, variant: Variant) -> Nanos | None:
    """Duration of a move with these settings; None where one of them is not known."""
    settings = state.start_stop, state.acceleration, state.profile, state.velocity
    if None in settings or state.qualification not in HIGHEST_SPEED or state.distance is None:
        return None
    start_stop, acceleration, profile, velocity = (number or 0 for number in settings)
    try:
        curve = speed_curve((start_stop, acceleration, profile, velocity), state.qualification, variant.clock)
        return plan_distance(0, 0, state.distance, curve).end
    except Misuse:
        return None


class _Chip:
    """Commands of one chip. Statements are its commands; those that act when received or compressed take no time."""

    def __init__(
        self, source: SourceText, stream: CommandStream, variant: Variant, interface: Interface, statement_time: Nanos
    ) -> None:
        self._source = source
        self._stream = stream
        self._commands = stream.commands
        self._variant = variant
        self._interface = interface
        self._time = statement_time
        self._flow: ControlFlow = flow_of(stream, variant, interface)
        self._paths: FlowAnalysis = follow(stream, variant, interface)
        self._starts = [
            0,
            *(i for i, c in enumerate(self._commands) if c.use.control is Control.RESTART and stream.in_file[i] is None),
        ]
        self._statements = [
            ExplainedStatement(source.position(command.span.start)[0], str(command)) for command in self._commands
        ]

    def explanation(self, *, has_errors: bool) -> Explanation:
        reached = set(self._paths.states)
        names = self._names()
        timing = [self._timing(index) for index in range(len(self._commands))]
        entries = self._starts if self._commands else []
        blocks = blocks_of(self._flow, reached, names, entries, self._when, timing)
        address = "" if self._stream.address is None else f", chip {self._stream.address:X}"
        return Explanation(
            source=self._source,
            language="m1486",
            title=f"{self._variant.title}, {self._interface.title} interface{address}",
            statement_time=self._time,
            statements=self._statements,
            blocks=blocks,
            memory=self._memory(),
            sections=self._sections(names),
            section_unit="bits",
            usage=self._usage(reached),
            waits=self._waits(reached),
            loops=self._loops(),
            lost=(),
            unreachable=[
                index
                for index, command in enumerate(self._commands)
                if index not in reached and when(command.key, command.number) is When.QUEUED
            ],
            notes=(*((_ERRORS,) if has_errors else ()), _NO_INTERRUPTS),
        )

    def _names(self) -> dict[int, list[str]]:
        return {i: [f"label {c.number}"] for i, c in enumerate(self._commands) if c.key == "@"}

    def _when(self, number: int, target: int) -> str:
        command = self._commands[number]
        if isinstance(command.argument, JumpCondition) and target != number + 1:
            asked = command.argument
            what = f"B{asked.line}" if asked.line in LINES else f"flag {asked.line}"
            return f"{what} {'high' if asked.high else 'low'}"
        if command.use.control is Control.BRANCH:
            return "else" if len(self._flow.after[number]) > 1 else ""
        if command.use.control is Control.REPEAT and len(self._flow.after[number]) > 1:
            return "done" if target == number + 1 else "again"
        if is_computed(command):
            return f"variable = {self._commands[target].number}" if target < len(self._commands) else ""
        return ""

    # ------------------------------------------------------------------ time

    def _timing(self, index: int) -> Timing:
        command = self._commands[index]
        if when(command.key, command.number) is not When.QUEUED:
            return Timing(0)
        return _TIMINGS[command.use.waits](self, index)

    def _own_time(self, index: int) -> Timing:
        return Timing(self._time)

    def _given_time(self, index: int) -> Timing:
        number = self._commands[index].number
        if number is None:
            return Timing(None, "the time in the internal variable")
        return Timing(max(self._time, number * MILLISECOND // self._variant.clock))

    def _move_time(self, index: int) -> Timing:
        known = {move_duration(state, self._variant) for state in self._paths.states.get(index, ())}
        duration = known.pop() if len(known) == 1 else None
        return Timing(self._time, "the end of the motion") if duration is None else Timing(max(self._time, duration))

    def _line_time(self, index: int) -> Timing:
        return Timing(self._time, self._level_text(self._commands[index]))

    def _seek_time(self, index: int) -> Timing:
        return Timing(self._time, f"the end of the seek, {self._line(self._commands[index])}")

    def _sending_time(self, index: int) -> Timing:
        return Timing(self._time, "the serial line, if it is not free")

    def _level_text(self, command: ChipCommand) -> str:
        return f"{self._line(command)} {'high' if command.use.level else 'low'}"

    @staticmethod
    def _line(command: ChipCommand) -> str:
        return "the line in the internal variable" if command.number is None else f"B{command.number}"

    # ------------------------------------------------------------------ memory and lines

    def _memory(self) -> list[MemoryUse]:
        limit = self._variant.memory_bits
        store = "EEPROM" if self._variant.store is Store.EEPROM else "command memory"
        files = [
            MemoryUse(
                f"{store}, file {number}" if len(self._stream.files) > 1 else f"{store}, file in [ ]", file.bits, limit, "bits"
            )
            for number, file in enumerate(self._stream.files, 1)
        ]
        everything = MemoryUse("all commands", self._stream.bits, None, "bits")
        shared = self._variant.shared_bits
        parts = [MemoryUse("of them shared with registers 1 to 8", shared, limit, "bits")] if shared else []
        return [*files, everything, *parts]

    def _sections(self, names: Mapping[int, Sequence[str]]) -> list[MemorySection]:
        begins = sorted({0, *names, len(self._commands)})
        found: list[MemorySection] = []
        for begin, end in pairwise(begins):
            part = self._commands[begin:end]
            queued = sum(when(command.key, command.number) is When.QUEUED for command in part)
            name = ", ".join(names.get(begin, ("program",)))
            bits = sum(stored_bits(command) for command in part)
            found.append(MemorySection(name, self._statements[begin].line, queued, bits))
        return found

    def _usage(self, reached: Collection[int]) -> dict[str, list[Usage]]:
        read: dict[int, set[int]] = {}
        written: dict[int, set[int]] = {}
        registers: dict[int, tuple[set[int], set[int]]] = {}
        for index in sorted(reached):
            command, line = self._commands[index], self._statements[index].line
            for used in command.lines:
                (written if _writes_lines(command) else read).setdefault(used, set()).add(line)
            is_executed = bool(command.use.reads | command.use.writes)  # a number that no register has is wrong data
            if command.number is not None and is_executed and find_rows(command.key)[0].kind is ArgType.REGISTER:
                writes = ChipState.VARIABLE not in command.use.writes
                registers.setdefault(command.number, (set(), set()))[writes].add(line)
        lines = [
            Usage(f"B{n}", tuple(sorted(read.get(n, ()))), tuple(sorted(written.get(n, ())))) for n in sorted({*read, *written})
        ]
        kept = [Usage(f"register {n}", tuple(sorted(r)), tuple(sorted(w))) for n, (r, w) in sorted(registers.items())]
        goals = [
            Usage(str(self._commands[i].number), (self._statements[i].line,), ())
            for i in sorted(reached)
            if self._commands[i].use.next_move is NextMove.TO_POSITION and self._commands[i].number is not None
        ]
        return {"lines": lines, "registers": kept, "positions": goals}

    # ------------------------------------------------------------------ waits and loops

    def _waits(self, reached: Collection[int]) -> list[LongWait]:
        found: list[tuple[int, LongWait]] = []
        endless = self._endless_moves()
        for index in sorted(reached):
            command = self._commands[index]
            line, text = self._statements[index]
            if command.use.waits is Wait.LINE:
                found.append((index, LongWait(line, text, f"only something outside makes {self._level_text(command)}")))
            elif command.use.waits is Wait.SEEK:
                found.append((index, LongWait(line, text, f"only {self._line(command)} ends the seek", "K or LIMIT")))
            elif command.use.waits is Wait.MOTION and index in endless:
                found.append((index, LongWait(line, text, "after G+ or G- the move has no end", "K or LIMIT")))
        for loop in text_loops(self._flow, reached):
            reason = self._polling(loop)
            if reason:
                line, text = self._statements[loop.first]
                span = f"lines {line} to {self._statements[loop.last].line}"
                found.append((loop.first, LongWait(line, text, f"{span} repeat {reason}")))
        first = dict(reversed(found))
        return [wait for _, wait in sorted(first.items())]

    def _endless_moves(self) -> set[int]:
        """Commands that come, on some path of the graph, after G+ or G- without another distance between."""
        seen: set[int] = set()
        work = [
            n
            for i, c in enumerate(self._commands)
            if c.use.next_move is NextMove.ENDLESS and i in self._paths.states
            for n in self._flow.next[i]
        ]
        while work:
            index = work.pop()
            if index in seen or index >= len(self._commands):
                continue
            seen.add(index)
            use = self._commands[index].use
            if ChipState.DISTANCE not in use.writes or use.next_move in (NextMove.ENDLESS, NextMove.REVERSED):
                work += self._flow.next[index]
        return seen

    def _polling(self, loop: TextLoop) -> str:
        """Until when a loop repeats, if that depends only on what it does not change itself; empty otherwise."""
        done = [self._commands[i] for i in executed(self._flow, loop) if i < len(self._commands)]
        if not loop.exits or any(command.from_variable and _writes_lines(command) for command in done):
            return ""
        written = {line for command in done if _writes_lines(command) for line in command.lines}
        written |= {command.number or 0 for command in done if ChipState.FLAGS in command.use.writes}
        names: dict[str, None] = {}
        flags: dict[str, None] = {}
        for exit_ in (self._commands[i] for i in loop.exits):
            asked = exit_.argument
            if isinstance(asked, JumpCondition) and asked.line in LINES and asked.line not in written:
                names[f"B{asked.line}"] = None
            elif isinstance(asked, JumpCondition) and asked.line in USER_FLAGS and asked.line not in written:
                flags[f"flag {asked.line}"] = None
            elif is_computed(exit_) and (read := self._only_read(done)):
                names.update(dict.fromkeys(f"B{line}" for line in read if line not in written))
            else:
                return ""
        if names:
            return f"until {' or '.join(names)} changes"
        return f"for ever unless they are left at once: nothing in them changes {' or '.join(flags)}"

    @staticmethod
    def _only_read(done: Collection[ChipCommand]) -> Sequence[int]:
        """The lines from which the internal variable has its value, if nothing else gives it one."""
        given = [command for command in done if ChipState.VARIABLE in command.use.writes]
        if any(find_rows(command.key)[0].kind is not ArgType.LINES for command in given):
            return ()
        return sorted({line for command in given for line in command.lines})

    def _loops(self) -> list[EndlessLoop]:
        found: list[EndlessLoop] = []
        for loop in self._flow.without_way_out(self._starts):
            reads = {f"B{line}" for i in loop if not _writes_lines(self._commands[i]) for line in self._commands[i].lines}
            found.append(EndlessLoop(tuple(loop), tuple(sorted(reads, key=lambda name: int(name[1:]))), ()))
        return found


def _writes_lines(command: ChipCommand) -> bool:
    return ChipState.LINES in command.use.writes


_TIMINGS: Mapping[Wait, Callable[[_Chip, int], Timing]] = complete(
    "wait",
    Wait,
    "timing",
    {
        Wait.NOTHING: _Chip._own_time,
        Wait.TIME: _Chip._given_time,
        Wait.LINE: _Chip._line_time,
        Wait.MOTION: _Chip._move_time,
        Wait.SEEK: _Chip._seek_time,
        Wait.SENDING: _Chip._sending_time,
    },
)
