"""Values by name: how a name chooses registers, how their values travel, and how many are read with few frames. Pure."""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import isfinite
from typing import NamedTuple, TypeAlias

from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.mic488.encoding import dint_to_words, real_to_words, word_to_int, words_to_dint, words_to_real
from steptwin.mic488.ranges import ValueRange
from steptwin.mic488.registermap import DataType, Register, RegisterMap, Space, Type, WriteEffect
from steptwin.mic488.registers import axes_of_mask
from steptwin.mic488.status import ProgramState
from steptwin.numerals import read_number
from steptwin.wire import pdu

RegisterValue: TypeAlias = bool | int | float

BRIDGE = {Space.HOLDING: 16, Space.COIL: 256, Space.INPUT: 256}
"""Addresses read in addition, to save a frame: at 38400 bit/s a frame costs as much as 38 characters."""

_MOST = {Space.HOLDING: pdu.MAX_REGISTERS, Space.COIL: pdu.MAX_BITS, Space.INPUT: pdu.MAX_BITS}
_READS = {Space.HOLDING: pdu.READ_HOLDING_REGISTERS, Space.COIL: pdu.READ_COILS, Space.INPUT: pdu.READ_DISCRETE_INPUTS}
_SPACES = {space: number for number, space in enumerate(Space)}
_NAME = re.compile(r"(?P<name>\w+?)(?:\[(?P<cell>\d{1,5})\])?(?::(?P<view>\w+))?\Z", re.ASCII)
_SWITCHES = {"on": 1.0, "true": 1.0, "off": 0.0, "false": 0.0}
PROGRAM = 0
"""The program beside axes 1 to 4, in `halted`."""
FORM = Message(
    "mic488.form-of-a-name", "expected NAME, or USER_REGISTER[N] with :int, :dint or :real behind it unless it is a WORD"
)


class UserFormat(enum.Enum):
    """The format in which user registers are read and written."""

    WORD = "word"
    INT = "int"
    DINT = "dint"
    REAL = "real"

    @property
    def size(self) -> int:
        return 2 if self in (UserFormat.DINT, UserFormat.REAL) else 1

    @property
    def range(self) -> str:
        return {"word": "0…65535", "int": "−32768…32767", "dint": "−2³¹…2³¹−1", "real": "±3.4e38"}[self.value]


class RegisterItem:
    """One value of a controller: a register, or some of the user registers. Items of the same registers and view are equal."""

    __slots__ = ("_key", "address", "cell", "register", "size", "view")

    def __init__(self, register: Register, cell: int = 0, view: UserFormat = UserFormat.WORD) -> None:
        self.register = register
        self.cell = cell
        self.view = view
        self.address = register.address + cell
        self.size = view.size if register.type is Type.MEMORY else register.type.size
        self._key = (_SPACES[register.space], self.address, view.value)

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RegisterItem) and self._key == other._key

    def __lt__(self, other: RegisterItem) -> bool:
        return self._key < other._key

    def __repr__(self) -> str:
        return f"<Item {self.name}>"

    def at(self, cell: int) -> RegisterItem:
        """The same view of another user register."""
        return RegisterItem(self.register, cell, self.view)

    @property
    def name(self) -> str:
        if self.register.type is not Type.MEMORY:
            return self.register.name
        return f"{self.register.name}[{self.cell}]{'' if self.view is UserFormat.WORD else f':{self.view.value}'}"


NO_NAME_OF_A_VALUE = Message("mic488.no-name-of-a-value", "{text!r} is not a name of a value: {form}")
ONE_VALUE = Message("mic488.one-value", "{text!r}: {name} is one value of type {type}; name it without [ ] and :")
CHOOSE_ONE = Message("mic488.choose-one", "{text!r}: choose one of {name}[0] to {name}[{last}]")
UNKNOWN_FORMAT = Message("mic488.unknown-format", "{text!r}: permitted behind : are word, int, dint and real")


