"""User lines, functions, flags and uploads (manual chapters VII.1 Upload, VII.3, VII.6 and VII.7 Query and Order)."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import Nanos
from steptwin.m1486.effects import CommandHost, Effect, Maker, Makers
from steptwin.m1486.functions import REMAINDER, USER_FLAGS
from steptwin.m1486.lines import LINES, line_group
from steptwin.m1486.registers import UPLOADS
from steptwin.messages import Message

PRODUCTION_SERIES = 1
"""M-15: the byte of U16."""

MAKERS = Makers()


def _output(level: int) -> Maker:
    def make(chip: CommandHost, line: int, _place: int, following: int) -> Effect:
        def run(now: Nanos) -> int:
            chip.put_out(range(line, line + 1), level, now)
            return following

        return run

    return make


MAKERS.does("Turn on")(_output(1))
MAKERS.does("Clear")(_output(0))


WAITS_UNTIL_HIGH = Message("m1486.waits-until-high", "waits until B{line} is high")
WAITS_UNTIL_LOW = Message("m1486.waits-until-low", "waits until B{line} is low")


def _line_wait(level: int) -> Maker:
    def make(chip: CommandHost, line: int, _place: int, following: int) -> Effect:
        def run(now: Nanos) -> int:
            chip.refuse_occupied(line)
            if chip.io.levels[line] != level:
                chip.program.wait_for_line(line, level)
                text = WAITS_UNTIL_HIGH if level else WAITS_UNTIL_LOW
                chip.event("wait", text(line=line), now, ("line", line), ("level", level))
            return following

        return run

    return make


MAKERS.does("One")(_line_wait(1))
MAKERS.does("Zero")(_line_wait(0))


def _switch(on: bool) -> Maker:
    def make(chip: CommandHost, function: int, _place: int, following: int) -> Effect:
        def run(now: Nanos) -> int:
            chip.switch(function, on, now)
            return following

        return run

    return make


MAKERS.does("Function on")(_switch(on=True))
MAKERS.does("Function off")(_switch(on=False))


def _flag(on: bool) -> Maker:
    def make(chip: CommandHost, flag: int, _place: int, following: int) -> Effect:
        unit = chip.unit
        index = flag - USER_FLAGS.start

        def run(now: Nanos) -> int:
            unit.flags[index] = on
            return following

        return run

    return make


MAKERS.does("Flag on", computes=True)(_flag(on=True))
MAKERS.does("Flag off", computes=True)(_flag(on=False))


@MAKERS.does("Query")
def _query(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run(now: Nanos) -> int:
        chip.unit.variable = chip.read(lines, now)
        return following

    return run


@MAKERS.does("Order")
def _order(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run(now: Nanos) -> int:
        unit = chip.unit
        chip.put_out(lines, unit.remainder if unit.on(REMAINDER) else unit.variable, now)
        return following

    return run


def _position_byte(shift: int) -> Callable[[CommandHost, Nanos], int]:
    return lambda chip, now: chip.drive.counter_u(now) >> shift & 0xFF


def _variable_byte(shift: int) -> Callable[[CommandHost, Nanos], int]:
    return lambda chip, now: chip.unit.variable >> shift & 0xFF


def _function_byte(first: int) -> Callable[[CommandHost, Nanos], int]:
    return lambda chip, now: chip.unit.function_byte(first)


def _reserved(_chip: CommandHost, _now: Nanos) -> int:
    """M-32: bytes without a meaning are 0."""
    return 0


UPLOADED: dict[int, Callable[[CommandHost, Nanos], int]] = {
    1: _position_byte(0),
    2: _position_byte(8),
    3: _position_byte(16),
    4: _variable_byte(0),
    5: _variable_byte(8),
    6: _variable_byte(16),
    14: lambda chip, now: chip.unit.flag_byte(),
    15: lambda chip, now: chip.interface.code,
    16: lambda _chip, now: PRODUCTION_SERIES,
    17: _function_byte(40),
    18: _function_byte(48),
    19: _function_byte(56),
    20: lambda chip, now: chip.variant.type_letter,
}
"""The byte that each ``U`` sends."""


@MAKERS.does("Upload")
def _upload(chip: CommandHost, number: int, place: int, following: int) -> Effect:
    read = UPLOADED.get(number, _reserved)

    def run(now: Nanos) -> int:
        all_left = chip.uart.all_left()
        if all_left is not None:
            # M-36: the chip holds one byte to send, so that the program is not faster than the line.
            chip.program.wait_until(all_left)
            return place
        chip.upload(number, read(chip, now), now)
        return following

    return run


if UPLOADED.keys() != UPLOADS.keys():
    raise ValueError(f"bytes to upload with no content, or unknown: {sorted(UPLOADED.keys() ^ UPLOADS.keys())}")
