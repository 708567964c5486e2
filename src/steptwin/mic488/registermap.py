"""Registers, and a register map that checks itself when built and never changes afterwards.

A map is a pure description: no device state, no values. `steptwin.mic488.registers` holds the rows.
Addresses are the ones on the wire (counted from 0) in their `Space`. A ``size`` is the number of addresses one value takes.
"""

from __future__ import annotations

import enum
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple, Self

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, WORD_MAX
from steptwin.mic488.ranges import FINITE, ValueRange
from steptwin.nearmiss import alike
from steptwin.wire import pdu

LAST_ADDRESS = 0xFFFF


class Space(enum.Enum):
    """The address spaces of Modbus the device uses; each function works on one of them."""

    COIL = "coil"
    INPUT = "input"
    HOLDING = "holding register"


FUNCTION_SPACES: Mapping[int, Space] = MappingProxyType(
    {
        pdu.READ_COILS: Space.COIL,
        pdu.READ_DISCRETE_INPUTS: Space.INPUT,
        pdu.READ_HOLDING_REGISTERS: Space.HOLDING,
        pdu.WRITE_SINGLE_COIL: Space.COIL,
        pdu.WRITE_SINGLE_REGISTER: Space.HOLDING,
        pdu.WRITE_MULTIPLE_REGISTERS: Space.HOLDING,
    }
)
"""Function codes the device implements (manual section 2), with the space each works on."""


class DataType(enum.IntEnum):
    """Value of the DATA_TYPE register: the format of REAL/DINT registers (manual 4.9 / 4.10)."""

    REAL = 0
    DINT = 1


class Type(enum.Enum):
    """The format of a value in its registers; 32-bit values take two, low word first."""

    BIT = "BIT"
    WORD = "WORD"
    DINT = "DINT"
    REAL = "REAL"
    VALUE = "REAL/DINT"
    """REAL in configured units or DINT in pulses, depending on DATA_TYPE."""
    MEMORY = "WORD/DINT/REAL"
    """Plain 16-bit memory; the master may keep DINT or REAL in two neighbours from an even address."""

    @property
    def size(self) -> int:
        """Number of addresses one value takes."""
        return 2 if self in (Type.DINT, Type.REAL, Type.VALUE) else 1

    def layout(self, data_type: DataType) -> str:
        """Format character of `struct` for one value of a holding register."""
        if self.size == 1:
            return "H"
        return "i" if self is Type.DINT or (self is Type.VALUE and data_type is DataType.DINT) else "f"


class QuantityKind(enum.Enum):
    """The kind of quantity of a value, from which its unit follows."""

    SWITCH = "switch"
    POSITION = "position"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    ENCODER = "encoder counts"
    MASK = "axis mask"
    ENUMERATION = "enumeration"
    NUMBER = "number"


_UNIT_ENDS = {QuantityKind.POSITION: "", QuantityKind.VELOCITY: "/s", QuantityKind.ACCELERATION: "/s²"}


class WriteEffect(enum.Enum):
    """The effect of a write, from which that of a repetition follows."""

    NONE = "read only"
    STORE = "stores"
    """Keeps the value; writing it again changes nothing."""
    ACT = "acts"
    """Acts at once, to the same end when repeated."""
    MOVE = "moves"
    """Gives an axis a motion, or arms it for its trigger; the same goal when repeated."""
    ADD = "adds"
    """Adds to the present value or starts what may be started once: repeating it does it again."""


class Per(enum.Enum):
    """The objects of which each has a copy of the row."""

    DEVICE = "device"
    AXIS = "axis"
    CHANNEL = "channel"


_TYPE_RANGES = {
    Type.BIT: ValueRange(0, 1),
    Type.WORD: ValueRange(0, WORD_MAX),
    Type.MEMORY: ValueRange(0, WORD_MAX),
    Type.DINT: ValueRange(DINT_MIN, DINT_MAX),
    Type.REAL: FINITE,
    Type.VALUE: FINITE,
}


