"""The part of an M1486's state that other controllers do not have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from steptwin.controller import Nanos
from steptwin.controllerstate import DetailRow, DetailValue
from steptwin.datasheet import Detail, FactType
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.commands import TABLE
from steptwin.m1486.commanduse import Setting
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.registers import GENERAL
from steptwin.tables import complete


def used_bits(chip: M1486Chip) -> int:
    """Command memory written since the program's beginning; all of it once the ring has come round (M-12)."""
    memory = chip.memory
    return 8 * (memory.size if memory.begin is None else memory.age(memory.begin))


def functions_on(chip: M1486Chip) -> list[int]:
    return [number for number in FUNCTIONS if chip.unit.on(number)]


def flags_on(chip: M1486Chip) -> list[int]:
    flags = [number for number, on in zip(USER_FLAGS, chip.unit.flags, strict=True) if on]
    return [*flags, CARRY] if chip.unit.carry else flags


_SETTINGS: Mapping[Setting, Callable[[ChipDrive], int]] = complete(
    "setting",
    [setting for setting in Setting if setting is not Setting.VARIABLE],
    "value",
    {
        Setting.START_STOP: lambda drive: drive.start_stop,
        Setting.ACCELERATION: lambda drive: drive.acceleration,
        Setting.PROFILE: lambda drive: drive.profile_speed,
        Setting.VELOCITY: lambda drive: drive.velocity,
        Setting.MICROSTEP: lambda drive: drive.microstep,
        Setting.QUALIFICATION: lambda drive: drive.qualification,
        Setting.WAVEFORM: lambda drive: drive.characteristic,
    },
)
BRIEF = frozenset({"listens", "memory_used", "input_waiting", "counter", "counter_valid", "variable", "flags_on", "functions_on"})
_TEXT, _WHOLE, _TRUTH = FactType.TEXT, FactType.WHOLE, FactType.TRUTH


def _rows() -> Iterator[DetailRow[M1486Chip]]:
    def row(
        name: str, meaning: str, kind: FactType, read: Callable[[M1486Chip, Nanos], DetailValue], unit: str = ""
    ) -> DetailRow[M1486Chip]:
        return DetailRow(Detail(name, meaning, kind, unit, name in BRIEF), read)

    yield row("address", "Address on its line, hexadecimal", _TEXT, lambda chip, now: f"{chip.address:X}")
    yield row("interface", "Driver interface", _TEXT, lambda chip, now: chip.interface.name)
    yield row("baud", "Rate of its line", _WHOLE, lambda chip, now: chip.uart.baud, "bit/s")
    yield row("listens", "Whether it was addressed last", _TRUTH, lambda chip, now: chip.receiver.is_listening)
    yield row("memory_used", "Command memory that is used", _WHOLE, lambda chip, now: used_bits(chip), "bit")
    yield row("memory_size", "Command memory", _WHOLE, lambda chip, now: chip.variant.memory_bits, "bit")
    yield row("stored", "File in the EEPROM", _WHOLE, lambda chip, now: len(chip.image), "byte")
    yield row("input_waiting", "Characters in the input buffer", _WHOLE, lambda chip, now: chip.receiver.waiting)
    yield row("input_size", "Characters it has room for", _WHOLE, lambda chip, now: chip.receiver.waiting + chip.receiver.free)
    yield row("counter", "Position counter, 24 bits", _WHOLE, lambda chip, now: chip.drive.counter_u(now), UNIT)
    yield row("counter_valid", "Whether the counter shows the position (M-16)", _TRUTH, lambda chip, now: chip.drive.is_valid)
    for spec in TABLE:
        if spec.use.sets in _SETTINGS:
            yield row(spec.key, spec.name, _WHOLE, _setting(_SETTINGS[spec.use.sets]), spec.unit)
    yield row("next_distance", "Distance of the next move; null without end", FactType.WHOLE, _next_distance, UNIT)
    yield row("next_direction", "Direction of the next move: 1 or -1", _WHOLE, _next_direction)
    yield row("variable", "Internal variable, 24 bits", _WHOLE, lambda chip, now: chip.unit.variable)
    yield row("remainder", "Remainder of the last division", _WHOLE, lambda chip, now: chip.unit.remainder)
    yield row(
        "registers",
        "General purpose registers",
        FactType.NAMED,
        lambda chip, now: {str(number): chip.memory.register(number) for number in GENERAL},
    )
    yield row("flags_on", "Flags that are set", FactType.WHOLES, lambda chip, now: tuple(flags_on(chip)))
    yield row("functions_on", "Functions that are on", FactType.WHOLES, lambda chip, now: tuple(functions_on(chip)))


def _setting(read: Callable[[ChipDrive], int]) -> Callable[[M1486Chip, Nanos], int]:
    return lambda chip, now: read(chip.drive)


def _next_distance(chip: M1486Chip, now: Nanos) -> int | None:
    return None if chip.drive.endless else chip.drive.distance_u


def _next_direction(chip: M1486Chip, now: Nanos) -> int:
    return chip.drive.endless or (1 if chip.drive.distance_u >= 0 else -1)


DETAILS: tuple[DetailRow[M1486Chip], ...] = tuple(_rows())
