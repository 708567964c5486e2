"""The points of an M1486: common values for conditions, numeric registers, and the bytes that ``U`` sends. A world reads them
without a command; on a device each takes a command and its time, and ``<`` changes the internal variable."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.datasheet import Access, Limits, Point, PointAddress, PointEffect
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.io_effects import UPLOADED
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.registers import POSITION_REGISTER, REGISTERS, REMAINDER_REGISTER, UPLOADS
from steptwin.motion import Profile
from steptwin.points import LivePoint, TurningPoints, turning_points_of, turning_points_of_round

POSITION_BITS = 24
FLAGS_UPLOAD = 14
"""The byte with the user flags, which commands set without an event (``T``, ``C``)."""
_STATE, _VARIABLE, _REMAINDER, _REGISTERS, _FUNCTIONS = range(5)
_MARKS_OF_UPLOADS = {4: _VARIABLE, 5: _VARIABLE, 6: _VARIABLE, 17: _FUNCTIONS, 18: _FUNCTIONS, 19: _FUNCTIONS}


class _PointRow(NamedTuple):
    point: Point
    read: Callable[[M1486Chip, Nanos], float]
    follows: bool = False
    """Whether the value changes between events."""
    bits: int | None = None
    """Number of low bits of the position in a count that wraps."""
    has_version: bool = False
    is_kept: bool = False
    """As in `steptwin.points.LivePoint`."""
    mark: int = 0
    """The number of the value of `marks` that is another one when this point is."""


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _value(path: str, meaning: str, unit: str = "", source: str = "", kind: str = "number") -> Point:
    return Point(
        path=path,
        meaning=meaning,
        type=kind,
        unit=unit,
        values={},
        access=Access.READ,
        effect=PointEffect.NONE,
        source=source,
    )


def _has_room(chip: M1486Chip, now: Nanos) -> bool:
    """Whether a host with flow control would send another line."""
    receiver = chip.receiver
    return not receiver.is_listening or not (receiver.is_stalled or receiver.busy_until is not None)


def _values() -> Iterator[_PointRow]:
    yield _PointRow(
        _value("position", "Where the pulses given so far have led, since power-on.", UNIT),
        lambda chip, now: chip.drive.true_u(now),
        follows=True,
        has_version=True,
    )
    yield _PointRow(
        _value("velocity", "Commanded velocity.", f"{UNIT}/s"),
        lambda chip, now: chip.drive.profile.velocity(now),
        follows=True,
        has_version=True,
    )
    yield _PointRow(
        _value("counter", "Position counter, 24 bits.", UNIT, "VII.7"),
        lambda chip, now: chip.drive.counter_u(now),
        follows=True,
        bits=POSITION_BITS,
    )
    yield _PointRow(_value("moving", "Whether a motion is being made.", kind="switch"), lambda chip, now: chip.drive.is_busy)
    yield _PointRow(
        _value("busy", "Whether a motion, a command or a program is in progress; one that is stopped is not.", kind="switch"),
        lambda chip, now: chip.is_busy(now),
    )
    yield _PointRow(
        _value("valid", "Whether the counter shows where it is: no move was stopped before its end.", "", "VII.7", kind="switch"),
        lambda chip, now: chip.drive.is_valid,
    )
    yield _PointRow(
        _value("room", "Whether a host may send the next line: chips not addressed take any.", kind="switch"),
        _has_room,
    )
    variable = _value("variable", "Internal variable, 24 bits.", "", "VII.7")
    yield _PointRow(variable, lambda chip, now: chip.unit.variable, mark=_VARIABLE)


def _registers() -> Iterator[_PointRow]:
    """Numeric registers: ``<`` reads one into the internal variable, ``>`` writes it."""
    for register in REGISTERS:
        number = register.number
        point = Point(
            path=f"register{number}",
            meaning=_sentence(register.name),
            type="number",
            unit=UNIT if number == POSITION_REGISTER else "",
            limits=Limits(0, 2**register.bits - 1),
            values={},
            access=Access.BOTH,
            effect=PointEffect.PARAMETER,
            addresses=(PointAddress(space="command", place=f"<{number}"), PointAddress(space="command", place=f">{number}")),
            source="VII.7",
        )
        if number == POSITION_REGISTER:
            yield _PointRow(point, lambda chip, now: chip.drive.counter_u(now), follows=True, bits=POSITION_BITS)
        elif number == REMAINDER_REGISTER:
            yield _PointRow(point, lambda chip, now: chip.unit.remainder, mark=_REMAINDER)
        else:
            yield _PointRow(point, partial(_general, number), mark=_REGISTERS)


def _general(number: int, chip: M1486Chip, now: Nanos) -> float:
    return chip.memory.register(number)


def _uploads() -> Iterator[_PointRow]:
    for number, what in UPLOADS.items():
        point = Point(
            path=f"U{number}",
            meaning=_sentence(what),
            type="byte",
            values={},
            access=Access.READ,
            effect=PointEffect.NONE,
            addresses=(PointAddress(space="command", place=f"U{number}"),),
            source="VII.1",
        )
        is_of_position = number <= POSITION_BITS // 8
        bits = 8 * number if is_of_position else None
        mark = _MARKS_OF_UPLOADS.get(number, _STATE)
        yield _PointRow(point, UPLOADED[number], is_of_position, bits, is_kept=number == FLAGS_UPLOAD, mark=mark)


_ROWS: Mapping[str, _PointRow] = {row.point.path.upper(): row for row in (*_values(), *_registers(), *_uploads())}
POINTS: Mapping[str, Point] = {path: row.point for path, row in _ROWS.items()}
"""By path in capitals."""


def marks(chip: M1486Chip) -> tuple[object, ...]:
    """See `steptwin.simulation.kinds.kind.ControllerKind.marks`."""
    unit, drive, now = chip.unit, chip.drive, chip.now
    state = chip.is_busy(now), drive.motion, drive.is_valid, _has_room(chip, now), chip.interface
    return state, unit.variable, unit.remainder, chip.memory.registers(), tuple(unit.functions)


def mark_of(path: str) -> int:
    return _ROWS[path.upper()].mark


def live_point(chip: M1486Chip, text: str) -> LivePoint | None:
    """The point of a name; None where there is none."""
    row = _ROWS.get(text.upper())
    if row is None:
        return None
    version = partial(_version, chip) if row.has_version else None
    read = partial(row.read, chip)
    return LivePoint(point=row.point, read=read, turning_points=_turning_points(chip, row), version=version, is_kept=row.is_kept)


def _turning_points(chip: M1486Chip, row: _PointRow) -> TurningPoints | None:
    if not row.follows:
        return None
    profile = partial(_profile, chip)
    if row.bits is None:
        return turning_points_of(profile)
    # During a move the counter shows its end (M-16): there are then turning points at which nothing changes.
    return turning_points_of_round(profile, lambda now: chip.drive.true_u(now) + chip.drive.offset_u, 2**row.bits)


def _profile(chip: M1486Chip) -> Profile:
    return chip.drive.profile


def _version(chip: M1486Chip) -> object:
    return chip.drive.revision
