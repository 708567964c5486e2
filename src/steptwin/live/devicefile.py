"""The file of ``steptwin bridge``: devices, the gateways through which other programs see them, and their history."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit

from steptwin.services import Services, read_services
from steptwin.simulation.describe.servicetables import GATEWAY, HISTORY
from steptwin.simulation.toml.reader import Key, TomlText, optional, read_table
from steptwin.simulation.toml.values import name_value, text_value

DEVICE, BRIDGE = "device", "bridge"
DEVICE_KEYS = (
    Key("name", name_value, "how it is called in gateways"),
    Key("address", text_value, "where it is: as --device of other commands, such as /dev/ttyUSB0,unit=2"),
)
BRIDGE_KEYS = (optional(name_value, "name", "how the devices are called together", "devices"),)


@dataclass(frozen=True, slots=True)
class DeviceSpec:
    name: str
    address: str

    def beside(self, folder: Path) -> DeviceSpec:
        """The same, with files in its address relative to ``folder``."""
        place, *options = self.address.split(",")
        if place.startswith("tls://"):
            parts = urlsplit(place)
            files = {name: str(folder / value) for name, value in parse_qsl(parts.query)}
            place = parts._replace(query=urlencode(files, safe="/")).geturl()
        moved = [f"config={folder / one.strip()[7:]}" if one.strip().startswith("config=") else one for one in options]
        return DeviceSpec(self.name, ",".join([place, *moved]))


@dataclass(frozen=True, slots=True)
class DeviceFile:
    name: str
    devices: tuple[DeviceSpec, ...]
    services: Services


def read_device_file(name: str, text: str) -> DeviceFile:
    """The file ``name`` with this text. Raises `WorldError` with everything that is wrong with it."""
    toml = TomlText(name, text)
    known = (DEVICE, BRIDGE, GATEWAY, HISTORY)
    for key in toml.data:
        if key not in known:
            fix = toml.key_replacement((key,), key, list(known))
            toml.wrong(
                (key,), "D004", f"the file has no [{key}]{toml.near(key, list(known))}", f"permitted: {', '.join(known)}", fix
            )
    whole = read_table(toml, (BRIDGE,), toml.data.get(BRIDGE, {}), BRIDGE_KEYS)
    devices, services = tuple(_devices(toml)), read_services(toml)
    for what, is_there in ((f"[[{DEVICE}]]", devices), (f"[{GATEWAY}.NAME] or [{HISTORY}]", services != Services((), None))):
        if not is_there and not toml.findings:
            toml.wrong((), "D005", f"{what} is missing")
    toml.check()
    return DeviceFile(whole["name"], devices, services)


def _devices(toml: TomlText) -> Iterator[DeviceSpec]:
    given = toml.data.get(DEVICE, [])
    if not isinstance(given, list):
        toml.wrong((DEVICE,), "D002", f"[{DEVICE}] stands once", f"expected [[{DEVICE}]], for there may be several")
        return
    names: set[str] = set()
    for number, table in enumerate(given):
        values = read_table(toml, (DEVICE, number), table, DEVICE_KEYS)
        if "name" not in values or "address" not in values:
            continue
        if values["name"] in names:
            toml.wrong((DEVICE, number, "name"), "D006", f"there is a [[{DEVICE}]] named {values['name']!r} already")
        names.add(values["name"])
        yield DeviceSpec(**values)