@dataclass(frozen=True, slots=True)
class Firmware:
    """A firmware generation as data."""

    name: str
    manual: str
    """Version of the manual that lists its addresses."""
    control_base: int
    """Address of the first control register (DATA_TYPE)."""
    user_registers: int
    stored_user_registers: range | None
    """User registers with a non-volatile copy, None when there is none."""
    banks: int
    """Program banks and position banks selectable (MIC-28)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapRow:
    """One line of the table: a register, or its copies for each axis or channel.

    ``reads`` and ``writes`` are the function codes the manual lists; what is accepted beyond it is in `Register.accepts`.
    ``{n}`` in name and meaning is the number of the copy, from 1. ``address`` counts from the control base when ``control``.
    """

    name: str
    """``M{n}_STOP``, with the number of axis or channel."""
    space: Space
    address: int
    type: Type
    reads: tuple[int, ...]
    writes: tuple[int, ...]
    kind: QuantityKind
    effect: WriteEffect
    meaning: str
    sections: Mapping[str, str]
    """Manual version -> sections."""
    control: bool = False
    per: Per = Per.DEVICE
    copies: int = 1
    step: int = 1
    """Distance of the copies in addresses."""
    cells: int | Callable[[Firmware], int] = 1
    """Values behind one name; a function where the firmware gives their number (ranged rows)."""
    permitted: ValueRange | Mapping[str, ValueRange] | None = None
    """Permitted written values; by firmware name where they differ; None: whatever the type holds."""
    values: Mapping[int, str] = field(default_factory=dict)
    """Texts of enumerated values."""
    firmwares: tuple[str, ...] | None = None
    """Firmwares that have it; None: all."""
    word_write: bool = False
    """A 32-bit register whose first address also takes function 06: a signed 16-bit number in the same unit (MIC-6)."""
    aliases: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Its name without numbers, the same for all axes and firmwares: ``STOP``."""
        return self.name.removeprefix("M{n}_").replace("{n}", "")


@dataclass(frozen=True, slots=True)
class Register:
    """A register (or a range of them under one name) of one firmware at its place."""

    key: str
    """Stable name of the row, the same for all axes and firmwares (``POS_ACT``)."""
    index: int | None
    """Number of axis, channel, from 1; None for what exists once."""
    name: str
    space: Space
    address: int
    type: Type
    cells: int
    reads: tuple[int, ...]
    """Function codes that read it, as the manual lists them."""
    writes: tuple[int, ...]
    """Function codes that write it, as the manual lists them."""
    accepts: tuple[int, ...]
    """Function codes that are accepted for a write (MIC-4, MIC-5, MIC-6)."""
    kind: QuantityKind
    effect: WriteEffect
    permitted: ValueRange
    values: Mapping[int, str]
    meaning: str
    section: str
    per: Per
    word_write: bool
    aliases: tuple[str, ...]

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        """Immutable: snapshots of a device share it."""
        return self

    @property
    def axis(self) -> int | None:
        """Axis 1–4 the register belongs to, None when it belongs to the device."""
        return self.index if self.per is Per.AXIS else None

    @property
    def span(self) -> int:
        """Number of addresses the register (all its cells) takes."""
        return self.type.size * self.cells

    @property
    def last(self) -> int:
        """Its last address."""
        return self.address + self.span - 1

    def permits(self, value: float) -> bool:
        """Whether ``value`` may be written; otherwise exception 03 and nothing changes (MIC-7)."""
        return value in self.permitted

    def unit(self, data_type: DataType = DataType.REAL, unit: str = "u") -> str:
        """Unit of the value: ``u``, ``u/s``, ``u/s²`` with the axis' configured unit for ``u``; ``imp…`` in DINT; else empty."""
        if self.kind is QuantityKind.ENCODER:
            return "imp"
        if self.kind not in _UNIT_ENDS:
            return ""
        pulses = self.type is Type.DINT or (self.type is Type.VALUE and data_type is DataType.DINT)
        return ("imp" if pulses else unit) + _UNIT_ENDS[self.kind]


class RegisterSlice(NamedTuple):
    """The part of a request that falls on one register, or on a hole (register None)."""

    register: Register | None
    address: int
    size: int

    @property
    def whole(self) -> bool:
        """Whether only whole values are touched; half of a 32-bit register is refused (MIC-5)."""
        if self.register is None:
            return False
        size = self.register.type.size
        return (self.address - self.register.address) % size == 0 and self.size % size == 0


class RegisterMapError(Misuse):
    """A row of the table contradicts itself or another row; the text names rows and addresses."""


class UnknownRegister(Misuse):
    """No register of that name or at that address in this firmware."""


def show_address(address: int) -> str:
    """An address in decimal and hexadecimal: ``10020 (0x2724)``."""
    return f"{address} ({'-' if address < 0 else ''}0x{abs(address):04X})"


