"""``[gateway.modbus]``: its keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from steptwin.access.roles import ROLES
from steptwin.errors import Misuse
from steptwin.gateways.options import GatewaySpec, listens
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import permitting, word

MOST_UNIT = 247


@permitting("{ CONTROLLER = whole number, ... }")
def _units(value: Any) -> Mapping[str, int]:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected {{ CONTROLLER = UNIT, ... }}")
    for name, unit in value.items():
        if not isinstance(unit, int) or isinstance(unit, bool) or not 1 <= unit <= MOST_UNIT:
            raise Misuse(f"{name} = {unit!r}: units are 1 to {MOST_UNIT}")
    return dict(value)


@table("[gateway.modbus]")
class ModbusSpec(GatewaySpec):
    listen: str = listens("127.0.0.1:5020")
    units: Mapping[str, int] = key(
        _units, "{ CONTROLLER = UNIT } of those that have another one here than on their line", default={}
    )
    role: str | None = key(word(*ROLES), "role of all masters", default=None)
    """None: engineer where only this computer is served, otherwise viewer."""
