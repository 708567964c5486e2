"""Files of devices and gateways."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.live.devicefile import DeviceSpec, read_device_file
from steptwin.simulation.toml.reader import WorldError

DEVICE = '[[device]]\nname = "table"\naddress = "/dev/ttyUSB0,unit=2"\n'
GATEWAY = '[gateway.prometheus]\nlisten = "127.0.0.1:9100"\n'


def test_devices_and_gateways() -> None:
    found = read_device_file("cell.toml", '[bridge]\nname = "cell"\n' + DEVICE + GATEWAY)
    assert (found.name, found.devices) == ("cell", (DeviceSpec(name="table", address="/dev/ttyUSB0,unit=2"),))
    assert [(gateway.kind, gateway.listen) for gateway in found.services.gateways] == [("prometheus", "127.0.0.1:9100")]
    assert read_device_file("cell.toml", DEVICE + GATEWAY).name == "devices"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "error D005: [[device]] is missing"),
        (DEVICE, "error D005: [gateway.NAME] or [history] is missing"),
        (DEVICE + DEVICE + GATEWAY, "cell.toml:5:1: error D006: there is a [[device]] named 'table' already"),
        (GATEWAY + "[[devise]]\n", "the file has no [devise] (did you mean 'device'?)"),
        (GATEWAY + '[device]\nname = "table"\n', "[device] is a single table"),
        (GATEWAY + '[[device]]\nname = "table"\n', "address is missing"),
        (GATEWAY + '[[device]]\nname = "a table"\naddress = "x"\n', "'a table' is not a name"),
        (GATEWAY + DEVICE + "speed = 3\n", "[device] has no 'speed'"),
    ],
)
def test_mistakes_are_reported(text: str, message: str) -> None:
    with pytest.raises(WorldError) as error:
        read_device_file("cell.toml", text)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("/dev/ttyUSB0,unit=2,config=a.cfg", "/dev/ttyUSB0,unit=2,config=/cell/a.cfg"),
        ("COM3, config=/b/a.cfg", "COM3,config=/b/a.cfg"),
        (
            "tls://host:802?certificate=a.pem&key=keys/a%20b.pem&trusted=/c.pem,unit=3",
            "tls://host:802?certificate=/cell/a.pem&key=/cell/keys/a+b.pem&trusted=/c.pem,unit=3",
        ),
    ],
)
def test_files_of_an_address_are_beside_the_file(address: str, found: str) -> None:
    assert DeviceSpec(name="table", address=address).beside(Path("/cell")).address == found
