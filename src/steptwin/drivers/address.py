"""Device addresses as text: an address, and options behind commas.

``/dev/ttyUSB0``, ``/dev/ttyUSB0,baud=9600,unit=2,config=machine.cfg``, ``tcp://127.0.0.1:5020``; for an M1486
``/dev/ttyUSB0,kind=m1486``, ``tcp://127.0.0.1:5022,chip=7``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from steptwin.drivers.kind import AnyDriverKind, DeviceAddress
from steptwin.drivers.kinds import DRIVERS
from steptwin.errors import Misuse
from steptwin.messages import Message


def parse_device(text: str) -> DeviceAddress:
    """Raises `Misuse`."""
    place, options = split_device(text)
    return device_at(text, place, options)


OPTION_OF_ANOTHER_KIND = Message("drivers.option-of-another-kind", "device {text!r}: {options} does not go with kind={kind}")


def device_at(text: str, place: str, options: Mapping[str, Any]) -> DeviceAddress:
    """The device at an address with these options; ``text`` is the whole input, for messages. Raises `Misuse`."""
    kind = _kind_of(text, options)
    how = kind.selection
    strange = {name for other in DRIVERS.values() for name in other.selection.options - how.options} & options.keys()
    if strange:
        raise Misuse(OPTION_OF_ANOTHER_KIND(text=text, options=sorted(strange), kind=kind.name))
    return DeviceAddress(
        place,
        kind.name,
        options.get(how.option, how.usual),
        options.get("baud", kind.baud),
        options.get("timeout", kind.timeout_s),
        options.get(how.variant),
        options.get("config"),
    )


def text_of(address: DeviceAddress) -> str:
    """The address, with what selects the device there unless it is the usual one."""
    how = DRIVERS[address.kind].selection
    if address.number is None or address.number == how.usual:
        return address.place
    return f"{address.place},{how.option}={how.show(address.number)}"


UNKNOWN_KIND = Message("drivers.unknown-kind", "device {text!r}: kind {kind!r} is none of {names}")


def _kind_of(text: str, options: Mapping[str, Any]) -> AnyDriverKind:
    """The kind that is named, or the first that has one of the options, or the first of all."""
    name = options.get("kind")
    if name is None:
        return next((kind for kind in DRIVERS.values() if kind.selection.options & options.keys()), next(iter(DRIVERS.values())))
    if name not in DRIVERS:
        raise Misuse(UNKNOWN_KIND(text=text, kind=name, names=list(DRIVERS)))
    return DRIVERS[name]


NO_ADDRESS_OF_A_DEVICE = Message(
    "drivers.no-address-of-a-device",
    "device {text!r} has no address: expected ADDRESS, or with options behind it: ADDRESS,{forms}",
)
WRONG_OPTION = Message("drivers.wrong-option", "device {text!r}: {option!r} is none of {forms}, each once")
NO_NUMBER = Message("drivers.no-number", "device {text!r}: {value!r} is not a number for {name}")


def split_device(text: str) -> tuple[str, dict[str, Any]]:
    """The part before the first comma, and the options behind it. Raises `Misuse`."""
    place, *options = (part.strip() for part in text.split(","))
    if not place:
        raise Misuse(NO_ADDRESS_OF_A_DEVICE(text=text, forms=_forms()))
    types = _types()
    found: dict[str, Any] = {}
    for option in options:
        name, equals, value = option.partition("=")
        if not equals or name not in types or name in found:
            raise Misuse(WRONG_OPTION(text=text, option=option, forms=_forms()))
        try:
            found[name] = types[name](value)
        except ValueError:
            raise Misuse(NO_NUMBER(text=text, value=value, name=name)) from None
    return place, found


def _types() -> Mapping[str, Callable[[str], Any]]:
    """How the value of each option is read."""
    types: dict[str, Callable[[str], Any]] = {"kind": str.lower, "baud": int, "timeout": float}
    for kind in DRIVERS.values():
        types |= dict.fromkeys(kind.selection.options, str) | {kind.selection.option: kind.selection.read}
    return types


def _forms() -> str:
    of_kinds = (f"of {kind.title} {kind.selection.forms}" for kind in DRIVERS.values())
    return f"baud=N, timeout=SECONDS, kind={'|'.join(DRIVERS)}; {'; '.join(of_kinds)}"