NEAR_NAMES = Message("mic488.near-names", "; did you mean {names}?")
WITH_NUMBER = Message("mic488.with-number", " with number {index}")
REGISTER_AT = Message("mic488.register-at", "{name} at {place}")
UNKNOWN_REGISTER = Message("mic488.unknown-register", "firmware {firmware} has no register named {name!r}{hint}")
UNKNOWN_KEY = Message("mic488.unknown-key", "firmware {firmware} has no register with key {key!r}{number}")
NO_REGISTER_HERE = Message("mic488.no-register-here", "firmware {firmware} has no {space} at {address}; nearest: {near}")


class RegisterMap:
    """The registers of one firmware, ordered by space and address. Checked when built, then frozen.

    Raises `RegisterMapError` for an address outside 0–65535, an overlap, a duplicate name or key, functions of another space.
    """

    __slots__ = ("_keys", "_names", "_spaces", "_starts", "firmware", "registers", "rows")

    firmware: Firmware
    rows: tuple[MapRow, ...]
    """The rows this firmware has."""
    registers: tuple[Register, ...]
    _names: Mapping[str, Register]
    _keys: Mapping[tuple[str, int | None], Register]
    _spaces: Mapping[Space, tuple[Register, ...]]
    _starts: Mapping[Space, tuple[int, ...]]

    def __init__(self, firmware: Firmware, rows: Iterable[MapRow]) -> None:
        known = tuple(row for row in rows if row.firmwares is None or firmware.name in row.firmwares)
        placed = [register for row in known for register in _place(row, firmware)]
        order = list(Space)
        placed.sort(key=lambda r: (order.index(r.space), r.address))
        spaces = {space: tuple(r for r in placed if r.space is space) for space in Space}
        for members in spaces.values():
            _check_overlap(members)
        freeze = object.__setattr__
        freeze(self, "firmware", firmware)
        freeze(self, "rows", known)
        freeze(self, "registers", tuple(placed))
        freeze(self, "_names", MappingProxyType(_by_name(placed)))
        freeze(self, "_keys", MappingProxyType(_by_key(placed)))
        freeze(self, "_spaces", MappingProxyType(spaces))
        freeze(self, "_starts", MappingProxyType({s: tuple(r.address for r in members) for s, members in spaces.items()}))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"the register map of firmware {self.firmware.name} is frozen; {name} cannot be set")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"the register map of firmware {self.firmware.name} is frozen; {name} cannot be deleted")

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        """Immutable: snapshots of a device share it."""
        return self

    def __iter__(self) -> Iterator[Register]:
        return iter(self.registers)

    def __len__(self) -> int:
        return len(self.registers)

    def __repr__(self) -> str:
        return f"<RegisterMap of firmware {self.firmware.name}: {len(self.registers)} registers>"

    def named(self, name: str) -> Register:
        """The register of that name or alias, in either case. Raises `UnknownRegister` with near misses."""
        found = self._names.get(name.upper())
        if found is not None:
            return found
        near = alike(name.upper(), self._names)
        hint = NEAR_NAMES(names=near) if near else ""
        raise UnknownRegister(UNKNOWN_REGISTER(firmware=self.firmware.name, name=name, hint=hint))

    def of(self, key: str, index: int | None = None) -> Register:
        """The register of a row key and axis or channel number (from 1). Raises `UnknownRegister`."""
        found = self._keys.get((key, index))
        if found is None:
            number = "" if index is None else WITH_NUMBER(index=index)
            raise UnknownRegister(UNKNOWN_KEY(firmware=self.firmware.name, key=key, number=number))
        return found

    def find(self, space: Space, address: int) -> Register | None:
        """The register that covers ``address`` in ``space``, None in a hole."""
        index = bisect_right(self._starts[space], address) - 1
        if index < 0:
            return None
        register = self._spaces[space][index]
        return register if address <= register.last else None

    def at(self, space: Space, address: int) -> Register:
        """As `find`, but a hole raises `UnknownRegister` with the neighbours."""
        found = self.find(space, address)
        if found is not None:
            return found
        index = bisect_right(self._starts[space], address)
        members = self._spaces[space]
        near = [REGISTER_AT(name=r.name, place=_extent(r)) for r in members[max(index - 1, 0) : index + 1]]
        raise UnknownRegister(
            NO_REGISTER_HERE(firmware=self.firmware.name, space=space.value, address=show_address(address), near=near)
        )

    def slices(self, space: Space, address: int, quantity: int) -> Iterator[RegisterSlice]:
        """Cut the addresses of a request at register borders, in order; a hole is one slice."""
        end = address + quantity
        while address < end:
            register = self.find(space, address)
            if register is not None:
                stop = min(end, register.last + 1)
            else:
                index = bisect_right(self._starts[space], address)
                starts = self._starts[space]
                stop = min(end, starts[index]) if index < len(starts) else end
            yield RegisterSlice(register, address, stop - address)
            address = stop


