"""The points of a MIC488: its registers, and short names of common values. Values are in configured units, independent of
DATA_TYPE."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.datasheet import Access, Condition, Limits, Point, PointAddress, PointEffect
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488 import registermap
from steptwin.mic488.axis import Axis
from steptwin.mic488.behaviour import BEHAVIOUR
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoding import DINT_MIN, word_to_int, words_to_dint, words_to_real
from steptwin.mic488.ranges import ValueRange
from steptwin.mic488.registermap import QuantityKind, Register, RegisterMap, Space, Type, UnknownRegister
from steptwin.mic488.registers import AXES, CONTROLLER_STATUS_TEXTS
from steptwin.mic488.status import AXIS_CONDITIONS, CONTROLLER_CONDITIONS
from steptwin.mic488.values import RegisterItem, UserFormat, named
from steptwin.motion import Profile
from steptwin.points import LivePoint, MemoryCells, TurningPoints, end_of, turning_points_of, turning_points_of_round
from steptwin.tables import complete

EFFECTS: Mapping[registermap.WriteEffect, PointEffect] = complete(
    "effect of a register",
    registermap.WriteEffect,
    "effect in a data sheet",
    {
        registermap.WriteEffect.NONE: PointEffect.NONE,
        registermap.WriteEffect.STORE: PointEffect.PARAMETER,
        registermap.WriteEffect.ACT: PointEffect.ACTS,
        registermap.WriteEffect.MOVE: PointEffect.MOVES,
        registermap.WriteEffect.ADD: PointEffect.MOVES,
    },
)
SPACES: Mapping[str, Space] = {"hr": Space.HOLDING, "co": Space.COIL, "di": Space.INPUT}
"""Prefixes of addresses: ``hr:10020``, ``di:5006``."""
_ADDRESS = re.compile(r"(?P<space>[a-z]+):(?P<address>\d{1,5})(?::(?P<view>\w+))?", re.IGNORECASE | re.ASCII)


# ---------------------------------------------------------------------- short names


class ShortName(NamedTuple):
    """A value of the controller or of each axis, and the key of the register that shows it."""

    name: str
    key: str
    meaning: str = ""
    read: Callable[[Any, Nanos], float] | None = None
    """The function that reads it; needed if some firmware has no readable register for it."""
    conditions: Mapping[int, Condition] = MappingProxyType({})
    kind: QuantityKind = QuantityKind.NUMBER
    """Kind of a value that no register of the firmware shows."""
    values: Mapping[int, str] = MappingProxyType({})
    """Its texts."""


SHORT_NAMES = (
    ShortName(
        "status",
        "M_STATUS",
        "Status of the controller.",
        lambda device, now: device.status(),
        CONTROLLER_CONDITIONS,
        QuantityKind.ENUMERATION,
        CONTROLLER_STATUS_TEXTS,
    ),
    ShortName("program", "PROGRAM_CTRL", "State of the program."),
)
AXIS_SHORT_NAMES = (
    ShortName("status", "STATUS", conditions=AXIS_CONDITIONS),
    ShortName("enabled", "EN", "Whether the drive is switched on.", lambda axis, now: axis.enabled),
    ShortName(
        "moving",
        "",
        "Whether a motion is being made.",
        lambda axis, now: axis.profile.moving(now),
        kind=QuantityKind.SWITCH,
    ),
    ShortName("position", "POS_ACT", "Counted position."),
    ShortName("velocity", "VEL_ACT"),
    ShortName("encoder", "ENC_IMP"),
)


# ---------------------------------------------------------------------- descriptions


def points(registers: RegisterMap, units: Sequence[str]) -> Iterator[Point]:
    """All points; ``units`` are those of the axes."""
    for short in SHORT_NAMES:
        yield _short(registers, units, short, None)
    for axis in range(1, len(units) + 1):
        for short in AXIS_SHORT_NAMES:
            yield _short(registers, units, short, axis)
    for register in registers:
        yield _point(register, units)


def _short(registers: RegisterMap, units: Sequence[str], short: ShortName, axis: int | None) -> Point:
    path = short.name if axis is None else f"M{axis}.{short.name}"
    try:
        register = registers.of(short.key, axis)
    except UnknownRegister:
        # No register of this firmware shows it, but WBC programs and mechanics do.
        return Point(
            path=path,
            meaning=short.meaning,
            type=short.kind.value,
            values=short.values,
            conditions=short.conditions,
            access=Access.READ,
            effect=PointEffect.NONE,
            source="",
        )
    found = _point(register, units)
    return replace(
        found,
        path=path,
        meaning=short.meaning or found.meaning,
        conditions=short.conditions,
        access=Access.READ,
        effect=PointEffect.NONE,
        limits=None,
        addresses=found.addresses if register.reads else (),
    )


def _point(register: Register, units: Sequence[str]) -> Point:
    return Point(
        path=register.name,
        meaning=register.meaning,
        type=register.kind.value,
        unit=unit_of(register, units),
        limits=limits(register.permitted) if register.accepts else None,
        values=register.values,
        access=Access.BOTH if register.reads and register.accepts else Access.WRITE if register.accepts else Access.READ,
        effect=EFFECTS[register.effect],
        addresses=(
            PointAddress(space=register.space.value, place=register.address, words=register.span, type=register.type.value),
        ),
        source=register.section,
    )


def unit_of(register: Register, units: Sequence[str]) -> str:
    return register.unit(unit="u" if register.axis is None else units[register.axis - 1])


def limits(permitted: ValueRange) -> Limits:
    return Limits(permitted.low, permitted.high, permitted.above)


# ---------------------------------------------------------------------- values


def live_point(device: Mic488Device, text: str) -> LivePoint | None:
    """The point of a name (``M1.position``, ``M1_ACC``, ``USER_REGISTER[12]:real``) or address (``hr:10020``), else None.
    Raises `Misuse` for what is not a whole value."""
    registers, units = device.registers, [axis.unit_name for axis in device.config.axes]
    short = _short_name(text)
    if short is not None:
        row, number = short
        point = _short(registers, units, row, number)
        owner = device if number is None else device.axes[number - 1]
        return _live(point, owner, row.key or row.name, row.read or BEHAVIOUR[row.key].read)
    item = item_of(registers, text)
    if item is None:
        return None
    register = item.register
    point = _point(register, units)
    if register.type is Type.MEMORY:
        address = replace(point.addresses[0], place=item.address, words=item.size, type=item.view.name)
        point = replace(point, path=item.name, addresses=(address,))
        memory = _user_words(device, item)
        return LivePoint(point=point, read=memory.read, is_kept=True, memory=memory)
    behaviour = BEHAVIOUR[register.key]
    if not register.reads:
        return LivePoint(point=point, read=None)
    if register.type is Type.BIT:
        return LivePoint(point=point, read=_bit(device, behaviour.read((register.index or 1) - 1)))
    owner = device if register.axis is None else device.axes[register.axis - 1]
    return _live(point, owner, register.key, behaviour.read, is_kept=behaviour.quiet)


def marks(device: Mic488Device) -> tuple[object, ...]:
    """See `steptwin.simulation.kinds.kind.ControllerKind.marks`: one for all points."""
    program, (m1, m2, m3, m4) = device.program, device.axes
    # Written out, because it is asked for after each event.
    mark = (
        program.state, program.error, device.master_error,
        m1.status, m1.enabled, m1.limit_l_p, m1.limit_r_p,
        m2.status, m2.enabled, m2.limit_l_p, m2.limit_r_p,
        m3.status, m3.enabled, m3.limit_l_p, m3.limit_r_p,
        m4.status, m4.enabled, m4.limit_l_p, m4.limit_r_p,
        *device.triggered.values(),
    )  # fmt: skip
    return (mark,)


_OF_DEVICE = {short.name: short for short in SHORT_NAMES}
_OF_AXES = {f"m{number}.{short.name}": (short, number) for number in range(1, AXES + 1) for short in AXIS_SHORT_NAMES}


def _short_name(text: str) -> tuple[ShortName, int | None] | None:
    name = text.lower()
    of_device = _OF_DEVICE.get(name)
    return _OF_AXES.get(name) if of_device is None else (of_device, None)


UNKNOWN_ADDRESS_SPACE = Message("mic488.unknown-address-space", "{text!r}: addresses begin with {names}")
TYPE_IS_FIXED = Message("mic488.type-is-fixed", "{text!r}: {name} is of type {type}; leave out :{format}")
SECOND_WORD = Message("mic488.second-word", "{text!r}: this is the second word of {name}, which is at {address}")


def item_of(registers: RegisterMap, text: str) -> RegisterItem | None:
    """The register or part of one with this name or address; None if there is none. Raises `Misuse` for what is not a whole
    value."""
    match = _ADDRESS.fullmatch(text)
    if match is None:
        if "." in text:
            return None
        try:
            return named(registers, text)
        except UnknownRegister:
            return None
    space, address = SPACES.get(match["space"].lower()), int(match["address"])
    if space is None:
        raise Misuse(UNKNOWN_ADDRESS_SPACE(text=text, names=[f"{name}:" for name in SPACES]))
    register = registers.at(space, address)
    if register.type is Type.MEMORY:
        return named(registers, f"{register.name}[{address - register.address}]:{match['view'] or UserFormat.WORD.value}")
    if match["view"] is not None:
        raise Misuse(TYPE_IS_FIXED(text=text, name=register.name, type=register.type.value, format=match["view"]))
    if address != register.address:
        raise Misuse(SECOND_WORD(text=text, name=register.name, address=register.address))
    return RegisterItem(register)


def _live(point: Point, owner: Any, key: str, read: Callable[[Any, Nanos], float], *, is_kept: bool = False) -> LivePoint:
    follows = _FOLLOWING.get(key)
    if follows is None:
        return LivePoint(point=point, read=partial(read, owner), is_kept=is_kept)
    turning_points, has_version = follows(owner)
    if not has_version:
        return LivePoint(point=point, read=partial(read, owner), turning_points=turning_points)

    def freeze(now: Nanos) -> Callable[[Nanos], float]:
        return partial(read, _AxisTrajectory(owner.profile, owner.offset_p, owner.gear))

    return LivePoint(
        point=point, read=partial(read, owner), turning_points=turning_points, version=partial(_version, owner), freeze=freeze
    )


def _bit(device: Mic488Device, read: Callable[[Mic488Device], bool]) -> Callable[[Nanos], float]:
    return lambda now: read(device)


_MEANINGS: Mapping[UserFormat, Callable[[Sequence[int]], float]] = complete(
    "format of user registers",
    UserFormat,
    "meaning of words",
    {
        UserFormat.WORD: lambda words: words[0],
        UserFormat.INT: lambda words: word_to_int(words[0]),
        UserFormat.DINT: lambda words: words_to_dint(words[0], words[1]),
        UserFormat.REAL: lambda words: words_to_real(words[0], words[1]),
    },
)


def _user_words(device: Mic488Device, item: RegisterItem) -> MemoryCells:
    cells = range(item.cell, item.cell + item.size)
    return MemoryCells(words=lambda: device.user, cells=cells, value=_MEANINGS[item.view])


# ---------------------------------------------------------------------- between events


class _AxisTrajectory(NamedTuple):
    """All that points with a version read of an axis."""

    profile: Profile
    offset_p: int
    gear: float


def _profile(axis: Axis) -> Profile:
    return axis.profile


def _version(axis: Axis) -> object:
    return axis.revision, axis.offset_p


def _as_profile(axis: Axis) -> tuple[TurningPoints, bool]:
    return turning_points_of(partial(_profile, axis)), True


def _as_moving(axis: Axis) -> tuple[TurningPoints, bool]:
    return end_of(partial(_profile, axis)), True


def _as_coordinate(axis: Axis) -> tuple[TurningPoints, bool]:
    """A DINT of pulses (MIC-42)."""
    return turning_points_of_round(
        partial(_profile, axis), lambda now: axis.profile.count(now) + axis.offset_p - DINT_MIN, 2**32
    ), True


def _as_encoder(axis: Axis) -> tuple[TurningPoints, bool]:
    """The point of an encoder, without turning points and version: its shaft may be turned from outside."""
    return turning_points_of(partial(_profile, axis)), False


_FOLLOWING: Mapping[str, Callable[[Axis], tuple[TurningPoints, bool]]] = {
    "moving": _as_moving,
    "POS_ACT": _as_coordinate,
    "VEL_ACT": _as_profile,
    "ENC_IMP": _as_encoder,
    "ENC_XPOS": _as_encoder,
}
"""Points that change between events, by the key of their register."""
