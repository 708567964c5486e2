"""What the command table says of each command, against a chip that executes it.

A command is executed on a chip in several states, with several numbers. What of the chip is another then must be what the row
says that it changes, no less and no more. What it reads is found by giving one piece of the state another value before: the rest
must come out as without that unless the row says that the command reads the piece.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from copy import copy
from functools import cache
from typing import Any, NamedTuple

import pytest

from steptwin.controller import SECOND
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.commands import TABLE, ArgType, CommandSpec, When, find, takes_variable, use_of
from steptwin.m1486.commanduse import NOTHING, ChipState, Control, Motion, NextMove, Setting, Wait
from steptwin.m1486.details import DETAILS
from steptwin.m1486.drive import MotionMode
from steptwin.m1486.effects import WrongData
from steptwin.m1486.execute import compile_command
from steptwin.m1486.functions import EDGE, INPUT, LIMITOFF, RECOVER, REGISTER, REMAINDER, RUNSIGN
from steptwin.m1486.functions import TABLE as ALL_FUNCTIONS
from steptwin.m1486.program import WaitReason
from steptwin.m1486.registers import GENERAL
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import variant
from steptwin.tables import complete

S = ChipState
NOW = SECOND
LATER = NOW + SECOND // 10
PLACE, FOLLOWING, LABEL, BACK, LOOP = 10, 14, 100, 60, 40
LINE, OTHER_LINE = 3, 4

PIECES: Mapping[ChipState, Callable[[M1486Chip], Any]] = complete(
    "state",
    ChipState,
    "value",
    {
        S.LINES: lambda chip: tuple(chip.io.latches),
        S.VARIABLE: lambda chip: chip.unit.variable,
        S.CARRY: lambda chip: chip.unit.carry,
        S.REMAINDER: lambda chip: chip.unit.remainder,
        S.FLAGS: lambda chip: tuple(chip.unit.flags),
        S.FUNCTIONS: lambda chip: tuple(chip.unit.functions),
        S.REGISTERS: lambda chip: tuple(map(chip.memory.register, GENERAL)),
        S.POSITION: lambda chip: (chip.drive.counter_u(LATER), chip.drive.is_valid),
        S.DISTANCE: lambda chip: (chip.drive.distance_u, chip.drive.endless),
        S.SETTINGS: lambda chip: (
            *(chip.drive.start_stop, chip.drive.acceleration, chip.drive.profile_speed),
            *(chip.drive.velocity, chip.drive.microstep, chip.drive.qualification),
        ),
        S.WAVEFORM: lambda chip: chip.pin("N"),
        S.MOTION: lambda chip: (chip.drive.motion, chip.drive.revision, chip.drive.is_stopping),
        S.SIGNALS: lambda chip: (chip.io["BOOST"], chip.io["DIRECTION"], chip.io.runsign),
        S.HELD: lambda chip: (chip.program.is_killed, chip.program.is_limited),
        S.LOOPS: lambda chip: (tuple(chip.program.loop_starts), tuple(chip.program.loop_counts)),
        S.CALL: lambda chip: chip.program.back,
        S.SENDING: lambda chip: tuple(chip.uart._leaving),
        S.LISTENING: lambda chip: chip.receiver.is_listening,
        S.MEMORY: lambda chip: (dict(chip.memory.labels), chip.memory.file, chip.memory.begin, chip.image),
    },
)


def moved_on(chip: M1486Chip) -> None:
    chip.drive.set_counter(64 * 7 if chip.drive.counter_u(NOW) != 64 * 7 else 64 * 9, NOW)


def jogs(chip: M1486Chip) -> None:
    chip.drive.jog(1, NOW)


def sends(chip: M1486Chip) -> None:
    for byte in (1, 2):
        chip.send(byte, NOW)


def set_functions(chip: M1486Chip, *numbers: int, on: bool = True) -> None:
    for number in numbers:
        chip.unit.switch(number, on)


def flipped(number: int) -> Callable[[M1486Chip], None]:
    return lambda chip: set_functions(chip, number, on=not chip.unit.on(number))


def setting(**values: int) -> Callable[[M1486Chip], None]:
    def change(chip: M1486Chip) -> None:
        for name, value in values.items():
            getattr(chip.drive, f"set_{name}")(value)

    return change


def outside(line: int) -> Callable[[M1486Chip], None]:
    def change(chip: M1486Chip) -> None:
        chip.io.set_external(line, 1 - chip.io.levels[line], NOW)

    return change


def attributes(of: str, **values: Any) -> Callable[[M1486Chip], None]:
    def change(chip: M1486Chip) -> None:
        for name, value in values.items():
            setattr(getattr(chip, of), name, copy(value))

    return change


def fill_registers(chip: M1486Chip) -> None:
    for number in GENERAL:
        chip.memory.set_register(number, 1000 + number)


OTHERS: Mapping[ChipState, list[Callable[[M1486Chip], None]]] = complete(
    "state",
    ChipState,
    "other values",
    {
        S.LINES: [outside(line) for line in (1, 2, LINE, OTHER_LINE)],
        S.VARIABLE: [attributes("unit", variable=value) for value in (2, 0xFFFFFF, 85, 9)],
        S.CARRY: [lambda chip: attributes("unit", carry=not chip.unit.carry)(chip)],
        S.REMAINDER: [attributes("unit", remainder=99)],
        S.FLAGS: [lambda chip: attributes("unit", flags=[not on for on in chip.unit.flags])(chip)],
        S.FUNCTIONS: [flipped(one.number) for one in ALL_FUNCTIONS if one.name],
        S.REGISTERS: [fill_registers],
        S.POSITION: [moved_on],
        S.DISTANCE: [attributes("drive", distance_u=64 * 11), attributes("drive", endless=-1), attributes("drive", distance_u=0)],
        S.SETTINGS: [
            setting(microstep=2),
            setting(microstep=32),
            setting(velocity=333, start_stop=33, acceleration=333, profile_speed=333),
            setting(qualification=2),
            setting(start_stop=40),
        ],
        S.WAVEFORM: [setting(characteristic=6)],
        S.MOTION: [jogs],
        S.SIGNALS: [lambda chip: chip.io.others.__setitem__("BOOST", 0)],
        S.HELD: [attributes("program", is_killed=True), attributes("program", is_limited=True)],
        S.LOOPS: [
            attributes("program", loop_starts=[LOOP, LOOP + 2], loop_counts=[2, 2]),
            attributes("program", loop_starts=[], loop_counts=[]),
        ],
        S.CALL: [attributes("program", back=None), attributes("program", back=BACK)],
        S.SENDING: [sends],
        S.LISTENING: [lambda chip: attributes("receiver", is_listening=not chip.receiver.is_listening)(chip)],
        S.MEMORY: [lambda chip: chip.memory.labels.__setitem__(7, 70)],
    },
)
"""Ways to give one piece of the state another value."""


def chip_in(*changes: Callable[[M1486Chip], None]) -> M1486Chip:
    """A chip at rest with a program in progress; its line takes time."""
    chip = M1486Chip(variant("B"), is_timed=True)
    chip.advance(NOW)
    chip.memory.labels = {1: LABEL}
    chip.unit.variable = 12
    chip.unit.remainder = 5
    for number in GENERAL:
        chip.memory.set_register(number, number)
    chip.drive.distance_u = 640
    chip.drive.set_counter(320, NOW)
    chip.program.loop_starts, chip.program.loop_counts = [LOOP], [2]
    for change in changes:
        change(chip)
    return chip


STATES: list[list[Callable[[M1486Chip], None]]] = [
    [],
    [
        attributes("unit", variable=0xFFFFFF),
        lambda chip: set_functions(chip, REMAINDER),
        lambda chip: chip.switch(RUNSIGN, True, NOW),
    ],
    [lambda chip: set_functions(chip, INPUT)],
    [lambda chip: set_functions(chip, REGISTER), outside(LINE), outside(1)],
    [attributes("unit", variable=7, flags=[True] * 7), attributes("program", back=BACK, loop_counts=[1])],
    [attributes("drive", endless=1), lambda chip: chip.io.others.__setitem__("LIMIT", 0), flipped(RECOVER)],
    [jogs, lambda chip: chip.io.latches.__setitem__(slice(1, None), [0] * 21)],
    [
        lambda chip: chip.io.others.__setitem__("LIMIT", 0),
        lambda chip: set_functions(chip, LIMITOFF, EDGE),
        flipped(RECOVER),
    ],
    [lambda chip: chip.io.others.__setitem__("LIMIT", 0), lambda chip: set_functions(chip, EDGE), flipped(RECOVER)],
    [lambda chip: chip.io.others.__setitem__("LIMIT", 0), lambda chip: set_functions(chip, LIMITOFF), flipped(RECOVER)],
    [lambda chip: chip.io.others.__setitem__("LIMIT", 0)],
    [sends, attributes("drive", distance_u=-640)],
]
NUMBERS = {
    ArgType.NUMBER: (2, 8, 14, 100, 640),
    ArgType.LABEL: (1,),
    ArgType.LINE: (1, LINE),
    ArgType.LINES: (14,),
    ArgType.FUNCTION: tuple(one.number for one in ALL_FUNCTIONS if one.name),
    ArgType.FLAG: (82,),
    ArgType.REGISTER: (3, 9, 10),
    ArgType.UPLOAD: (1, 4, 14, 17, 20),
}


def commands_of(spec: CommandSpec) -> Iterator[ChipCommand]:
    if spec.kind is ArgType.NONE:
        yield ChipCommand(spec.key)
    elif spec.kind is ArgType.CONDITION:
        yield from (ChipCommand(spec.key, JumpCondition(line, high, 1)) for line in (LINE, 80, 87) for high in (True, False))
    else:
        numbers = (*NUMBERS[spec.kind], *(spec.values or ())[:1])
        yield from (
            ChipCommand(spec.key, number) for number in dict.fromkeys(numbers) if find(spec.key, number, variant("B")) is spec
        )


class Outcome(NamedTuple):
    pieces: dict[ChipState, Any]
    place: int | None
    """None: it was refused."""
    ready: int
    waiting: WaitReason
    line: tuple[int, int]


@cache
def executed(
    command: ChipCommand, state: int, piece: ChipState = NOTHING, other: int = 0
) -> tuple[dict[ChipState, Any], Outcome]:
    """What a chip in a state is before and after a command; with another value of a piece of it."""
    chip = chip_in(*STATES[state], *(OTHERS[piece][other : other + 1] if piece else ()))
    before = {one: read(chip) for one, read in PIECES.items()}
    try:
        place = compile_command(chip, command, PLACE, FOLLOWING).effect(NOW)
    except WrongData:
        place = None
    program = chip.program
    after = {one: read(chip) for one, read in PIECES.items()}
    return before, Outcome(after, place, max(program.ready, NOW), program.waiting, (program.line, program.line_level))


def changed(before: Mapping[ChipState, Any], after: Mapping[ChipState, Any]) -> ChipState:
    found = NOTHING
    for piece in ChipState:
        found |= piece if before[piece] != after[piece] else NOTHING
    return found


def left_or_given(found: Any, before: Any, given: Any) -> bool:
    """Whether a value, or each of several, is as before or as without another value before."""
    if isinstance(found, tuple) and len(found) == len(before) == len(given):
        return all(map(left_or_given, found, before, given))
    return found in (before, given)


def read_by(command: ChipCommand, state: int) -> ChipState:
    """The pieces of the state on which it depends what the command does."""
    found = NOTHING
    _, plain = executed(command, state)
    for piece in ChipState:
        for other in range(len(OTHERS[piece])):
            before, outcome = executed(command, state, piece, other)
            moved = piece | S.POSITION if piece is S.MOTION else piece  # a jog that is in progress ends elsewhere
            rest = all(outcome.pieces[one] == plain.pieces[one] for one in ChipState if one not in moved)
            is_left = left_or_given(outcome.pieces[piece], before[piece], plain.pieces[piece])
            if not (rest and is_left and outcome[1:] == plain[1:]):
                found |= piece
    return found


QUEUED = [spec for spec in TABLE if spec.when is When.QUEUED]
every_row = pytest.mark.parametrize("spec", QUEUED, ids=lambda spec: spec.name)


@every_row
def test_a_command_changes_what_its_row_says(spec: CommandSpec) -> None:
    every = NOTHING
    for command in commands_of(spec):
        found = NOTHING
        for state in range(len(STATES)):
            before, outcome = executed(command, state)
            found |= changed(before, outcome.pieces)
        assert found in command.use.writes, f"{command} changes {found & ~command.use.writes}"
        every |= found
    assert every == spec.use.writes


@every_row
def test_a_command_reads_what_its_row_says(spec: CommandSpec) -> None:
    every = NOTHING
    for command in commands_of(spec):
        found = NOTHING
        for state in (0, 1, 2, 3, 4, 6, 8):
            found |= read_by(command, state)
        assert found in command.use.reads, f"{command} reads {found & ~command.use.reads}"
        every |= found
    assert every == spec.use.reads


PLACES: Mapping[Control, set[str]] = complete(
    "control",
    Control,
    "places",
    {
        Control.NEXT: {"next"},
        Control.JUMP: {"label"},
        Control.BRANCH: {"label", "next"},
        Control.CALL: {"label"},
        Control.RETURN: {"back"},
        Control.REPEAT: {"loop", "next"},
        Control.RESTART: set(),
    },
)
NAMES = {FOLLOWING: "next", LABEL: "label", BACK: "back", LOOP: "loop", LOOP + 2: "loop", PLACE: "again"}
HELD_BY: Mapping[Wait, set[str]] = complete(
    "wait",
    Wait,
    "what holds the program",
    {
        Wait.NOTHING: set(),
        Wait.TIME: {"time"},
        Wait.LINE: {"line"},
        Wait.MOTION: {"motion"},
        Wait.SEEK: {"motion"},
        Wait.SENDING: {"time"},
    },
)
BEGUN: Mapping[Motion, set[MotionMode]] = complete(
    "motion",
    Motion,
    "motions of the drive",
    {
        Motion.NONE: set(),
        Motion.MOVE: {MotionMode.MOVE, MotionMode.ENDLESS},
        Motion.SEEK: {MotionMode.SEEK},
        Motion.STORED: set(),
    },
)


def outcomes(spec: CommandSpec) -> Iterator[tuple[ChipCommand, dict[ChipState, Any], Outcome]]:
    for command in commands_of(spec):
        for state in range(len(STATES)):
            before, outcome = executed(command, state)
            if outcome.place is not None:
                yield command, before, outcome


@every_row
def test_a_program_goes_on_where_the_row_says(spec: CommandSpec) -> None:
    found = {NAMES[outcome.place] for _, _, outcome in outcomes(spec) if outcome.place is not None}
    holds = {Wait.MOTION, Wait.SEEK, Wait.SENDING}
    assert found == PLACES[spec.use.control] | ({"again"} if spec.use.waits in holds else set())


@every_row
def test_a_program_waits_for_what_the_row_says(spec: CommandSpec) -> None:
    found = {outcome.waiting.name.lower() for _, _, outcome in outcomes(spec) if outcome.waiting is not WaitReason.NOTHING}
    found |= {"time" for _, _, outcome in outcomes(spec) if outcome.ready > NOW}
    assert found == HELD_BY[spec.use.waits]
    if spec.use.waits is Wait.LINE:
        awaited = {outcome.line for _, _, outcome in outcomes(spec) if outcome.waiting is WaitReason.LINE}
        assert awaited <= {(command.number, spec.use.level) for command in commands_of(spec)}


@every_row
def test_a_command_begins_the_motion_that_the_row_says(spec: CommandSpec) -> None:
    begun = {outcome.pieces[S.MOTION][0] for _, before, outcome in outcomes(spec) if outcome.pieces[S.MOTION] != before[S.MOTION]}
    assert begun == BEGUN[spec.use.motion]


NEXT_MOVES: Mapping[NextMove, Callable[[int, int, tuple[int, int]], tuple[int, int]]] = complete(
    "next move",
    NextMove,
    "distance and direction without end",
    {
        NextMove.UNCHANGED: lambda number, position, before: before,
        NextMove.FORWARD: lambda number, position, before: (number, 0),
        NextMove.BACKWARD: lambda number, position, before: (-number, 0),
        NextMove.REVERSED: lambda number, position, before: (-before[0], -before[1]),
        NextMove.TO_POSITION: lambda number, position, before: (number - position, 0),
        NextMove.TO_ZERO: lambda number, position, before: (-position, 0),
        NextMove.ENDLESS: lambda number, position, before: (before[0], 1),
    },
)


@every_row
def test_a_command_makes_of_the_next_move_what_the_row_says(spec: CommandSpec) -> None:
    for command, before, outcome in outcomes(spec):
        if MotionMode.JOG not in before[S.MOTION]:
            distance, endless = NEXT_MOVES[spec.use.next_move](command.number or 0, before[S.POSITION][0], before[S.DISTANCE])
            found = outcome.pieces[S.DISTANCE]
            assert (found[0], abs(found[1])) == (distance, abs(endless))


@pytest.mark.parametrize("spec", [spec for spec in QUEUED if spec.use.sets is not None], ids=lambda spec: spec.name)
def test_a_number_becomes_what_the_row_says(spec: CommandSpec) -> None:
    name = "variable" if spec.use.sets is Setting.VARIABLE else spec.key
    (detail,) = (row for row in DETAILS if row.detail.name == name)
    for command in commands_of(spec):
        chip = chip_in()
        compile_command(chip, command, PLACE, FOLLOWING).effect(NOW)
        assert detail.read(chip, NOW) == command.number


@pytest.mark.parametrize("key", [key for key in {spec.key: 0 for spec in QUEUED} if takes_variable(key)])
def test_a_command_with_the_internal_variable_changes_no_more_than_its_rows_say(key: str) -> None:
    use = use_of(key, None)
    assert S.VARIABLE in use.reads
    for number in (1, 3, 9, 12, 14, 40, 42, 64, 85, 100, 640):
        chip = chip_in(attributes("unit", variable=number))
        before = {one: read(chip) for one, read in PIECES.items()}
        with suppress(WrongData):
            compile_command(chip, ChipCommand(key), PLACE, FOLLOWING).effect(NOW)
        assert changed(before, {one: read(chip) for one, read in PIECES.items()}) in use.writes


AT_ONCE = {
    "Address": (b"@5", ChipState.MEMORY),
    "Kill": (b"k", S.MOTION | S.POSITION | S.HELD),
    "Clear kill": (b"c75", S.HELD),
    "Disable": (b"[", S.MEMORY),
    "Enable": (b"[\r]", S.MEMORY),
    "Reset": (b"\\", ~(S.LISTENING | S.SENDING)),
    "indeX": (b"x3", S.LISTENING),
    "indeX all": (b"xg", S.LISTENING),
}
"""What is sent for the commands that are not executed in program order, and what of a chip is another after it, by the manual."""


@pytest.mark.parametrize("spec", [spec for spec in TABLE if spec.when is not When.QUEUED], ids=lambda spec: spec.name)
def test_a_command_that_acts_when_received_or_compressed_changes_what_its_row_says(spec: CommandSpec) -> None:
    text, writes = AT_ONCE[spec.name]
    assert writes == spec.use.writes
    chip = M1486Chip(variant("B"))
    chip.receive(b"t81\rt40\rt51\rc51\rn2\rv300\rt3\rc4\r:5\r/2\r+1\rf640\r@4\rl3\r", 0)
    if spec.name in ("Kill", "Reset", "Clear kill"):
        chip.receive(b"g+\rr\r", NOW)
    chip.advance(NOW)
    if spec.name == "Clear kill":
        chip.receive(b"k\r", NOW)
    elif spec.name == "indeX all":
        chip.receive(b"x3\r", NOW)
    before = {one: read(chip) for one, read in PIECES.items()}
    chip.receive(text + b"\r", NOW)
    found = changed(before, {one: read(chip) for one, read in PIECES.items()})
    assert found in writes
    assert found
