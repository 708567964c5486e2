"""Download of programs into a chip, command by command with the chip's flow control; a file in ``[ ]`` whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from steptwin.controller import MILLISECOND, SECOND
from steptwin.diagnostics import Severity, SourceText, render
from steptwin.drivers.exchange import SentLate
from steptwin.drivers.m1486.failures import Busy, DoubtfulMove, FileGivenUp
from steptwin.drivers.m1486.motion import UNKNOWN_S, ChipMotion, ChipMotionCommand
from steptwin.drivers.m1486.settings import ChipSettings, after_reset
from steptwin.drivers.m1486.talk import TYPE_QUERY
from steptwin.drivers.m1486.unit import ChipUnit
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.m1486.check import check
from steptwin.m1486.commands import TABLE
from steptwin.m1486.commanduse import TO_LABEL, ChipState, Control
from steptwin.m1486.lines import INTERFACES, STEP_DIRECTION, Interface
from steptwin.m1486.structure import written_label
from steptwin.m1486.syntax import ChipCommand, ParsedProgram
from steptwin.m1486.variants import Store, Variant
from steptwin.messages import Message, text_of

DownloadProgress = Callable[[int, int], object]
"""Called with the number of commands sent, and their total."""

MOST_ERRORS = 10
"""Most errors shown for a program: a file of another kind has one in each line."""
ERASE_MARGIN_S = 0.1
FULL_PAUSE_NS = 50 * MILLISECOND
"""Pause for the input buffer to empty when characters come back inverted."""
MOVES = frozenset(
    spec.letter.lower()
    for spec in TABLE
    if spec.key == "["
    or spec.use.control in (*TO_LABEL, Control.REPEAT)
    or (ChipState.MOTION in spec.use.writes and spec.use.control is not Control.RESTART)
)
"""Commands that move, or jump to commands sent before."""


def checked_program(text: str, variant: Variant, interface: Interface, name: str = "program") -> ParsedProgram:
    """The parsed program. Raises `Misuse` with its errors."""
    checked = check(text, variant, interface)
    if not checked.is_sound:
        errors = [d for d in checked.diagnostics if d.severity is Severity.ERROR]
        more = f"\nand {len(errors) - MOST_ERRORS} more errors" if len(errors) > MOST_ERRORS else ""
        raise Misuse(f"{name} is not sent:\n{render(SourceText(name, text), errors[:MOST_ERRORS])}{more}")
    return checked.program


NOT_TO_SEVERAL_CHIPS = Message(
    "drivers.m1486.not-to-several-chips", "XG is not sent: a command to several chips cannot be verified; select each chip with X"
)


def parts(program: ParsedProgram) -> list[tuple[int | None, list[ChipCommand]]]:
    """The commands in order, split where ``X`` selects another chip; None before the first X."""
    found: list[tuple[int | None, list[ChipCommand]]] = [(None, [])]
    for command in program.commands:
        if command.key == "XG":
            raise Misuse(NOT_TO_SEVERAL_CHIPS())
        if command.key == "X":
            found.append((command.number, []))
        else:
            found[-1][1].append(command)
    return [(address, commands) for address, commands in found if commands]


def probes(commands: Sequence[ChipCommand]) -> list[bool]:
    """Whether a query may be sent before each command. Not in a loop or behind a label that is jumped back to: the query would
    become part of the program, and each pass would upload a byte."""
    allowed = [True] * len(commands)
    loops: list[int] = []
    labels: dict[int | None, int] = {}
    for index, command in enumerate(commands):
        begin = index
        if command.key == "L":
            loops.append(index)
        elif command.key == "@":
            labels.setdefault(command.number, index)
        elif command.key == "E" and loops:
            begin = loops.pop()
        elif command.use.control in TO_LABEL:
            label = written_label(command)
            begin = min(labels.values(), default=index) if label is None else labels.get(label, index)
        for inside in range(begin + 1, index + 1):
            allowed[inside] = False
    return allowed


CHIPS_OF_SEVERAL_TYPES = Message(
    "drivers.m1486.chips-of-several-types",
    "{name} is not sent: {chip} is an {kind}, {other} an {another}; a program is checked for one type: send each its own",
)
NO_CHIP_IS_SELECTED = Message("drivers.m1486.no-chip-is-selected", "{name} is not sent: no X before {command} selects its chip")
CHIP_IS_NOT_ON_THE_LINE = Message(
    "drivers.m1486.chip-is-not-on-the-line", "{name} is not sent: it names chip {address:X}, which is not on this line"
)


async def send_program(
    units: Mapping[int | None, ChipUnit],
    text: str,
    *,
    progress: DownloadProgress | None = None,
    name: str = "program",
) -> bytes:
    """Send a program to the chips it selects; ``units[None]`` gets the commands before any ``X``. Returns the bytes that ``U``
    uploaded outside ``[ ]``."""
    first = next(iter(units.values()))
    other = next((unit for unit in units.values() if unit.variant is not first.variant), None)
    if other is not None:
        kind, another = first.variant.title, other.variant.title
        raise Misuse(CHIPS_OF_SEVERAL_TYPES(name=name, chip=first.name, kind=kind, other=other.name, another=another))
    permission = first.permission()
    asked = {unit: unit.permission().is_stopped for unit in units.values()}
    program = checked_program(text, first.variant, await _interface(first, text, permission), name)
    found = parts(program)
    for address, commands in found:
        if address not in units:
            if address is None:
                raise Misuse(NO_CHIP_IS_SELECTED(name=name, command=commands[0]))
            raise Misuse(CHIP_IS_NOT_ON_THE_LINE(name=name, address=address))
    total = sum(len(commands) for _, commands in found)
    done = 0
    uploaded = b""

    def report(count: int) -> None:
        if progress is not None:
            progress(done + count, total)

    for address, commands in found:
        unit = units[address]
        if unit is not first or done:  # not too late: the commands before took their time
            permission = Permission(unit.line.now, permission.patience_ns, asked[unit])
        typist = _Typist(unit, report, permission)
        uploaded += await typist.type(commands)
        asked[unit] = typist.permission.is_stopped
        done += len(commands)
    return uploaded


async def _interface(unit: ChipUnit, text: str, permission: Permission) -> Interface:
    """The driver interface to check a program for. The chip is asked only where it makes a difference."""
    if unit.shared.interface is None:
        sound = [check(text, unit.variant, interface).is_sound for interface in INTERFACES]
        if any(sound) and not all(sound):
            async with unit.turn(permission):
                await unit.rest()
                await unit.find_interface()
    return unit.shared.interface or STEP_DIRECTION


TAKES_NO_CHARACTERS = Message("drivers.m1486.takes-no-characters", "{place}: {chip} takes no more characters: it {why}")


class _Typist:
    """Sends commands to one chip."""

    def __init__(self, unit: ChipUnit, report: Callable[[int], object], permission: Permission) -> None:
        self._unit = unit
        self._report = report
        self.permission = permission
        """For the rest: a K of the text begins another one."""
        self._capacity = unit.variant.input_bits // 8
        self._typed = 0  # characters that may lie in the input buffer
        self._may_ask = True  # see `probes`

    async def type(self, commands: Sequence[ChipCommand]) -> bytes:
        unit = self._unit
        uploaded = b""
        index = 0
        allowed = probes(commands)
        async with unit.turn(self.permission):
            await unit.rest()
            while index < len(commands):
                self._may_ask = allowed[index]
                is_last_chance = self._may_ask and index + 1 < len(commands) and not allowed[index + 1]
                if is_last_chance and self._typed:
                    await self._empty()
                if commands[index].key == "[":
                    closes = next(n for n in range(index, len(commands)) if commands[n].key == "]")
                    await self._file(commands[index : closes + 1], index)
                    index = closes + 1
                else:
                    uploaded += await self._command(commands[index])
                    index += 1
                self.permission.extend()
                self._report(index)
        return uploaded

    async def _file(self, commands: Sequence[ChipCommand], done: int) -> None:
        unit = self._unit
        await self._empty()
        if unit.variant.store is Store.EEPROM:
            await reset(unit)
        await type_file(
            unit, [str(command).lower() for command in commands], self.permission, lambda count: self._report(done + count)
        )
        self._typed = self._capacity

    async def _command(self, command: ChipCommand) -> bytes:
        unit = self._unit
        text = str(command).lower()
        if command.key == "\\":
            await self._empty()
            await reset(unit)
            return b""
        if command.key == "K":
            was_stopped, stops = self.permission.is_stopped(), unit.shared.stops
            await unit.kill()
            if not was_stopped and unit.shared.stops == stops + 1:  # only by this K, which does not end the text
                self.permission = unit.permission()
            return b""
        if self._typed + len(text) + 1 + len(TYPE_QUERY) + 1 > self._capacity - 3:
            await self._empty()
        unit.shared.note_downloaded(text, unit.stored_bits)
        if text[0] in MOVES:
            await begin(unit, text, ChipMotion.BLOCK, self.permission)
        else:
            unit.shared.settings = ChipSettings()
            if command.key == "U":
                await self._empty()
                return await unit.send(text, answers=True)
            await unit.act(text, self.permission)
        self._typed += len(text) + 1
        if unit.talk.nearly_full:
            await self._empty()
        return b""

    async def _empty(self) -> None:
        """Wait until the chip has executed all commands, so that its buffer is empty. Raises `Busy` after a minute.

        Where no query is permitted, wait only shortly: a chip at rest empties its buffer meanwhile, a moving one answers 5EH.
        """
        unit = self._unit
        if not self._may_ask:
            await unit.line.sleep(FULL_PAUSE_NS / SECOND)
            return
        if await unit.query_type(round(UNKNOWN_S * SECOND), self.permission) is None:
            raise Busy(TAKES_NO_CHARACTERS(place=unit.place, chip=unit.name, why=unit.why_busy()))
        self._typed = 0


FILE_IS_HALF_TYPED = Message(
    "drivers.m1486.file-is-half-typed",
    "{place}: the file for {chip} could not be typed ({why}), and the chip not be reset ({second}): it still waits for "
    "the rest of it",
)
FILE_IS_GIVEN_UP = Message(
    "drivers.m1486.file-is-given-up",
    "{place}: the file for {chip} was not typed to its end ({why}); the chip was reset: nothing of it runs, position and "
    "settings are those of power-up",
)


async def type_file(unit: ChipUnit, lines: Sequence[str], permission: Permission, report: Callable[[int], object]) -> None:
    """Send a file from ``[`` to ``]``, which starts it.

    On an earlier error the chip is reset, which discards the file (manual chapter II, Memory), and `FileGivenUp` is raised.
    Raises `DoubtfulMove` if it is unknown whether ``]`` was received.
    """
    is_whole = False
    try:
        for count, line in enumerate(lines[:-1], start=1):
            unit.shared.note_downloaded(line, unit.stored_bits)
            await unit.act(line, permission, once=True, retype=count == 1)
            if unit.talk.nearly_full:
                await unit.line.sleep(FULL_PAUSE_NS / SECOND)
            permission.extend()
            report(count)
        unit.shared.note_downloaded(lines[-1], unit.stored_bits)
        is_whole = True
        await begin(unit, lines[-1], ChipMotion.BLOCK, permission, retype=False)
    except (LineFailure, Refusal) as failure:
        if is_whole and isinstance(failure, DoubtfulMove | SentLate):
            raise
        try:
            await reset(unit)
        except (LineFailure, Refusal) as second:
            raise FileGivenUp(
                FILE_IS_HALF_TYPED(place=unit.place, chip=unit.name, why=text_of(failure), second=text_of(second))
            ) from failure
        raise FileGivenUp(FILE_IS_GIVEN_UP(place=unit.place, chip=unit.name, why=text_of(failure))) from failure
    report(len(lines))


async def begin(
    unit: ChipUnit,
    text: str,
    kind: ChipMotion,
    permission: Permission,
    *,
    target_u: int | None = None,
    duration_s: float | None = None,
    retype: bool = True,
    label: int | None = None,
) -> None:
    """Send a command that begins a motion, once. ``label``: where it starts a program."""
    shared = unit.shared
    stops = shared.stops  # a command that is sent too late is stopped before it is noted

    def register_motion(target_u: int | None, duration_s: float | None) -> None:
        if kind is ChipMotion.BLOCK:
            shared.settings = ChipSettings()
            unit.talk.uploads = shared.uploads = bytearray()
        # An E type executes a command after it has written it to its EEPROM.
        shared.motion = ChipMotionCommand(
            kind, unit.line.now() + unit.write_ns, stops, target_u, duration_s, unit.talk.spoilt.get(unit.address, 0), label=label
        )

    shared.motion = None
    if kind is ChipMotion.BLOCK:
        shared.note_begin(label)
    try:
        await unit.act(text, permission, once=True, retype=retype)
    except SentLate:
        register_motion(None, None)
        raise
    except LineFailure as failure:
        if not failure.uncertain:
            raise
        register_motion(None, None)
        raise DoubtfulMove(unit.name, kind.value, failure) from failure
    register_motion(target_u, duration_s)


async def reset(unit: ChipUnit) -> None:
    """``\\``, and the time an E type takes for it."""
    await unit.send("\\", stored=False)
    shared = unit.shared
    unit.talk.forget(unit.address)
    shared.forget()
    shared.note_defaults()
    shared.was_awake = False
    shared.is_position_valid = True
    shared.settings = ChipSettings() if shared.interface is None else after_reset(unit.variant, shared.interface)
    if unit.variant.erase_ns:
        await unit.line.sleep(unit.variant.erase_ns / SECOND + ERASE_MARGIN_S)
