"""Registers of a MIC488 as users name them: ``M1_POS_ACT``, ``M*_ACC``, ``USER_REGISTER[0-9]``, ``10020``, ``hr:10020:hex``."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from steptwin.drivers.kind import ReadValue, ReadValues
from steptwin.drivers.mic488.addresses import ValueAddress, places, read_places
from steptwin.drivers.mic488.sync import Mic488
from steptwin.drivers.typed import changes_of
from steptwin.errors import Misuse
from steptwin.mic488 import values
from steptwin.mic488.registermap import DataType, Register, RegisterMap, WriteEffect
from steptwin.mic488.registers import register_map

USUAL = ("M?_POS_ACT", "M?_VEL_ACT", "M?_STATUS")
_RUN = re.compile(r"(?P<head>\w+\[)(?P<first>\d+)-(?P<last>\d+)(?P<tail>\].*)")


def map_of(mic: Mic488) -> RegisterMap:
    return register_map(mic.firmware)


def read(mic: Mic488, wanted: Sequence[str]) -> ReadValues:
    """Values by name and by address. Raises `Misuse` for what is neither."""
    found = expanded(map_of(mic), wanted)
    by_name = _named(mic, [one for one in found if isinstance(one, str)])
    by_address = read_places(mic, [one for one in found if isinstance(one, ValueAddress)])
    return {str(one): by_name[one] if isinstance(one, str) else ReadValue(by_address[one]) for one in found}


def _named(mic: Mic488, wanted: Sequence[str]) -> Mapping[str, ReadValue]:
    shown = mic.get_shown(*wanted) if wanted else {}
    registers = map_of(mic)
    return {name: ReadValue(value, unit, _meaning(registers, name, value)) for name, (value, unit) in shown.items()}


def expanded(registers: RegisterMap, wanted: Sequence[str]) -> list[str | ValueAddress]:
    """Expand names with ``*`` and ``?``, ranges of user registers, and addresses.

    Raises `Misuse` for one that matches nothing.
    """
    found: dict[str | ValueAddress, None] = {}
    for name in wanted:
        run = _RUN.fullmatch(name)
        members: Sequence[str | ValueAddress] | None = places(name, registers)
        if members is not None:
            pass
        elif run is not None:
            first, last = int(run["first"]), int(run["last"])
            step = 2 if run["tail"].lower().endswith((":dint", ":real")) else 1
            members = [f"{run['head']}{number}{run['tail']}" for number in range(first, last + 1, step)]
        elif "*" in name or "?" in name:
            members = [r.name for r in registers if r.reads and r.cells == 1 and fnmatchcase(r.name, name.upper())]
        else:
            members = [name]
        if not members:
            raise Misuse(f"{name!r} matches no register that can be read; 'steptwin registers mic488' lists them")
        found |= dict.fromkeys(members)
    return list(found)


def writing(changes: Sequence[str]) -> Callable[[Mic488], ReadValues]:
    """As `steptwin.drivers.kind.DriverKind.writing`. Gives the registers that hold what is written."""
    given = changes_of(changes, "M1_ACC=50")

    def write(mic: Mic488) -> ReadValues:
        registers = map_of(mic)
        wanted = {name: _value_of(_register(registers, name), text, change) for name, text, change in given}
        for name, value in wanted.items():  # all of them before the first is written
            values.encoded(values.named(registers, name), value, DataType.REAL)
        for name, value in wanted.items():
            mic.set(name, value)
        return _named(mic, [name for name in wanted if _holds(_register(registers, name))])

    return write


def _register(registers: RegisterMap, name: str) -> Register:
    return registers.named(name.partition("[")[0])


def _value_of(register: Register, value: str, whole: str) -> float:
    """A value as typed: a number, ON or OFF, or the text of an enumerated value. Raises `Misuse` naming ``whole``."""
    try:
        return values.value_of(register, value)
    except Misuse as error:
        raise Misuse(f"{whole!r}: {error}") from None


def _holds(register: Register) -> bool:
    return bool(register.reads) and register.effect is WriteEffect.STORE


def _meaning(registers: RegisterMap, name: str, value: Any) -> str:
    register = registers.named(re.split(r"[\[:]", name)[0])
    return register.values.get(int(value), "") if register.values else ""
