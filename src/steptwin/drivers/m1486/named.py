"""Values of an M1486 as users name them: ``POSITION``, ``FLAGS``, ``VARIABLE=7``, ``B6=off``, ``V=2000``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import groupby
from math import isfinite
from typing import Any, NamedTuple

from steptwin.drivers.kind import ReadValue, ReadValues
from steptwin.drivers.m1486.settings import COMMANDS, checked_number
from steptwin.drivers.m1486.sync import M1486
from steptwin.drivers.typed import changes_of, number_of
from steptwin.errors import Misuse
from steptwin.m1486.functions import FUNCTIONS, USER_FLAGS
from steptwin.m1486.lines import LINES
from steptwin.m1486.microsteps import UNIT

NAMES = ("POSITION", "COUNTER", "VARIABLE", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES")
USUAL_POINTS = ("counter", "velocity", "variable")
"""Usual points of a twin. Its point ``position`` is not what `POSITION` is: it counts from power-on."""
ONLY_OF_DRIVER = frozenset({"POSITION", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES"})
"""Values that the driver reads and that are no points of the data sheet, or are in another unit and from another origin."""
_SETTINGS = {letter.upper(): name for name, letter in COMMANDS.items()}
_SWITCHES = {"ON": True, "TRUE": True, "1": True, "OFF": False, "FALSE": False, "0": False}
SETTABLE = "POSITION, VARIABLE, B1…B21, FLAG80…FLAG86, F40…F63, S, A, V, P, M, Q, N"


def read(chip: M1486, wanted: Sequence[str]) -> ReadValues:
    """Only what is wanted: what is read takes command memory."""
    if "POSITION" in wanted or "COUNTER" in wanted:
        chip.counter()
    known = chip.known()
    readers: dict[str, Callable[[], ReadValue]] = {
        "POSITION": lambda: ReadValue(known.position if known.is_position_valid else None, known.unit),
        "COUNTER": lambda: ReadValue(known.counter_u, UNIT),
        "VARIABLE": lambda: ReadValue(chip.variable()),
        "FLAGS": lambda: ReadValue(_on(chip.flags())),
        "FUNCTIONS": lambda: ReadValue(_on(chip.functions())),
        "TYPE": lambda: ReadValue(known.type),
        "INTERFACE": lambda: ReadValue(_interface(chip)),
        "SERIES": lambda: ReadValue(chip.byte(16)),
    }
    return {name: readers[name]() for name in wanted}


def _interface(chip: M1486) -> str | None:
    found = chip.interface()
    return None if found is None else found.title


def _on(states: Mapping[int, bool]) -> str:
    return " ".join(str(number) for number, on in states.items() if on) or "none"


class CheckedChange(NamedTuple):
    """A change of a chip, and its check, which sends nothing."""

    check: Callable[[M1486], object]
    make: Callable[[M1486], object]


def checked_changes(changes: Sequence[str]) -> Sequence[CheckedChange]:
    """``NAME=VALUE`` as typed. Settings one behind the other are made together, so that M and Q may change to others that go
    together. Raises `Misuse`."""
    wanted: list[CheckedChange] = []
    given = changes_of(changes, "VARIABLE=7 or B6=off")
    for is_setting, group in groupby(given, lambda change: change[0].upper() in _SETTINGS):
        several = list(group)
        wanted += [_settings(several)] if is_setting else [_change(*change) for change in several]
    return wanted


def _settings(given: Sequence[tuple[str, str, str]]) -> CheckedChange:
    numbers = {name.upper(): _whole(name.upper(), value, text) for name, value, text in given}
    settings: dict[str, Any] = {_SETTINGS[letter]: number for letter, number in numbers.items()}

    def check(chip: M1486) -> None:
        for letter, number in numbers.items():
            checked_number(letter.lower(), number, chip.variant, letter)
        chip.settings.with_(**settings).check()

    return CheckedChange(check, lambda chip: chip.configure(**settings))


def _change(name: str, value: str, text: str) -> CheckedChange:
    name = name.upper()
    if name == "POSITION":
        position = number_of(value, text)
        return CheckedChange(lambda chip: None, lambda chip: chip.set_position(position))
    if name == "VARIABLE":
        number = _whole(name, value, text)
        return CheckedChange(
            lambda chip: checked_number(":", number, chip.variant, "the internal variable"),
            lambda chip: chip.set_variable(number),
        )
    for prefix, permitted, switch in _SWITCHED:
        if name.startswith(prefix) and name[len(prefix) :].isdecimal():
            number = int(name[len(prefix) :])
            on = _SWITCHES.get(value.upper())
            if on is None:
                raise Misuse(f"{text!r}: expected on or off")
            if number not in permitted:
                raise Misuse(f"{text!r}: permitted are {prefix}{permitted[0]} to {prefix}{permitted[-1]}")
            return CheckedChange(lambda chip: None, partial(switch, number=number, on=on))
    raise Misuse(f"{text!r}: {name} cannot be set: permitted are {SETTABLE}")


def _whole(name: str, value: str, text: str) -> int:
    number = number_of(value, text)
    if not isfinite(number) or number != int(number):
        raise Misuse(f"{text!r}: {name} takes whole numbers")
    return int(number)


_SWITCHED: Sequence[tuple[str, Sequence[int], Callable[..., object]]] = (
    ("FLAG", USER_FLAGS, lambda chip, number, on: chip.set_flag(number, on)),
    ("B", LINES, lambda chip, number, on: chip.set_output(number, on)),
    ("F", FUNCTIONS, lambda chip, number, on: chip.set_function(number, on)),
)
"""Beginnings of the names of switches, their numbers, and the functions that set them."""
