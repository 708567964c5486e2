"""The program of an M1486 while it is executed: what it was given or downloaded last, not what a host has typed since."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import reduce
from operator import or_

from steptwin.controlflow import ControlFlow
from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.commands import When, when
from steptwin.m1486.commanduse import NOTHING, ChipState
from steptwin.m1486.encoding import decode, encode
from steptwin.m1486.functions import EDGE, INPUT, LIMITOFF, RECOVER, REGISTER
from steptwin.m1486.points import live_point
from steptwin.m1486.program import WaitReason
from steptwin.m1486.receiver import commands_of
from steptwin.m1486.registers import GENERAL
from steptwin.m1486.structure import CommandStream, streams
from steptwin.m1486.successors import flow_of
from steptwin.m1486.syntax import ChipCommand, parse
from steptwin.m1486.unit import MASK
from steptwin.messages import Message
from steptwin.simulation.kinds.m1486.memory import PLACE as TEXT
from steptwin.simulation.kinds.m1486.statement_use import function_switch, use_of
from steptwin.simulation.kinds.programs import (
    Frame,
    GivenCommand,
    ProgramStand,
    ProgramState,
    Resource,
    ResourceKind,
    Statement,
    StatementLocation,
    StatementUse,
)
from steptwin.statements import StatementHook

BEGIN = "program"
"""The name of what is executed before the first label."""
REGISTER_MAX = 0xFFFF
RESET = "\\"
_OPERAND_OF = {INPUT: ChipState.LINES, REGISTER: ChipState.REGISTERS}


class _Text:
    """A program with what is known of its text: the commands of one chip of a chain."""

    def __init__(self, source: SourceText | None, chip: M1486Chip) -> None:
        self.source = source
        self._chip = chip
        self._stream: CommandStream | None = None
        self._indices: list[int] = []
        """Indices of the commands in the stream."""
        self.commands: list[ChipCommand] = []
        self.offsets: list[int] = []
        """Where each command lies."""
        self.labels: dict[str, int] = {}
        self.end = 0
        self.statements: tuple[Statement, ...] = ()
        if source is not None:
            self._read(source)
        self.numbers: dict[int, list[int]] = {}
        """Numbers of the commands that come to lie at an offset, one after the other where a reset empties the memory."""
        for number, offset in enumerate(self.offsets):
            self.numbers.setdefault(offset, []).append(number)
        self._named = sorted((number, name) for name, number in self.labels.items())

    def _read(self, source: SourceText) -> None:
        found = streams(parse(source.text).program)
        self._stream = stream = next((one for one in found if one.address in (None, self._chip.address)), None)
        if stream is None:
            return
        for index, command in enumerate(stream.commands):
            if command.key == "@":
                self.labels[f"label {command.number}"] = len(self.commands)
            elif command.key == RESET and stream.in_file[index] is None:
                self.end = 0
            elif when(command.key, command.number) is When.QUEUED:
                self._indices.append(index)
                self.commands.append(command)
                self.offsets.append(self.end)
                self.end = (self.end + len(encode(command))) % self._chip.memory.span
        self.statements = tuple(
            Statement(command.span.start, command.span.end, source.position(command.span.start)[0]) for command in self.commands
        )

    def after(self) -> Mapping[int, Sequence[int]]:
        if self._stream is None:
            return {}
        flow = self._flow(self._stream)
        return {
            number: tuple(bisect_left(self._indices, target) for target in flow.calls.get(index, flow.after[index]))
            for number, index in enumerate(self._indices)
        }

    def reached(self, starts: Collection[int]) -> Collection[int]:
        if self._stream is None:
            return ()
        found = self._flow(self._stream).later([self._indices[number] for number in starts if number < len(self._indices)])
        return [number for number, index in enumerate(self._indices) if index in found]

    def _flow(self, stream: CommandStream) -> ControlFlow:
        return flow_of(stream, self._chip.variant, self._chip.interface)

    def name(self, number: int) -> str:
        """Name of the label at or before a statement."""
        found = bisect_right(self._named, number, key=lambda row: row[0])
        return self._named[found - 1][1] if found else BEGIN


UNKNOWN_VARIABLE = Message("simulation.m1486.unknown-variable", "the chip has no variable {name!r}: there are {names}")
VARIABLE_IS_OUT_OF_RANGE = Message(
    "simulation.m1486.variable-is-out-of-range", "{name} = {value:g}: permitted are whole numbers from 0 to {most}"
)


class ChipPrograms:
    """See `steptwin.simulation.kinds.programs.Programs`. ``source`` gives the present text.

    A command is known by its place in the memory. Once something else lies there (M-12) it comes from no text.
    """

    def __init__(self, chip: M1486Chip, source: Callable[[], SourceText | None]) -> None:
        self._chip = chip
        self._source = source
        self._known = _Text(None, chip)

    @property
    def _text(self) -> _Text:
        source = self._source()
        if source is not self._known.source:
            self._known = _Text(source, self._chip)
        return self._known

    @property
    def texts(self) -> Mapping[str, SourceText]:
        source = self._source()
        return {} if source is None else {TEXT: source}

    @property
    def statement_time(self) -> Nanos:
        return self._chip.program.statement_ns

    def statements(self, text: str) -> Sequence[Statement]:
        return self._text.statements

    def after(self, text: str) -> Mapping[int, Sequence[int]]:
        return self._text.after()

    def reached(self, text: str, starts: Collection[int]) -> Collection[int]:
        return self._text.reached(starts)

    def labels(self, text: str) -> Mapping[str, int]:
        return self._text.labels

    def add_hook(self, hook: StatementHook, locations: Collection[StatementLocation] | None = None) -> None:
        offsets = self._text.offsets
        numbers = (
            None
            if locations is None
            else frozenset(offsets[location.number] for location in locations if location.number < len(offsets))
        )
        self._chip.program.add_hook(hook, numbers)

    def remove_hook(self, hook: StatementHook) -> None:
        self._chip.program.remove_hook(hook)

    def location(self, number: int) -> StatementLocation | None:
        text = self._text
        found = text.numbers.get(number)
        stored = None if found is None else decode(self._chip.memory.fetch(number))
        if found is None or stored is None:
            return None
        there = (StatementLocation(TEXT, one) for one in found if text.commands[one] == stored.command)
        return next(there, None)

    @property
    def holding(self) -> Mapping[ProgramState, Sequence[Resource]]:
        return {
            ProgramState.KILLED: (function_switch(RECOVER),),
            ProgramState.LIMITED: (Resource(ResourceKind.PIN, "LIMIT"), *map(function_switch, (LIMITOFF, EDGE, RECOVER))),
        }

    def given(self, number: int) -> GivenCommand | None:
        stored = decode(self._chip.memory.fetch(number))
        return None if stored is None else GivenCommand(str(stored.command), use_of(stored.command, self._operands()))

    def begun(self, now: Nanos) -> Sequence[int]:
        program = self._chip.program
        has_begun = now == 0 and program.statement_ns > 0 and (program.ready > 0 or program.waiting is not WaitReason.NOTHING)
        begin = self._chip.memory.begin
        return (begin,) if has_begun and begin is not None and self._chip.memory.end != begin else ()

    @property
    def state(self) -> ProgramState:
        """A chip executes what comes: at the end of its program, too."""
        program = self._chip.program
        if self._chip.is_shut_down:
            return ProgramState.SHUT_DOWN
        if program.is_killed:
            return ProgramState.KILLED
        return ProgramState.LIMITED if program.is_limited else ProgramState.RUNS

    def queued(self) -> Sequence[GivenCommand]:
        memory = self._chip.memory
        after = [GivenCommand(str(one), use_of(one)) for one in self._stored(self._chip.program.pc, memory.end)]
        filed = [GivenCommand(str(one), use_of(one), is_filed=True) for one in self._stored(memory.end, memory.write)]
        return [*after, *filed, *(GivenCommand(str(one), use_of(one)) for one in self._chip.receiver.commands_waiting())]

    def _stored(self, place: int, end: int) -> Iterator[ChipCommand]:
        """Commands in a part of the memory, from no text."""
        memory = self._chip.memory
        while place != end and (found := decode(memory.fetch(place))) is not None:
            if self.location(place) is None:
                yield found[0]
            place = (place + found[1]) % memory.span

    def commands(self, data: bytes) -> Sequence[GivenCommand]:
        return [GivenCommand(str(one), use_of(one)) for one in commands_of(data, self._chip.variant)]

    def depth(self) -> int:
        return 0 if self._chip.program.back is None else 1

    def deferred(self) -> Sequence[StatementLocation]:
        return ()

    def has_name(self, name: str) -> bool:
        return self.read(name, 0) is not None

    def point(self, name: str) -> str | None:
        return None

    def comes_back(self, location: StatementLocation) -> bool:
        return True

    def use(self, location: StatementLocation) -> StatementUse:
        return use_of(self._text.commands[location.number], self._operands())

    def _operands(self) -> ChipState:
        """State that calculations may read besides their numbers: by a function that is ON, or a command of the text."""
        switched = {command.number for command in self._text.commands if command.use.level}
        on = {number for number in _OPERAND_OF if number in switched or self._chip.unit.on(number)}
        return reduce(or_, (_OPERAND_OF[number] for number in on), NOTHING)

    def stack(self, now: Nanos) -> Sequence[Frame]:
        program = self._chip.program
        place = program.in_progress(now)
        present = self.location(program.pc if place is None else place)
        back = None if program.back is None else self.location(program.back)
        return [Frame(self._text.name(location.number), location) for location in (present, back) if location is not None]

    def stand(self, now: Nanos) -> ProgramStand | None:
        program, state, place = self._chip.program, self.state, self._chip.program.in_progress(now)
        if state is ProgramState.SHUT_DOWN:
            return ProgramStand(state)
        if state is not ProgramState.RUNS:
            return ProgramStand(state, self.location(program.pc if place is None else place))
        if place is not None:
            return ProgramStand(state, self.location(place), program.began)
        return ProgramStand(ProgramState.STOPPED) if program.is_at_end and self.texts else None

    def variables(self, now: Nanos) -> Mapping[str, float]:
        registers = {f"register{number}": float(self._chip.memory.register(number)) for number in GENERAL}
        return {"variable": float(self._chip.unit.variable), **registers}

    def read(self, name: str, now: Nanos) -> float | None:
        pin = name.upper()
        levels = self._chip.pins()
        if pin in levels:
            return levels[pin]
        point = live_point(self._chip, name)
        return None if point is None or point.read is None else float(point.read(now))

    def set_variable(self, name: str, value: float, now: Nanos) -> None:
        chip = self._chip
        names = self.variables(now)
        if name not in names:
            raise Misuse(UNKNOWN_VARIABLE(name=name, names=list(names)))
        highest = MASK if name == "variable" else REGISTER_MAX
        if value != int(value) or not 0 <= value <= highest:
            raise Misuse(VARIABLE_IS_OUT_OF_RANGE(name=name, value=value, most=highest))
        if name == "variable":
            chip.unit.variable = int(value)
        else:
            chip.memory.set_register(int(name.removeprefix("register")), int(value))

    def execute_all(self, on: bool, now: Nanos) -> None:
        """A chip executes every command in any case."""
