"""All gateways: their tables in descriptions, and the gateway that a table describes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, cast

from steptwin.extras import missing
from steptwin.gateways.epics.options import EpicsSpec
from steptwin.gateways.modbus.options import ModbusSpec
from steptwin.gateways.mqtt.options import MqttSpec
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.options import GatewaySpec, name_of
from steptwin.gateways.prometheus.options import PrometheusSpec
from steptwin.simulation.describe.servicetables import GATEWAY, ServiceTable
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import read_spec

if TYPE_CHECKING:
    from steptwin.gateways.contract import Gateway, GatewaySubject

KINDS: Mapping[str, type[GatewaySpec]] = {
    name_of(spec): spec for spec in (PrometheusSpec, OpcUaSpec, EpicsSpec, ModbusSpec, MqttSpec)
}
"""By name, in the order of messages."""


def read_gateways(text: TomlText) -> tuple[GatewaySpec, ...]:
    """The gateways of a description; errors are added to ``text``."""
    return tuple(_read(text))


def _read(text: TomlText) -> Iterator[GatewaySpec]:
    given = text.data.get(GATEWAY, {})
    if not isinstance(given, Mapping):
        text.wrong((GATEWAY,), "D002", f"[{GATEWAY}] is {given!r}", f"expected tables: {_written()}")
        return
    for name, table in given.items():
        path = (GATEWAY, name)
        if name in KINDS:
            spec = read_spec(text, path, KINDS[name], table, file=text.source.name)
            if spec is not None:
                yield spec
        else:
            fix = text.key_replacement(path, name, list(KINDS))
            near = text.near(name, list(KINDS))
            text.wrong(path, "D004", f"there is no [{GATEWAY}.{name}]{near}", f"permitted: {_written()}", fix)


def _written() -> str:
    return ", ".join(spec.rows.written for spec in KINDS.values())


GATEWAY_TABLES = ServiceTable(name=GATEWAY, inner={name: spec.rows for name, spec in KINDS.items()}, check=read_gateways)


def make_gateway(spec: GatewaySpec, subject: GatewaySubject, folder: Path) -> Gateway:
    """The gateway that a table of a description in ``folder`` describes; `Gateway.open` opens it. Raises `Misuse` if a library is
    missing."""
    try:
        module = import_module(f"steptwin.gateways.{spec.kind}.gateway")
    except ImportError:
        raise missing(spec.rows.written, spec.extra) from None
    return cast("Callable[[GatewaySpec, GatewaySubject, Path], Gateway]", module.make)(spec, subject, folder)
