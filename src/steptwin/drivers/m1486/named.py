"""Values of an M1486 as users name them: ``POSITION``, ``FLAGS``, ``VARIABLE=7``, ``B6=off``, ``V=2000``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any

from steptwin.drivers.kind import DeviceAddress, DeviceOverview, ReadValue, ReadValues
from steptwin.drivers.m1486.sync import M1486
from steptwin.drivers.typed import changes_of, number_of, shown
from steptwin.errors import Misuse
from steptwin.m1486.microsteps import UNIT

NAMES = ("POSITION", "COUNTER", "VARIABLE", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES")
USUAL = ("POSITION", "VARIABLE", "FLAGS")
USUAL_POINTS = ("counter", "velocity", "variable")
"""Of a twin. Its point ``position`` is not what `POSITION` is: it counts from power-on."""
ONLY_OF_DRIVER = frozenset({"POSITION", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES"})
"""What the driver reads and is no point of the data sheet, or in another unit and from another origin."""
_SETTINGS = {
    "S": "start_stop",
    "A": "acceleration",
    "V": "velocity",
    "P": "profile",
    "M": "microstep",
    "Q": "qualification",
    "N": "waveform",
}
_SWITCHES = {"ON": True, "TRUE": True, "1": True, "OFF": False, "FALSE": False, "0": False}
SETTABLE = "POSITION, VARIABLE, B1…B21, FLAG80…FLAG86, F40…F63, S, A, V, P, M, Q, N"


def reading(names: Sequence[str]) -> Callable[[M1486], ReadValues]:
    """See `steptwin.drivers.kind.DriverKind`."""
    wanted = [name.upper() for name in names]
    for name in wanted:
        if name not in NAMES:
            raise Misuse(f"{name!r} is not a value of an M1486: permitted are {', '.join(NAMES)}")
    return lambda chip: _read(chip, wanted)


def _read(chip: M1486, wanted: Sequence[str]) -> ReadValues:
    status = chip.status()
    known = {
        "POSITION": ReadValue(status.position if status.is_position_valid else None, status.unit),
        "COUNTER": ReadValue(status.counter_u, UNIT),
        "VARIABLE": ReadValue(status.variable),
        "FLAGS": ReadValue(_on(status.flags)),
        "FUNCTIONS": ReadValue(_on(status.functions)),
        "TYPE": ReadValue(status.type),
        "INTERFACE": ReadValue(status.interface),
        "SERIES": ReadValue(status.series),
    }
    return {name: known[name] for name in wanted}


def followed(names: Sequence[str], variant: str | None) -> Sequence[str] | None:
    """The points of a twin with these names; None if the driver knows some of them better."""
    wanted = names or USUAL_POINTS
    return wanted if not names or ONLY_OF_DRIVER.isdisjoint(name.upper() for name in wanted) else None


def _on(states: Mapping[int, bool]) -> str:
    return " ".join(str(number) for number, on in states.items() if on) or "none"


def overview(chip: M1486, address: DeviceAddress) -> DeviceOverview:
    found = {name: one.value for name, one in _read(chip, NAMES).items()}
    which = "" if chip.address is None else f", chip {chip.address:X}"
    head = (
        f"{found['TYPE']}{which} at {chip.place}, {found['INTERFACE']}, series {found['SERIES']}",
        f"position {shown(found['POSITION'])} {chip.unit} ({found['COUNTER']} {UNIT})",
        f"internal variable {found['VARIABLE']}; flags ON: {found['FLAGS']}",
        f"functions ON: {found['FUNCTIONS']}",
    )
    return DeviceOverview(
        {"device": chip.place, "chip": chip.address} | {name.lower(): value for name, value in found.items()}, head
    )


def writing(changes: Sequence[str]) -> Callable[[M1486], ReadValues]:
    """See `steptwin.drivers.kind.DriverKind`. Nothing is read again."""
    actions = [_action(*change) for change in changes_of(changes, "VARIABLE=7 or B6=off")]

    def write(chip: M1486) -> ReadValues:
        for action in actions:
            action(chip)
        return {}

    return write


def _action(name: str, value: str, text: str) -> Callable[[M1486], object]:
    name = name.upper()
    if name == "POSITION":
        position = number_of(value, text)
        return lambda chip: chip.set_position(position)
    if name in _SETTINGS or name == "VARIABLE":
        number = number_of(value, text)
        if not isfinite(number) or number != int(number):
            raise Misuse(f"{text!r}: {name} takes whole numbers")
        if name == "VARIABLE":
            return lambda chip: chip.set_variable(int(number))
        setting: dict[str, Any] = {_SETTINGS[name]: int(number)}
        return lambda chip: chip.configure(**setting)
    for prefix in ("FLAG", "B", "F"):
        if name.startswith(prefix) and name[len(prefix) :].isdecimal():
            return _switch(prefix, int(name[len(prefix) :]), value, text)
    raise Misuse(f"{text!r}: {name} cannot be set: permitted are {SETTABLE}")


def _switch(prefix: str, number: int, value: str, text: str) -> Callable[[M1486], object]:
    on = _SWITCHES.get(value.upper())
    if on is None:
        raise Misuse(f"{text!r}: expected on or off")
    match prefix:
        case "B":
            return lambda chip: chip.set_output(number, on)
        case "FLAG":
            return lambda chip: chip.set_flag(number, on)
        case _:
            return lambda chip: chip.set_function(number, on)
