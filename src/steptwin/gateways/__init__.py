"""Gateways: protocols through which other programs see a subject, by its static description alone.

Each kind has a file here and a table in `steptwin.simulation.describe.gateways`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, cast

from steptwin.extras import libraries_of, missing
from steptwin.gateways.contract import Gateway, GatewaySubject
from steptwin.simulation.describe.gateways import GATEWAYS, GatewaySpec
from steptwin.tables import complete


class _GatewayModule(NamedTuple):
    module: str
    """Imported when a description has such a gateway. Its ``make`` makes one."""
    extra: str
    """What installs its libraries."""


KINDS: Mapping[str, _GatewayModule] = complete(
    "gateway",
    GATEWAYS,
    "kind",
    {
        "prometheus": _GatewayModule("steptwin.gateways.prometheus", "metrics"),
        "opcua": _GatewayModule("steptwin.gateways.opcua.gateway", "opcua"),
        "epics": _GatewayModule("steptwin.gateways.epics.gateway", "epics"),
        "modbus": _GatewayModule("steptwin.gateways.modbus", ""),
        "mqtt": _GatewayModule("steptwin.gateways.mqtt.gateway", "mqtt"),
    },
)


def make_gateway(spec: GatewaySpec, subject: GatewaySubject, folder: Path) -> Gateway:
    """The gateway that a table of a description in ``folder`` describes; `Gateway.open` opens it. Raises `Misuse` if a library is
    missing."""
    kind = KINDS[spec.kind]
    try:
        make = cast("Callable[[GatewaySpec, GatewaySubject, Path], Gateway]", import_module(kind.module).make)
    except ImportError:
        raise missing(f"[gateway.{spec.kind}]", libraries_of(kind.extra)) from None
    return make(spec, subject, folder)