@lru_cache(2048)
def named(registers: RegisterMap, text: str) -> RegisterItem:
    """The value of that name: ``M1_POS_ACT``, ``OUT3``, ``USER_REGISTER[12]:real``. Raises `Misuse`."""
    match = _NAME.match(text.strip())
    if match is None:
        raise Misuse(NO_NAME_OF_A_VALUE(text=text, form=FORM()))
    register = registers.named(match["name"])
    if register.type is not Type.MEMORY:
        if match["cell"] or match["view"]:
            raise Misuse(ONE_VALUE(text=text, name=register.name, type=register.type.value))
        return RegisterItem(register)
    if match["cell"] is None:
        raise Misuse(CHOOSE_ONE(text=text, name=register.name, last=register.cells - 1))
    try:
        view = UserFormat((match["view"] or "word").lower())
    except ValueError:
        raise Misuse(UNKNOWN_FORMAT(text=text)) from None
    return user_item(registers, int(match["cell"]), view)


NO_SUCH_USER_REGISTER = Message("mic488.no-such-user-register", "user register {number} as {format} is outside 0 to {last}")
ODD_REGISTER = Message("mic488.odd-register", "user register {number} as {format}: {format}s begin at even registers")


def user_item(registers: RegisterMap, number: int, view: UserFormat, count: int = 1) -> RegisterItem:
    """User register ``number`` as ``view``. Raises `Misuse` unless ``count`` values from there on are user registers."""
    register = registers.of("USER_REGISTER")
    last = register.cells - view.size * count
    if not 0 <= number <= last:
        raise Misuse(
            NO_SUCH_USER_REGISTER(number=number, format=view.name if count == 1 else f"{view.name} × {count}", last=last)
        )
    if view.size == 2 and number % 2:
        raise Misuse(ODD_REGISTER(number=number, format=view.name))
    return RegisterItem(register, number, view)


NUMBER_OR_NAME = Message("mic488.number-or-name", "{problem}, or {names}")


def value_of(register: Register, typed: str) -> float:
    """Value of a typed text: a number, that of a word also hexadecimal, ``on``, or the name of a value. Raises `Misuse`."""
    text = typed.strip()
    for number, name in register.values.items():
        if text.lower() == name.lower():
            return number
    if register.type is Type.BIT and text.lower() in _SWITCHES:
        return _SWITCHES[text.lower()]
    try:
        return read_number(text, or_hexadecimal=register.type in (Type.WORD, Type.MEMORY))
    except Misuse as error:
        names = ("on", "off") if register.type is Type.BIT else tuple(register.values.values())
        raise (Misuse(NUMBER_OR_NAME(problem=text_of(error), names=list(names))) if names else error) from None


# ---------------------------------------------------------------------- values and words


def decoded(item: RegisterItem, words: Sequence[int], data_type: DataType) -> RegisterValue:
    """The value in its words (or its bit)."""
    kind = _kind(item, data_type)
    if kind is Type.BIT:
        return bool(words[0])
    if kind is Type.REAL:
        return words_to_real(words[0], words[1])
    if kind is Type.DINT:
        return words_to_dint(words[0], words[1])
    return word_to_int(words[0]) if item.view is UserFormat.INT else words[0]


def _kind(item: RegisterItem, data_type: DataType) -> Type:
    kind = item.register.type
    if kind is Type.VALUE:
        return Type.DINT if data_type is DataType.DINT else Type.REAL
    if kind is Type.MEMORY:
        return {UserFormat.DINT: Type.DINT, UserFormat.REAL: Type.REAL}.get(item.view, Type.WORD)
    return kind


CAN_ONLY_BE_READ = Message("mic488.can-only-be-read", "{name} can only be read")
WRONG_SWITCH_VALUE = Message("mic488.wrong-switch-value", "{name} = {value}: permitted are 0 (OFF) and 1 (ON)")


