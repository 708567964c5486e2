"""The file of ``steptwin bridge``: devices, the gateways through which other programs see them, and their history."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit

from steptwin.services import Services, read_services
from steptwin.simulation.describe.servicetables import GATEWAY, HISTORY
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, read_spec, table
from steptwin.simulation.toml.values import name_value, text_value

DEVICE, BRIDGE = "device", "bridge"


@table(f"[[{DEVICE}]]")
class DeviceSpec(TableSpec):
    name: str = key(name_value, "how it is called in gateways")
    address: str = key(text_value, "where it is: as --device of other commands, such as /dev/ttyUSB0,unit=2")

    def beside(self, folder: Path) -> DeviceSpec:
        """The same, with files in its address relative to ``folder``."""
        place, *options = self.address.split(",")
        if place.startswith("tls://"):
            parts = urlsplit(place)
            files = {name: str(folder / value) for name, value in parse_qsl(parts.query)}
            place = parts._replace(query=urlencode(files, safe="/")).geturl()
        moved = [f"config={folder / one.strip()[7:]}" if one.strip().startswith("config=") else one for one in options]
        return replace(self, address=",".join([place, *moved]))


@table(f"[{BRIDGE}]")
class BridgeTable(TableSpec):
    name: str = key(name_value, "how the devices are called together", default="devices")


@dataclass(frozen=True, kw_only=True)
class DeviceFile(BridgeTable):
    devices: tuple[DeviceSpec, ...]
    services: Services


def read_device_file(name: str, text: str) -> DeviceFile:
    """The file ``name`` with this text. Raises `WorldError` with everything that is wrong with it."""
    toml = TomlText(name, text)
    known = (DEVICE, BRIDGE, GATEWAY, HISTORY)
    for kind in toml.data:
        if kind not in known:
            fix, near = toml.key_replacement((kind,), kind, list(known)), toml.near(kind, list(known))
            toml.wrong((kind,), "D004", f"the file has no [{kind}]{near}", f"permitted: {', '.join(known)}", fix)
    bridge = read_spec(toml, (BRIDGE,), BridgeTable, toml.data.get(BRIDGE, {})) or BridgeTable()
    devices, services = tuple(_devices(toml)), read_services(toml)
    for what, is_there in ((f"[[{DEVICE}]]", devices), (f"[{GATEWAY}.NAME] or [{HISTORY}]", services != Services((), None))):
        if not is_there and not toml.findings:
            toml.wrong((), "D005", f"{what} is missing")
    toml.check()
    return DeviceFile(name=bridge.name, devices=devices, services=services)


def _devices(toml: TomlText) -> Iterator[DeviceSpec]:
    given = toml.data.get(DEVICE, [])
    if not isinstance(given, list):
        toml.wrong((DEVICE,), "D002", f"[{DEVICE}] is a single table", f"expected [[{DEVICE}]], for there may be several")
        return
    names: set[str] = set()
    for number, one in enumerate(given):
        device = read_spec(toml, (DEVICE, number), DeviceSpec, one)
        if device is None:
            continue
        if device.name in names:
            toml.wrong((*device.path, "name"), "D006", f"there is a [[{DEVICE}]] named {device.name!r} already")
        names.add(device.name)
        yield device
