"""What each command does, as closures over the chip it is done on.

A maker takes the chip, the command's number, its place and the place after it, and gives a closure that does the command and
returns the place of the next one. Makers are found by the name of the command's row in the table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from steptwin.m1486.commands import DIVIDEND_LIMIT, FREE_DIVISORS, TABLE, When, find, permitted_text
from steptwin.m1486.functions import CARRY, REMAINDER, USER_FLAGS
from steptwin.m1486.lines import LINES, line_group
from steptwin.m1486.registers import GENERAL, POSITION_REGISTER, UPLOADS
from steptwin.m1486.syntax import Command, Condition
from steptwin.m1486.unit import FROM_LINES, MASK
from steptwin.machine import MILLISECOND

if TYPE_CHECKING:
    from steptwin.m1486.chip import M1486

#: M-15: what U16 sends.
PRODUCTION_SERIES = 1

#: M-5: loops inside one another.
LOOP_LEVELS = 4

Effect: TypeAlias = Callable[[], int]
Maker: TypeAlias = "Callable[[M1486, int, int, int], Effect]"


class WrongData(Exception):
    """The command is dropped, and the program stops unless function 44 is ON (M-11). The text says why."""


class Code(NamedTuple):
    """A compiled command. ``computes``: it needs no clock and shows nothing. ``is_linked``: it knows where a label is."""

    effect: Effect
    computes: bool
    is_linked: bool


class _Row(NamedTuple):
    make: Maker
    computes: bool


_MAKERS: dict[str, _Row] = {}
#: Commands whose closures know the place of a label.
_LINKED = frozenset({"Jump", "Subroutine", "If"})


def _does(*names: str, computes: bool = False) -> Callable[[Maker], Maker]:
    def enter(maker: Maker) -> Maker:
        for name in names:
            _MAKERS[name] = _Row(maker, computes)
        return maker

    return enter


def compile_command(chip: M1486, command: Command, place: int, following: int) -> Code:
    """The closure of a command that stands in the memory at ``place``."""
    if command.from_variable:
        return Code(_with_variable(chip, command.key, place, following), computes=False, is_linked=False)
    if isinstance(command.argument, Condition):
        return _condition(chip, command.argument, following)
    number = command.argument
    spec = find(command.key, number, chip.variant)
    if spec is None:
        return Code(_refusing(_out_of_range(chip, command.key, number)), computes=True, is_linked=False)
    row = _MAKERS[spec.name]
    return Code(row.make(chip, number or 0, place, following), row.computes, spec.name in _LINKED)


def _with_variable(chip: M1486, key: str, place: int, following: int) -> Effect:
    """A command without its number: the internal variable is it, whatever it is when the command is done."""

    def run() -> int:
        number = chip.unit.variable
        spec = find(key, number, chip.variant)
        if spec is None:
            raise WrongData(f"the internal variable gives: {_out_of_range(chip, key, number)}")
        return _MAKERS[spec.name].make(chip, number, place, following)()

    return run


def _out_of_range(chip: M1486, key: str, number: int | None) -> str:
    return f"{key} {'' if number is None else number} is out of range: permitted is {permitted_text(key, chip.variant)}"


def _refusing(why: str) -> Effect:
    def run() -> int:
        raise WrongData(why)

    return run


# ---------------------------------------------------------------------- program control


@_does("Loop", computes=True)
def _loop(chip: M1486, count: int, _place: int, following: int) -> Effect:
    program = chip.program

    def run() -> int:
        counts = program.loop_counts
        if len(counts) >= LOOP_LEVELS:
            raise WrongData(f"more than {LOOP_LEVELS} loops inside one another")
        counts.append(count)
        program.loop_starts.append(following)
        return following

    return run


@_does("End of loop", computes=True)
def _end_of_loop(chip: M1486, _number: int, _place: int, following: int) -> Effect:
    program = chip.program

    def run() -> int:
        counts = program.loop_counts
        if not counts:
            raise WrongData("E outside a loop")  # M-20
        left = counts[-1] - 1
        if left:
            counts[-1] = left
            start = program.loop_starts[-1]
            if start >= 0:
                return start
        counts.pop()
        start = program.loop_starts.pop()
        if left and start < 0:
            raise WrongData("the beginning of the loop has been overwritten")
        return following

    return run


@_does("Jump", computes=True)
def _jump(chip: M1486, label: int, _place: int, _following: int) -> Effect:
    target = chip.memory.labels.get(label)
    if target is None:
        return _refusing(f"there is no label {label}")  # M-17
    return lambda: target


@_does("Subroutine", computes=True)
def _call(chip: M1486, label: int, _place: int, following: int) -> Effect:
    target = chip.memory.labels.get(label)
    if target is None:
        return _refusing(f"there is no label {label}")  # M-17
    program = chip.program

    def run() -> int:
        if program.back is not None:
            raise WrongData("a subroutine inside a subroutine")
        program.back = following
        return target

    return run


@_does("End of subroutine", computes=True)
def _return(chip: M1486, _number: int, _place: int, _following: int) -> Effect:
    program = chip.program

    def run() -> int:
        back = program.back
        if back is None:
            raise WrongData("a dot outside a subroutine")  # M-20
        program.back = None
        if back < 0:
            raise WrongData("the command after the call has been overwritten")
        return back

    return run


def _condition(chip: M1486, condition: Condition, following: int) -> Code:
    asked, high, label = condition.line, condition.high, condition.label
    if find("I", asked, chip.variant) is None or find("J", label, chip.variant) is None:
        text = f"I{asked}{'H' if high else 'L'}{label}"
        return Code(_refusing(f"{text} is out of range: {permitted_text('I', chip.variant)}"), computes=True, is_linked=False)
    target = chip.memory.labels.get(label)
    taken = following if target is None else target

    def missing() -> int:
        raise WrongData(f"there is no label {label}")  # M-17

    def if_line() -> int:
        if (chip.io.levels[asked] == 1) is not high:
            return following
        return taken if target is not None else missing()

    def if_interface_line() -> int:
        if (chip.level(asked) == 1) is not high:
            return following
        return taken if target is not None else missing()

    def if_flag() -> int:
        if chip.unit.flags[asked - USER_FLAGS.start] is not high:
            return following
        return taken if target is not None else missing()

    def if_carry() -> int:
        if chip.unit.carry is not high:
            return following
        return taken if target is not None else missing()

    if asked == CARRY:
        effect = if_carry
    elif asked in USER_FLAGS:
        effect = if_flag
    else:
        effect = if_interface_line if asked in chip.interface.occupied else if_line
    return Code(effect, computes=effect is not if_interface_line, is_linked=True)


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


@_does("Upload")
def _upload(chip: M1486, number: int, _place: int, following: int) -> Effect:
    read = _UPLOADED.get(number, _reserved)

    def run() -> int:
        chip.upload(number, read(chip))
        return following

    return run


@_does("Wait")
def _wait(chip: M1486, milliseconds: int, _place: int, following: int) -> Effect:
    duration = milliseconds * MILLISECOND // chip.variant.clock

    def run() -> int:
        chip.program.wait_until(chip.now + duration)
        chip.event("wait", f"waits {duration / MILLISECOND:g} ms")
        return following

    return run


@_does("Clear kill")
def _clear_kill(_chip: M1486, _number: int, _place: int, following: int) -> Effect:
    # A program that comes here is not stopped; C75 itself acts when it is received.
    return lambda: following


# ---------------------------------------------------------------------- motion


def _setting(name: str) -> Maker:
    def make(chip: M1486, number: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run() -> int:
            setattr(drive, name, number)
            return following

        return run

    return make


for _name, _attribute in (
    ("Acceleration", "acceleration"),
    ("Start/stop", "start_stop"),
    ("Profile", "profile_speed"),
    ("Velocity", "velocity"),
    ("Qualification", "qualification"),
    ("Number of characteristic", "characteristic"),
):
    _does(_name, computes=_name != "Number of characteristic")(_setting(_attribute))


@_does("Microstep", computes=True)
def _microstep(chip: M1486, number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.set_microstep(number)
        return following

    return run


def _distance(direction: int) -> Maker:
    def make(chip: M1486, distance: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run() -> int:
            _refuse_off_grid(chip, distance)
            drive.distance_u = direction * distance
            drive.endless = 0
            return following

        return run

    return make


_does("Forward", computes=True)(_distance(1))
_does("Backward", computes=True)(_distance(-1))


def _refuse_off_grid(chip: M1486, number: int) -> None:
    grid = chip.drive.grid_u
    if number % grid:
        raise WrongData(f"{number} is not a multiple of {grid} minimum microsteps (M{chip.drive.microstep})")


@_does("Direction", computes=True)
def _direction(chip: M1486, _number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.reverse()
        return following

    return run


@_does("Go absolute", "Home")
def _go(chip: M1486, position: int, _place: int, following: int) -> Effect:
    def run() -> int:
        _refuse_off_grid(chip, position)
        chip.drive.go_to(position, chip.now)
        return following

    return run


def _endless(direction: int) -> Maker:
    def make(chip: M1486, _number: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.drive.endless = direction
            return following

        return run

    return make


_does("Go positive", computes=True)(_endless(1))
_does("Go negative", computes=True)(_endless(-1))


@_does("Equal")
def _equal(chip: M1486, position: int, _place: int, following: int) -> Effect:
    def run() -> int:
        _refuse_off_grid(chip, position)
        chip.drive.set_counter(position, chip.now)
        return following

    return run


@_does("Clear position counter")
def _clear_position(chip: M1486, _number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.set_counter(0, chip.now)
        return following

    return run


@_does("Run")
def _run(chip: M1486, _number: int, place: int, following: int) -> Effect:
    def run() -> int:
        return following if chip.motor.move() else place

    return run


def _seek(direction: int) -> Maker:
    def make(chip: M1486, line: int, place: int, following: int) -> Effect:
        def run() -> int:
            return following if chip.motor.seek(line, direction) else place

        return run

    return make


_does("Seek positive")(_seek(1))
_does("Seek negative")(_seek(-1))

# ---------------------------------------------------------------------- user lines, functions, flags


def _output(level: int) -> Maker:
    def make(chip: M1486, line: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.put_out(range(line, line + 1), level)
            return following

        return run

    return make


_does("Turn on")(_output(1))
_does("Clear")(_output(0))


def _line_wait(level: int) -> Maker:
    def make(chip: M1486, line: int, _place: int, following: int) -> Effect:
        def run() -> int:
            if chip.level(line) != level:
                chip.program.wait_for_line(line, level)
                chip.event("wait", f"waits until B{line} is {'high' if level else 'low'}")
            return following

        return run

    return make


_does("One")(_line_wait(1))
_does("Zero")(_line_wait(0))


def _switch(on: bool) -> Maker:
    def make(chip: M1486, function: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.switch(function, on)
            return following

        return run

    return make


_does("Function on")(_switch(on=True))
_does("Function off")(_switch(on=False))


def _flag(on: bool) -> Maker:
    def make(chip: M1486, flag: int, _place: int, following: int) -> Effect:
        unit = chip.unit
        index = flag - USER_FLAGS.start

        def run() -> int:
            unit.flags[index] = on
            return following

        return run

    return make


_does("Flag on", computes=True)(_flag(on=True))
_does("Flag off", computes=True)(_flag(on=False))

# ---------------------------------------------------------------------- numeric unit


@_does("Load", computes=True)
def _load(chip: M1486, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run() -> int:
        unit.variable = number
        return following

    return run


@_does("Query")
def _query(chip: M1486, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run() -> int:
        chip.unit.variable = chip.read(lines)
        return following

    return run


@_does("Order")
def _order(chip: M1486, number: int, _place: int, following: int) -> Effect:
    lines = line_group(number) or LINES

    def run() -> int:
        unit = chip.unit
        chip.put_out(lines, unit.remainder if unit.on(REMAINDER) else unit.variable)
        return following

    return run


@_does("Move to register")
def _to_register(chip: M1486, number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        unit = chip.unit
        if number in GENERAL:
            chip.memory.set_register(number, unit.variable)
        elif number == POSITION_REGISTER:
            chip.drive.set_counter(unit.variable, chip.now)
        else:
            unit.remainder = unit.variable & 0xFF
        return following

    return run


@_does("Move from register")
def _from_register(chip: M1486, number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        unit = chip.unit
        if number in GENERAL:
            unit.variable = chip.memory.register(number)
        elif number == POSITION_REGISTER:
            unit.variable = chip.drive.counter_u(chip.now)
        else:
            unit.variable = unit.remainder
        return following

    return run


def _indirect(chip: M1486, number: int, *, low_byte: bool) -> int:
    """The operand where functions 46 and 58 make its number lines or a register."""
    if chip.unit.operand_source == FROM_LINES:
        lines = line_group(number)
        if lines is None:
            raise WrongData(f"{number} names no lines, and function 46 is ON: first line and count, such as 14, up to line 21")
        return chip.read(lines)
    if number not in GENERAL:
        raise WrongData(f"{number} is no operand register, and function 58 is ON: permitted are 1 to 8")
    value = chip.memory.register(number)
    return value & 0xFF if low_byte else value


@_does("Add", computes=True)
def _add(chip: M1486, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run() -> int:
        operand = _indirect(chip, number, low_byte=False) if unit.operand_source else number
        total = unit.variable + operand
        unit.carry = total > MASK
        unit.variable = total & MASK
        return following

    return run


@_does("Subtract", computes=True)
def _subtract(chip: M1486, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run() -> int:
        operand = _indirect(chip, number, low_byte=False) if unit.operand_source else number
        difference = unit.variable - operand
        unit.carry = difference < 0
        unit.variable = difference & MASK
        return following

    return run


@_does("Multiply", computes=True)
def _multiply(chip: M1486, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run() -> int:
        operand = _indirect(chip, number, low_byte=True) if unit.operand_source else number
        unit.variable = unit.variable * operand & MASK  # M-13
        return following

    return run


@_does("Divide", computes=True)
def _divide(chip: M1486, number: int, _place: int, following: int) -> Effect:
    unit = chip.unit

    def run() -> int:
        operand = _indirect(chip, number, low_byte=True) if unit.operand_source else number
        if operand == 0:
            raise WrongData("division by 0")
        if unit.variable > DIVIDEND_LIMIT and operand not in FREE_DIVISORS:
            raise WrongData(
                f"{unit.variable} / {operand}: at most {DIVIDEND_LIMIT} can be divided, except by 2, 4, 8, 16, 32, 64"
            )
        unit.variable, remainder = divmod(unit.variable, operand)
        unit.remainder = remainder & 0xFF
        return following

    return run


if _UPLOADED.keys() != UPLOADS.keys():
    raise ValueError(f"bytes to upload with no content, or unknown: {sorted(_UPLOADED.keys() ^ UPLOADS.keys())}")

_unmade = {spec.name for spec in TABLE if spec.when is When.QUEUED} - _MAKERS.keys() - {"If"}
if _unmade:
    raise ValueError(f"commands without an effect: {', '.join(sorted(_unmade))}")
