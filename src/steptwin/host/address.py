"""Which device, in one text: an address and what else there is to know of it, with commas between.

``/dev/ttyUSB0``, ``/dev/ttyUSB0,baud=9600,unit=2,config=machine.cfg``, ``tcp://127.0.0.1:5020``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from steptwin.errors import Misuse

DEFAULT = "tcp://127.0.0.1:5020"
"""Where `steptwin serve mic488` listens when nothing else is said."""
OPTIONS = "unit=N, baud=N, firmware=1.70, config=FILE, timeout=SECONDS"


@dataclass(frozen=True, slots=True)
class DeviceAddress:
    """A device address taken apart; see `steptwin.host.mic488.driver.AsyncMic488` for the parts."""

    place: str
    unit: int = 1
    baud: int = 38400
    firmware: str | None = None
    config: str | None = None
    timeout: float = 0.3

    def __str__(self) -> str:
        unit = f",unit={self.unit}" if self.unit != 1 else ""
        return f"{self.place}{unit}"


_TYPES: dict[str, Callable[[str], Any]] = {"unit": int, "baud": int, "firmware": str, "config": str, "timeout": float}


def parse_device(text: str) -> DeviceAddress:
    """Raises `Misuse`."""
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
            raise Misuse(f"device {text!r}: {value!r} is no number for {name}") from None
    return replace(DeviceAddress(place), **found)