def encoded(
    item: RegisterItem, value: RegisterValue, data_type: DataType, unit: str = "u", permitted: ValueRange | None = None
) -> pdu.ModbusRequest:
    """The request that writes ``value``, which is in units with DATA_TYPE REAL and in pulses with DINT. ``permitted``: what is
    permitted where the gear of its axis is known.

    Raises `Misuse` when the register cannot be written or does not take the value.
    """
    register = item.register
    if not register.accepts:
        raise Misuse(CAN_ONLY_BE_READ(name=register.name))
    if register.type is Type.BIT:
        if value not in (0, 1):
            raise Misuse(WRONG_SWITCH_VALUE(name=register.name, value=value))
        return pdu.WriteCoilRequest(register.address, bool(value))
    words = encoded_words(item, value, data_type, unit, permitted)
    if len(words) == 1:
        return pdu.WriteRegisterRequest(item.address, words[0])
    return pdu.WriteRegistersRequest(item.address, words)


WHOLE_NUMBER_IS_NEEDED = Message("mic488.whole-number-is-needed", "{what}: a whole number is needed")
VALUE_NOT_PERMITTED = Message("mic488.value-not-permitted", "{what}: permitted {permitted}")


def encoded_words(
    item: RegisterItem, value: RegisterValue, data_type: DataType, unit: str = "u", permitted: ValueRange | None = None
) -> tuple[int, ...]:
    """The words of ``value`` in a holding register, as of `encoded`. Raises `Misuse` for a value that it does not take."""
    register = item.register
    kind = _kind(item, data_type)
    if kind is not Type.REAL and not (isfinite(value) and value == int(value)):
        raise Misuse(WHOLE_NUMBER_IS_NEEDED(what=_format(item, value, data_type, unit)))
    expected = ""
    permitted = permitted or register.permitted
    if register.type is Type.MEMORY:
        if item.view is UserFormat.INT and -0x8000 <= value <= 0x7FFF:
            return (int(value) & 0xFFFF,)
        if item.view in (UserFormat.INT, UserFormat.WORD) and (item.view is UserFormat.INT or not 0 <= value <= 0xFFFF):
            expected = item.view.range
    elif value not in permitted or (kind is Type.REAL and words_to_real(*real_to_words(value)) not in permitted):
        expected = f"{permitted} {register.unit(data_type, unit)}".rstrip()
    if expected:
        raise Misuse(VALUE_NOT_PERMITTED(what=_format(item, value, data_type, unit), permitted=expected))
    if kind is Type.REAL:
        return real_to_words(value)
    return dint_to_words(int(value)) if kind is Type.DINT else (int(value),)


def _format(item: RegisterItem, value: RegisterValue, data_type: DataType, unit: str) -> str:
    return f"{item.name} = {value:.12g} {item.register.unit(data_type, unit)}".rstrip()


# ---------------------------------------------------------------------- reading with few frames


class Block(NamedTuple):
    """One read and the values in it, each with its place."""

    request: pdu.ReadRequest
    items: tuple[tuple[RegisterItem, int], ...]

    def values(self, words: Sequence[int], data_type: DataType) -> dict[RegisterItem, RegisterValue]:
        return {item: decoded(item, words[place : place + item.size], data_type) for item, place in self.items}


CAN_ONLY_BE_WRITTEN = Message("mic488.can-only-be-written", "{name} can only be written")


def plan(registers: RegisterMap, items: Iterable[RegisterItem]) -> list[Block]:
    """The fewest reads that give all values, over what may be read only (MIC-3). Raises `Misuse` for what cannot be read."""
    blocks: list[Block] = []
    group: list[RegisterItem] = []
    for item in sorted(set(items)):
        if not item.register.reads:
            raise Misuse(CAN_ONLY_BE_WRITTEN(name=item.register.name))
        if group and not _joins(registers, group, item):
            blocks.append(_block(group))
            group = []
        group.append(item)
    if group:
        blocks.append(_block(group))
    return blocks


def _joins(registers: RegisterMap, group: list[RegisterItem], item: RegisterItem) -> bool:
    space = item.register.space
    start, end = group[0].address, max(member.address + member.size for member in group)
    if group[0].register.space is not space or item.address + item.size - start > _MOST[space]:
        return False
    gap = item.address - end
    between = registers.slices(space, end, gap)
    return gap <= BRIDGE[space] and all(p.whole and p.register is not None and p.register.reads for p in between)


