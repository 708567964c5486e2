"""Texts that name a device."""

from __future__ import annotations

import pytest

from steptwin.drivers.address import parse_device, text_of
from steptwin.drivers.kind import DeviceAddress
from steptwin.errors import Misuse


@pytest.mark.parametrize(
    ("text", "address", "shown"),
    [
        ("/dev/ttyUSB0", DeviceAddress("/dev/ttyUSB0", "mic488", 1, 38400, 0.3, None, None), "/dev/ttyUSB0"),
        (
            "/dev/ttyUSB0, baud=9600 ,unit=2,config=machine.cfg,firmware=1.70,timeout=0.5",
            DeviceAddress("/dev/ttyUSB0", "mic488", 2, 9600, 0.5, "1.70", "machine.cfg"),
            "/dev/ttyUSB0,unit=2",
        ),
        (
            "tcp://127.0.0.1:5020,kind=MIC488",
            DeviceAddress("tcp://127.0.0.1:5020", "mic488", 1, 38400, 0.3),
            "tcp://127.0.0.1:5020",
        ),
        ("p,kind=m1486", DeviceAddress("p", "m1486", None, 4800, 0.5), "p"),
        ("p,chip=F", DeviceAddress("p", "m1486", 15, 4800, 0.5), "p,chip=F"),
        (
            "p,variant=B,baud=9600,timeout=1",
            DeviceAddress("p", "m1486", None, 9600, 1.0, "B"),
            "p",
        ),
    ],
)
def test_an_address_and_its_options(text: str, address: DeviceAddress, shown: str) -> None:
    found = parse_device(text)
    assert found == address
    assert text_of(found) == shown


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "device '' has no address: expected ADDRESS"),
        (",unit=2", "device ',unit=2' has no address"),
        ("p,unit", "device 'p,unit': 'unit' is none of baud=N, timeout=SECONDS"),
        ("p,units=1", "device 'p,units=1': 'units=1' is none of"),
        ("p,unit=1,unit=1", "'unit=1' is none of .* each once"),
        ("p,unit=x", "device 'p,unit=x': 'x' is not a number for unit"),
        ("p,timeout=soon", "'soon' is not a number for timeout"),
        ("p,kind=mic", "kind 'mic' is none of mic488, m1486"),
        ("p,kind=m1486,unit=1,config=a", "config, unit does not go with kind=m1486"),
        ("p,kind=mic488,chip=1", "chip does not go with kind=mic488"),
        ("p,variant=B,firmware=1.70", "variant does not go with kind=mic488"),
    ],
)
def test_what_is_no_address_is_refused(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        parse_device(text)
