"""User lines, functions, flags and uploads (manual chapters VII.1 Upload, VII.3, VII.6 and VII.7 Query and Order)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from steptwin.m1486.effects import Effect, Maker, Makers
from steptwin.m1486.functions import REMAINDER, USER_FLAGS
from steptwin.m1486.lines import LINES, line_group
from steptwin.m1486.registers import UPLOADS

if TYPE_CHECKING:
    from steptwin.m1486.chip import M1486

#: M-15: what U16 sends.
PRODUCTION_SERIES = 1

MAKERS = Makers()


def _output(level: int) -> Maker:
    def make(chip: M1486, line: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.put_out(range(line, line + 1), level)
            return following

        return run

    return make


MAKERS.does("Turn on")(_output(1))
MAKERS.does("Clear")(_output(0))


def _line_wait(level: int) -> Maker:
    def make(chip: M1486, line: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.refuse_occupied(line)
            if chip.io.levels[line] != level:
                chip.program.wait_for_line(line, level)
                chip.event("wait", f"waits until B{line} is {'high' if level else 'low'}")
            return following

        return run

    return make


MAKERS.does("One")(_line_wait(1))
MAKERS.does("Zero")(_line_wait(0))


def _switch(on: bool) -> Maker:
    def make(chip: M1486, function: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.switch(function, on)
            return following

        return run

    return make


MAKERS.does("Function on")(_switch(on=True))
MAKERS.does("Function off")(_switch(on=False))


def _flag(on: bool) -> Maker:
    def make(chip: M1486, flag: int, _place: int, following: int) -> Effect:
        unit = chip.unit
        index = flag - USER_FLAGS.start

        def run() -> int:
            unit.flags[index] = on
            return following

        return run

    return make


MAKERS.does("Flag on", computes=True)(_flag(on=True))
MAKERS.does("Flag off", computes=True)(_flag(on=False))


@MAKERS.does("Query")
def _query(chip: M1486, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run() -> int:
        chip.unit.variable = chip.read(lines)
        return following

    return run


@MAKERS.does("Order")
def _order(chip: M1486, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run() -> int:
        unit = chip.unit
        chip.put_out(lines, unit.remainder if unit.on(REMAINDER) else unit.variable)
        return following

    return run


def _position_byte(shift: int) -> Callable[[M1486], int]:
    return lambda chip: chip.drive.counter_u(chip.now) >> shift & 0xFF


def _variable_byte(shift: int) -> Callable[[M1486], int]:
    return lambda chip: chip.unit.variable >> shift & 0xFF


def _function_byte(first: int) -> Callable[[M1486], int]:
    return lambda chip: chip.unit.function_byte(first)


def _reserved(_chip: M1486) -> int:
    """M-32: bytes without a meaning are 0."""
    return 0


_UPLOADED: dict[int, Callable[[M1486], int]] = {
    1: _position_byte(0),
    2: _position_byte(8),
    3: _position_byte(16),
    4: _variable_byte(0),
    5: _variable_byte(8),
    6: _variable_byte(16),
    14: lambda chip: chip.unit.flag_byte(),
    15: lambda chip: chip.interface.code,
    16: lambda _chip: PRODUCTION_SERIES,
    17: _function_byte(40),
    18: _function_byte(48),
    19: _function_byte(56),
    20: lambda chip: chip.variant.type_letter,
}


@MAKERS.does("Upload")
def _upload(chip: M1486, number: int, place: int, following: int) -> Effect:
    read = _UPLOADED.get(number, _reserved)

    def run() -> int:
        all_left = chip.uart.all_left()
        if all_left is not None:
            # M-36: there is one place for a byte to send, so the program goes no faster than the line.
            chip.program.wait_until(all_left)
            return place
        chip.upload(number, read(chip))
        return following

    return run


if _UPLOADED.keys() != UPLOADS.keys():
    raise ValueError(f"bytes to upload with no content, or unknown: {sorted(_UPLOADED.keys() ^ UPLOADS.keys())}")
