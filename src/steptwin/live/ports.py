"""Possible addresses of devices: serial ports of this system, and pseudo terminals of this user's twins."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

from steptwin.errors import LineFailure, Refusal
from steptwin.live.remote import ask, running
from steptwin.subject.commands import EndPoints


@dataclass(frozen=True, slots=True)
class FoundPort:
    """An address as commands take it, and its description."""

    address: str
    what: str


def serial_ports() -> list[FoundPort]:
    """The serial ports of this system; USB adapters with their descriptions."""
    import serialx

    found = []
    for port in serialx.list_serial_ports():
        words = [port.manufacturer, port.product, port.serial_number]
        what = " ".join(word for word in words if word) or "serial port"
        if port.vid is not None and port.pid is not None:
            what += f" ({port.vid:04X}:{port.pid:04X})"
        found.append(FoundPort(str(port.device), what))
    return found


def twin_ports() -> list[FoundPort]:
    """The pseudo terminals of running twins that respond."""
    found = []
    for name in running():
        with contextlib.suppress(LineFailure, Refusal):  # gone meanwhile
            found += [
                FoundPort(point["path"], f"twin {name}, {point['protocol']}")
                for point in ask(name, EndPoints())["end_points"]
                if point["kind"] == "pty"
            ]
    return found