def _place(row: MapRow, firmware: Firmware) -> Iterator[Register]:
    _check_row(row, firmware)
    base = row.address + (firmware.control_base if row.control else 0)
    cells = row.cells if isinstance(row.cells, int) else row.cells(firmware)
    permitted = row.permitted[firmware.name] if isinstance(row.permitted, Mapping) else row.permitted
    for copy in range(row.copies):
        number = None if row.per is Per.DEVICE else copy + 1
        register = Register(
            key=row.key,
            index=number,
            name=row.name.format(n=number),
            space=row.space,
            address=base + copy * row.step,
            type=row.type,
            cells=cells,
            reads=row.reads,
            writes=row.writes,
            accepts=_accepted_writes(row),
            kind=row.kind,
            effect=row.effect,
            permitted=_TYPE_RANGES[row.type] if permitted is None else permitted,
            values=MappingProxyType(dict(row.values)),
            meaning=row.meaning.format(n=number),
            section=row.sections[firmware.manual],
            per=row.per,
            word_write=row.word_write,
            aliases=tuple(alias.format(n=number) for alias in row.aliases),
        )
        if register.address < 0 or register.last > LAST_ADDRESS:
            raise RegisterMapError(
                f"firmware {firmware.name}: {register.name} at {_extent(register)} is outside 0…{show_address(LAST_ADDRESS)}"
            )
        yield register


def _accepted_writes(row: MapRow) -> tuple[int, ...]:
    """MIC-4: function 16 also writes WORDs. MIC-5: function 06 would be half of a 32-bit value, but MIC-6 allows it once."""
    if not row.writes or row.space is not Space.HOLDING:
        return row.writes
    return (6, 16) if row.type.size == 1 or row.word_write else (16,)


def _check_row(row: MapRow, firmware: Firmware) -> None:
    where = f"firmware {firmware.name}: {row.name}"
    for function in row.reads + row.writes:
        if FUNCTION_SPACES.get(function) is not row.space:
            raise RegisterMapError(f"{where} is a {row.space.value}, function {pdu.function_number(function)} does not reach it")
    wrong = [f for f in row.reads if f not in pdu.READS] + [f for f in row.writes if f in pdu.READS]
    if wrong:
        raise RegisterMapError(f"{where} lists function {pdu.function_number(wrong[0])} on the wrong side of read and write")
    if bool(row.writes) is (row.effect is WriteEffect.NONE):
        raise RegisterMapError(f"{where} has the effect '{row.effect.value}' but write functions {row.writes}")
    if (row.type is Type.BIT) is (row.space is Space.HOLDING):
        raise RegisterMapError(f"{where} is a {row.space.value} of type {row.type.value}")
    if (row.per is Per.DEVICE) is not (row.copies == 1) or row.copies < 1:
        raise RegisterMapError(f"{where} has {row.copies} copies per {row.per.value}")


def _check_overlap(members: tuple[Register, ...]) -> None:
    for before, after in pairwise(members):
        if after.address <= before.last:
            raise RegisterMapError(
                f"{after.name} at {_extent(after)} overlaps {before.name} at {_extent(before)} among the {after.space.value}s"
            )


def _by_name(registers: Iterable[Register]) -> dict[str, Register]:
    names: dict[str, Register] = {}
    for register in registers:
        for name in (register.name, *register.aliases):
            other = names.setdefault(name.upper(), register)
            if other is not register:
                raise RegisterMapError(f"the name {name} is given to {_extent(other)} and to {_extent(register)}")
    return names


def _by_key(registers: Iterable[Register]) -> dict[tuple[str, int | None], Register]:
    keys: dict[tuple[str, int | None], Register] = {}
    for register in registers:
        other = keys.setdefault((register.key, register.index), register)
        if other is not register:
            raise RegisterMapError(
                f"the key {register.key} is given to {other.name} at {_extent(other)}"
                f" and to {register.name} at {_extent(register)}"
            )
    return keys


def _extent(register: Register) -> str:
    first = show_address(register.address)
    return first if register.span == 1 else f"{first}…{show_address(register.last)}"
