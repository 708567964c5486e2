"""The structure of an M1486 program: which chip of a chain gets which commands, what stands in ``[ ]``, which E belongs to
which L, where the labels are, and how many bits of command memory all that takes.

Facts only; `steptwin.m1486.check` judges them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from steptwin.m1486.commands import When, memory_bits, when
from steptwin.m1486.commanduse import Control
from steptwin.m1486.syntax import ChipCommand, JumpCondition, ParsedProgram


def stored_bits(command: ChipCommand) -> int:
    """Command memory one command takes. Commands that act when received are never stored."""
    if when(command.key, command.number) is not When.QUEUED:
        return 0
    return memory_bits(command.key)


def written_label(command: ChipCommand) -> int | None:
    """The label a jump, condition or call names as a number."""
    if isinstance(command.argument, JumpCondition):
        return command.argument.label
    return command.argument if command.use.control in (Control.JUMP, Control.CALL) else None


def is_computed(command: ChipCommand) -> bool:
    """Whether it goes on at the label of the internal variable."""
    return command.use.control in (Control.JUMP, Control.CALL) and command.from_variable


@dataclass(frozen=True, slots=True)
class CommandFile:
    """The commands from ``[`` at index ``opens`` to ``]`` at index ``closes``, None where it is missing."""

    opens: int
    closes: int | None
    bits: int


@dataclass(slots=True)
class CommandStream:
    """The commands that one chip receives, in order, and their structure. Indices count its commands from 0.

    ``address`` is None where the program has no ``X``: a single chip.
    """

    address: int | None
    commands: tuple[ChipCommand, ...]
    files: list[CommandFile] = field(default_factory=list)
    nested_opens: list[int] = field(default_factory=list)
    """``[`` inside ``[ ]`` and ``]`` outside."""
    lone_closes: list[int] = field(default_factory=list)
    loops: dict[int, int] = field(default_factory=dict)
    """Index of E to index of its L; then the commands without a counterpart."""
    open_loops: list[int] = field(default_factory=list)
    lone_ends: list[int] = field(default_factory=list)
    innermost: list[int | None] = field(default_factory=list)
    """For each command its innermost loop, by the L; for each L the loop around it, and its own depth."""
    outer: dict[int, int | None] = field(default_factory=dict)
    depth: dict[int, int] = field(default_factory=dict)
    in_file: list[int | None] = field(default_factory=list)
    """For each command its file, as an index into ``files``."""
    bits_before: list[int] = field(default_factory=list)
    """Bits stored before each command, and after the last."""
    resets: list[int] = field(default_factory=list)
    """For each command: how many resets came before it."""
    labels: dict[int, list[int]] = field(default_factory=dict)
    are_loops_nested: bool = True
    """Whether every jump stays in its loop, so that the loops in progress are always those around a command."""

    @property
    def bits(self) -> int:
        return self.bits_before[-1]

    def loops_around(self, index: int) -> list[int]:
        """The loops around the command at ``index``, by their L, from the innermost out."""
        found: list[int] = []
        loop = self.innermost[index]
        while loop is not None:
            found.append(loop)
            loop = self.outer[loop]
        return found

    def present(self, index: int) -> int:
        """Index of the last command the chip has when the one at ``index`` runs: itself, or the end of its file."""
        number = self.in_file[index]
        if number is None:
            return index
        closes = self.files[number].closes
        return len(self.commands) - 1 if closes is None else closes

    def resolve(self, index: int, label: int) -> int | None:
        """Where the command at ``index`` finds ``label``: the last definition the chip has by then. None if there is none."""
        present = self.present(index)
        for at in reversed(self.labels.get(label, ())):
            if at <= present:
                return at if self.resets[at] == self.resets[index] else None
        return None

    def visible_labels(self, index: int) -> dict[int, int]:
        """All labels the command at ``index`` finds, and where."""
        places = {label: self.resolve(index, label) for label in self.labels}
        return {label: at for label, at in places.items() if at is not None}

    def bits_since(self, start: int, index: int) -> int:
        """Bits from the command at ``start`` to the last one the chip has when the command at ``index`` runs."""
        return self.bits_before[self.present(index) + 1] - self.bits_before[start]


def streams(program: ParsedProgram) -> list[CommandStream]:
    """Commands of each chip. Without ``X`` there is one stream; with it one for each address named, and commands sent while all
    listen go to each of them."""
    commands = program.all_commands
    addresses = sorted({c.number for c in commands if c.key == "X" and c.number is not None})
    if not addresses:
        return [stream_of(None, [c for c in commands if c.key != "XG"])]
    received: dict[int, list[ChipCommand]] = {address: [] for address in addresses}
    listening: int | None = None
    for command in commands:
        if command.key in ("X", "XG"):
            listening = command.number
            continue
        for address in addresses if listening is None else (listening,):
            received[address].append(command)
    return [stream_of(address, taken) for address, taken in received.items()]


def stream_of(address: int | None, commands: Sequence[ChipCommand]) -> CommandStream:
    """The structure of commands that one chip gets, without ``X``."""
    stream = CommandStream(address, tuple(commands))
    _measure(stream)
    _find_files(stream)
    _find_loops(stream)
    for index, command in enumerate(commands):
        if command.key == "@" and command.number is not None:
            stream.labels.setdefault(command.number, []).append(index)
    stream.are_loops_nested = not stream.depth or not any(_leaves_loop(stream, index) for index in range(len(commands)))
    return stream


def _leaves_loop(stream: CommandStream, index: int) -> bool:
    """Whether a jump leads to another loop than that around it, or its label is computed."""
    command = stream.commands[index]
    if is_computed(command):
        return True
    label = written_label(command)
    target = None if label is None else stream.resolve(index, label)
    return target is not None and stream.innermost[target] != stream.innermost[index]


def _measure(stream: CommandStream) -> None:
    bits = 0
    for command in stream.commands:
        stream.bits_before.append(bits)
        bits += stored_bits(command)
    stream.bits_before.append(bits)


def _find_files(stream: CommandStream) -> None:
    opens: int | None = None
    resets = 0
    for index, command in enumerate(stream.commands):
        stream.in_file.append(None if opens is None else len(stream.files))
        stream.resets.append(resets)
        if command.key == "[":
            if opens is None:
                opens = index
            else:
                stream.nested_opens.append(index)
        elif command.key == "]":
            if opens is None:
                stream.lone_closes.append(index)
            else:
                stream.files.append(CommandFile(opens, index, stream.bits_before[index] - stream.bits_before[opens]))
                opens = None
        elif command.key == "\\" and opens is None:
            resets += 1
    if opens is not None:
        stream.files.append(CommandFile(opens, None, stream.bits - stream.bits_before[opens]))


def _find_loops(stream: CommandStream) -> None:
    running: list[int] = []
    for index, command in enumerate(stream.commands):
        if command.key == "\\" and stream.in_file[index] is None:
            stream.open_loops += running
            running = []
        elif command.key == "L":
            stream.outer[index] = running[-1] if running else None
            running.append(index)
            stream.depth[index] = len(running)
        stream.innermost.append(running[-1] if running else None)
        if command.key == "E":
            if running:
                stream.loops[index] = running.pop()
            else:
                stream.lone_ends.append(index)
    stream.open_loops += running
