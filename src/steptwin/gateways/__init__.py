"""Gateways: protocols through which other programs see a subject, by its static description alone.

Each kind has a file here and a table in `steptwin.world.gateways`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, cast

from steptwin.errors import Misuse
from steptwin.gateways.contract import Gateway, GatewaySubject
from steptwin.tables import complete
from steptwin.world.gateways import GATEWAYS, GatewaySpec


class _Kind(NamedTuple):
    module: str
    """Imported when a description has such a gateway. Its ``make`` makes one."""
    extra: str
    """What installs its libraries."""


KINDS: Mapping[str, _Kind] = complete(
    "gateway",
    GATEWAYS,
    "kind",
    {
        "prometheus": _Kind("steptwin.gateways.prometheus", "metrics"),
        "opcua": _Kind("steptwin.gateways.opcua.gateway", "opcua"),
    },
)


def make_gateway(spec: GatewaySpec, subject: GatewaySubject, folder: Path) -> Gateway:
    """The gateway that a table of a description in ``folder`` describes; `Gateway.open` opens it. Raises `Misuse` if a library is
    missing."""
    kind = KINDS[spec.kind]
    try:
        make = cast("Callable[[GatewaySpec, GatewaySubject, Path], Gateway]", import_module(kind.module).make)
    except ImportError as error:
        where = f"[gateway.{spec.kind}]"
        raise Misuse(f"{where} needs {error.name}: pip install 'steptwin[{kind.extra}]'") from None
    return make(spec, subject, folder)