def _block(group: list[RegisterItem]) -> Block:
    start, end = group[0].address, max(member.address + member.size for member in group)
    request = pdu.ReadRequest(_READS[group[0].register.space], start, end - start)
    return Block(request, tuple((item, item.address - start) for item in group))


# ---------------------------------------------------------------------- repeating


def repeatable(registers: RegisterMap, request: pdu.ModbusRequest) -> bool:
    """Whether a request whose answer was lost may be sent again: only where that cannot move anything twice."""
    if isinstance(request, pdu.ReadRequest):
        return True
    return all(register is not None and _repeatable(register, value) for register, value in _written(registers, request))


def moves(registers: RegisterMap, request: pdu.ModbusRequest) -> bool:
    """Whether a request may start a motion, as far as it can be decoded."""
    if isinstance(request, pdu.ReadRequest) or halted(registers, request):
        return False
    return any(_may_move(register) for register, _ in _written(registers, request))


def given_motions(registers: RegisterMap, request: pdu.ModbusRequest) -> tuple[int, ...]:
    """The axes to whose own registers a request writes a motion, as far as it can be decoded."""
    if isinstance(request, pdu.ReadRequest):
        return ()
    written = [register for register, value in _written(registers, request) if register and not _ended(register, value)]
    return tuple(sorted({one.axis for one in written if one.axis is not None and _may_move(one)}))


def starts_program(registers: RegisterMap, request: pdu.ModbusRequest) -> bool:
    """Whether a request may start the program, as far as it can be decoded."""
    if isinstance(request, pdu.ReadRequest) or halted(registers, request):
        return False
    return any(register is None or register.key == "PROGRAM_CTRL" for register, _ in _written(registers, request))


def halted(registers: RegisterMap, request: pdu.ModbusRequest) -> tuple[int, ...]:
    """Motions that a write ends: axes by a stop or the end of a jog, `PROGRAM` by its stop or pause. Nothing where it may begin a
    motion as well."""
    if isinstance(request, pdu.ReadRequest):
        return ()
    found: set[int] = set()
    for register, value in _written(registers, request):
        ended = () if register is None else _ended(register, value)
        if not ended and _may_move(register):
            return ()
        found.update(ended)
    return tuple(sorted(found))


def _ended(register: Register, value: int) -> tuple[int, ...]:
    match register.key:
        case "M_STOP":
            return axes_of_mask(value)
        case "PROGRAM_CTRL":
            return () if value == ProgramState.RUNNING else (PROGRAM,)
        case "STOP" | "JOG_PLUS" | "JOG_MINUS" if register.axis is not None:
            return (register.axis,) if bool(value) is (register.key == "STOP") else ()
        case _:
            return ()


def _may_move(register: Register | None) -> bool:
    return register is None or register.effect in (WriteEffect.MOVE, WriteEffect.ADD)


def _written(
    registers: RegisterMap, request: pdu.WriteCoilRequest | pdu.WriteRegisterRequest | pdu.WriteRegistersRequest
) -> list[tuple[Register | None, int]]:
    """The registers of a write, each with its first word; None for an address without one."""
    match request:
        case pdu.WriteCoilRequest(address, on):
            return [(registers.find(Space.COIL, address), on)]
        case pdu.WriteRegisterRequest(address, value):
            return [(registers.find(Space.HOLDING, address), value)]
        case pdu.WriteRegistersRequest(address, values):
            slices = registers.slices(Space.HOLDING, address, len(values))
            return [(one.register, values[one.address - address]) for one in slices]


def _repeatable(register: Register, value: int) -> bool:
    # A homing that has ended already would be done again: the same goal, but a second motion. Starting and pausing the program
    # depends on what happened meanwhile, stopping it does not.
    return (
        register.effect in (WriteEffect.STORE, WriteEffect.ACT)
        or (register.effect is WriteEffect.MOVE and register.key != "HOME")
        or (register.key == "PROGRAM_CTRL" and value == ProgramState.STOPPED)
    )
