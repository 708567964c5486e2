"""``--device``: the real device that replaces a twin in a test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from steptwin.drivers import Mic488
from steptwin.drivers.address import parse_device
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.mic488.kind import unit_of
from steptwin.errors import Misuse
from steptwin.mic488.config import ControllerConfig

ANY = ""
"""The name of an address that is given without one."""


def parse_devices(given: Sequence[str]) -> Mapping[str, str]:
    """Addresses by name: of a fixture (``mic488``, ``m1486``) or of a controller in a world; `ANY` is the one without.

    ``/dev/ttyUSB0,unit=2`` has no name, ``m1486=/dev/ttyUSB1`` has one. Raises `Misuse`.
    """
    found: dict[str, str] = {}
    for text in given:
        place, *_ = text.split(",")
        name, equals, _ = place.partition("=")
        if not equals:
            name = ANY
        address = text[len(name) + 1 :] if equals else text
        if name in found:
            raise Misuse(f"--device {text}: {f'{name} has' if name else 'there is'} an address already: {found[name]}")
        parsed = parse_device(address)
        parse_line_address(parsed.place, parsed.baud)
        found[name] = address
    return found


def device_for(devices: Mapping[str, str], name: str) -> str | None:
    """The address of a device, None for the twin."""
    return devices.get(name, devices.get(ANY))


def driver_of(address: str, config: ControllerConfig | None = None) -> Mic488:
    """A driver of a device, not opened. ``config`` holds where the address names none."""
    given = parse_device(address)
    return Mic488(
        given.place,
        unit_of(given),
        baud=given.baud,
        firmware=given.variant,
        config=given.config or config,
        timeout_s=given.timeout,
    )
