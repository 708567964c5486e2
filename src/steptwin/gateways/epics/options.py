"""``[gateway.epics]``: its keys."""

from __future__ import annotations

import re
from typing import Any, ClassVar

from steptwin.access.roles import ROLES
from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.gateways.options import GatewaySpec, listens, samples, shows
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import address_value, permitting, word


@permitting("HOST:PORT")
def _beacons(value: Any) -> str:
    if address_value(value).endswith(":0"):
        raise Misuse(f"{value!r}: the port for beacons is 1 to 65535, usually 5065, of PV Access 5076")
    return value


@permitting("HOST:PORT")
def _pv_access(value: Any) -> str:
    if address_value(value).endswith(":65535"):
        raise Misuse(f"{value!r}: the port is at most 65534, because the next one is for searches")
    return value


_RECORD_NAME = re.compile(r"[A-Za-z0-9_:;<>\[\]-]*\Z")


@permitting("letters from A to Z, digits and _-:;<>[]")
def _prefix(value: Any) -> str:
    if not isinstance(value, str) or not _RECORD_NAME.match(value):
        raise Misuse(f"{value!r}: names of records have letters from A to Z, digits and _-:;<>[]")
    return value


@table("[gateway.epics]")
class EpicsSpec(GatewaySpec):
    extra: ClassVar[str] = "epics"
    listen: str = listens("127.0.0.1:5064")
    prefix: str = key(_prefix, "with what names of records begin; those of controllers follow", default="")
    beacons: str = key(_beacons, "HOST:PORT to which the server announces itself", default="127.0.0.1:5065")
    pva: str | None = key(
        _pv_access, "HOST:PORT for PV Access besides, usually 127.0.0.1:5075; searches at the next port", default=None
    )
    pva_beacons: str = key(
        _beacons, "HOST:PORT to which the server of PV Access announces itself", default="127.0.0.1:5076", needs="pva"
    )
    interval: Nanos = samples("how often values that clients have asked for are read")
    registers: tuple[str, ...] = shows()
    role: str | None = key(word(*ROLES), "role of all clients", default=None)
    """The protocols know no more of clients than names. None: engineer where only this computer is served, otherwise viewer."""
