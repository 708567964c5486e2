"""Device addresses as text: an address, and options behind commas.

``/dev/ttyUSB0``, ``/dev/ttyUSB0,baud=9600,unit=2,config=machine.cfg``, ``tcp://127.0.0.1:5020``; for an M1486
``/dev/ttyUSB0,kind=m1486``, ``tcp://127.0.0.1:5022,chip=7``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from steptwin.errors import Misuse

OPTIONS = "unit=N, baud=N, firmware=1.70, config=FILE, timeout=SECONDS; for an M1486 kind=m1486, chip=0…F, variant=B"
KINDS = ("mic488", "m1486")
CHIP_BAUD = 4800
CHIP_TIMEOUT_S = 0.5


@dataclass(frozen=True, slots=True)
class DeviceAddress:
    """A device address taken apart; see `steptwin.drivers.mic488.driver.AsyncMic488` for the parts.

    ``chip`` and ``variant`` are for an M1486: its address on the line (None: the only chip) and its type (None: determined when
    opened).
    """

    place: str
    unit: int = 1
    baud: int = 38400
    firmware: str | None = None
    config: str | None = None
    timeout: float = 0.3
    kind: str = "mic488"
    chip: int | None = None
    variant: str | None = None

    def __str__(self) -> str:
        unit = f",unit={self.unit}" if self.unit != 1 else ""
        return f"{self.place}{unit}"


_TYPES: dict[str, Callable[[str], Any]] = {
    "unit": int,
    "baud": int,
    "firmware": str,
    "config": str,
    "timeout": float,
    "kind": str.lower,
    "chip": lambda text: int(text, 16),
    "variant": str,
}
_OF_MIC488 = frozenset({"unit", "firmware", "config"})
_OF_M1486 = frozenset({"chip", "variant"})


def parse_device(text: str) -> DeviceAddress:
    """Raises `Misuse`."""
    place, options = split_device(text)
    return device_at(text, place, options)


def device_at(text: str, place: str, options: Mapping[str, Any]) -> DeviceAddress:
    """The device at an address with these options; ``text`` is the whole input, for messages. Raises `Misuse`."""
    found = dict(options)
    _check_kind(text, found)
    return replace(DeviceAddress(place), **found)


def split_device(text: str) -> tuple[str, dict[str, Any]]:
    """The part before the first comma, and the options behind it. Raises `Misuse`."""
    place, *options = (part.strip() for part in text.split(","))
    if not place:
        raise Misuse(f"device {text!r} has no address: expected ADDRESS, or with options behind it: ADDRESS,{OPTIONS}")
    found: dict[str, Any] = {}
    for option in options:
        name, equals, value = option.partition("=")
        if not equals or name not in _TYPES or name in found:
            raise Misuse(f"device {text!r}: {option!r} is none of {OPTIONS}, each once")
        try:
            found[name] = _TYPES[name](value)
        except ValueError:
            raise Misuse(f"device {text!r}: {value!r} is not a number for {name}") from None
    return place, found


def _check_kind(text: str, found: dict[str, Any]) -> None:
    """Check that all options are of one kind of device, and fill in the defaults of that kind."""
    if _OF_M1486 & found.keys():
        found.setdefault("kind", "m1486")
    kind = found.get("kind", KINDS[0])
    if kind not in KINDS:
        raise Misuse(f"device {text!r}: kind {kind!r} is none of {', '.join(KINDS)}")
    strange = found.keys() & (_OF_MIC488 if kind == "m1486" else _OF_M1486)
    if strange:
        raise Misuse(f"device {text!r}: {', '.join(sorted(strange))} does not go with kind={kind}")
    if kind == "m1486":
        found.setdefault("baud", CHIP_BAUD)
        found.setdefault("timeout", CHIP_TIMEOUT_S)
