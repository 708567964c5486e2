"""``[gateway.NAME]``: protocols through which other programs see the controllers of a world.

The tables are here; what serves them is in `steptwin.gateways`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, SECOND, Nanos
from steptwin.simulation.toml.reader import Key, TomlText, optional, read_table
from steptwin.simulation.toml.table import TableRows, check_sense
from steptwin.simulation.toml.values import (
    address_value,
    flag,
    permitting,
    positive_time,
    text_value,
    texts,
    whole,
    whole_seconds,
    word,
)

GATEWAY = "gateway"
ROLES = ("viewer", "operator", "engineer")
"""Of `steptwin.access.roles`, which is above this."""
UNNAMED = ("world", "devices")
"""Names of worlds and device files that have been given none."""
APPLICATION_URI = "urn:steptwin:opcua"
"""Of the OPC UA server; its certificate has it, too (OPC 10000-6, 6.2.2)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GatewaySpec:
    """A gateway as its table describes it; each kind with further keys has a class of its own."""

    kind: str
    listen: str | None = None
    """HOST:PORT where it is reached; None for one that only connects to others."""
    file: str = ""
    """The name of the file with the description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ListeningSpec(GatewaySpec):
    listen: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OpcUaSpec(ListeningSpec):
    """Files are relative to the description."""

    interval: Nanos
    """How often values that clients subscribe to are looked at, ns."""
    registers: tuple[str, ...]
    """Further points to show: ``MACHINE.POINT``."""
    security: str
    """What connections need at least: ``none``, ``sign``, ``encrypt``."""
    certificate: str | None
    key: str | None
    """Of the server, both PEM."""
    trusted: str | None
    """A folder with the certificates of clients that are admitted; all are where it is None."""
    tokens: str | None
    """A file with tokens (`steptwin.access.tokens`), which are passwords of users."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SparkplugSpec:
    """Sparkplug B: ``group`` and ``node`` are ids of topics, ``host`` the primary host that is waited for, None without."""

    group: str
    node: str
    host: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MqttSpec(GatewaySpec):
    """Files are relative to the description."""

    broker: str
    """HOST:PORT."""
    topic: str
    """With what topics begin."""
    interval: Nanos
    """How often values are looked at, ns."""
    registers: tuple[str, ...]
    """Further points to show: ``MACHINE.POINT``."""
    keep_alive: Nanos
    """After how long a broker that is silent is given up, ns."""
    store: int
    """How many events, of Sparkplug values, are kept while the broker is away."""
    user: str | None
    password_file: str | None
    password_variable: str | None
    """Of the environment."""
    tls: bool
    ca: str | None
    certificate: str | None
    key: str | None
    """Of this client, both PEM."""
    tokens: str | None
    """A file with tokens (`steptwin.access.tokens`), which commands have."""
    role: str | None
    """Of commands without a token; None: engineer where broker and clients are on this computer, otherwise viewer."""
    discovery: str | None
    sparkplug: SparkplugSpec | None


@dataclass(frozen=True, slots=True, kw_only=True)
class EpicsSpec(ListeningSpec):
    prefix: str
    """With what names of records begin."""
    beacons: str
    """HOST:PORT to which the server announces itself."""
    pva: str | None
    """HOST:PORT where the same records are served over PV Access, None: not at all."""
    pva_beacons: str
    """HOST:PORT to which that server announces itself."""
    interval: Nanos
    """How often values are looked at that clients have asked for, ns."""
    registers: tuple[str, ...]
    """Further points to show: ``MACHINE.POINT``."""
    role: str | None
    """Of clients, of which the protocols know no more than names; None: engineer where only this computer is served,
    otherwise viewer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusSpec(ListeningSpec):
    units: Mapping[str, int]
    """Of controllers by name, for those that have another one here than on their line."""
    role: str | None
    """Of masters; None: engineer where only this computer is served, otherwise viewer."""


class _GatewayReader(NamedTuple):
    rows: TableRows
    make: Callable[..., GatewaySpec]


def _rows(kind: str, listen: str, *keys: Key, need: Mapping[str, str] | None = None) -> TableRows:
    where = optional(address_value, "listen", "HOST:PORT where it is reached", listen)
    return TableRows(written=f"[{GATEWAY}.{kind}]", keys=(where, *keys), need=need or {})


@permitting("HOST:PORT")
def _broker(value: Any) -> str:
    if address_value(value).endswith(":0"):
        raise Misuse(f"{value!r}: the port of a broker is 1 to 65535, usually 1883")
    return value


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


@permitting("text without + and #, not from / or to /")
def _topic(value: Any) -> str:
    if any(sign in text_value(value) for sign in "+#\0") or value.startswith(("/", "$")) or value.endswith("/"):
        raise Misuse(f"{value!r}: a topic has no + and #, and begins and ends without /")
    return value


def _id(value: Any) -> str:
    if any(sign in text_value(value) for sign in "+/#\0"):
        raise Misuse(f"{value!r}: an id of Sparkplug has no +, / and #")
    return value


_RECORD_NAME = re.compile(r"[A-Za-z0-9_:;<>\[\]-]*\Z")


@permitting("letters from A to Z, digits and _-:;<>[]")
def _prefix(value: Any) -> str:
    if not isinstance(value, str) or not _RECORD_NAME.match(value):
        raise Misuse(f"{value!r}: names of records have letters from A to Z, digits and _-:;<>[]")
    return value


_SPARKPLUG_KEYS = {"group": True, "node": True, "host": False}
"""And whether they are required."""


@permitting("{ group = text, node = text, host = text }")
def _sparkplug(value: Any) -> SparkplugSpec:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected {{ group = ..., node = ... }}")
    for name in value:
        if name not in _SPARKPLUG_KEYS:
            raise Misuse(f"there is no {name!r}; permitted are {', '.join(_SPARKPLUG_KEYS)}")
    for name, is_required in _SPARKPLUG_KEYS.items():
        if is_required and name not in value:
            raise Misuse(f"{name} is missing: expected {{ group = ..., node = ... }}")
    return SparkplugSpec(**{name: _id(given) for name, given in value.items()})


MOST_UNIT = 247


@permitting("{ CONTROLLER = whole number, ... }")
def _units(value: Any) -> Mapping[str, int]:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected {{ CONTROLLER = UNIT, ... }}")
    for name, unit in value.items():
        if not isinstance(unit, int) or isinstance(unit, bool) or not 1 <= unit <= MOST_UNIT:
            raise Misuse(f"{name} = {unit!r}: units are 1 to {MOST_UNIT}")
    return dict(value)


_KINDS: Mapping[str, _GatewayReader] = {
    "prometheus": _GatewayReader(_rows("prometheus", "127.0.0.1:9488"), ListeningSpec),
    "opcua": _GatewayReader(
        _rows(
            "opcua",
            "127.0.0.1:4840",
            optional(positive_time, "interval", "how often values are looked at that clients subscribe to", 100 * MILLISECOND),
            optional(texts, "registers", "further points to show: MACHINE.POINT, such as table.USER_REGISTER[5]", ()),
            optional(word("none", "sign", "encrypt"), "security", "what connections need at least", "none"),
            optional(text_value, "certificate", "file with the certificate of the server, PEM"),
            optional(text_value, "key", "file with its key, PEM"),
            optional(text_value, "trusted", "folder with certificates of clients; only these are admitted"),
            optional(text_value, "tokens", "file with lines ROLE NAME TOKEN; the token is the password of a user"),
            need={"certificate": "key", "key": "certificate", "trusted": "certificate"},
        ),
        OpcUaSpec,
    ),
    "epics": _GatewayReader(
        _rows(
            "epics",
            "127.0.0.1:5064",
            optional(_prefix, "prefix", "with what names of records begin; those of controllers follow", ""),
            optional(_beacons, "beacons", "HOST:PORT to which the server announces itself", "127.0.0.1:5065"),
            optional(_pv_access, "pva", "HOST:PORT for PV Access besides, usually 127.0.0.1:5075; searches at the next port"),
            optional(_beacons, "pva_beacons", "HOST:PORT to which the server of PV Access announces itself", "127.0.0.1:5076"),
            optional(positive_time, "interval", "how often values are looked at that clients have asked for", 100 * MILLISECOND),
            optional(texts, "registers", "further points to show: MACHINE.POINT, such as table.USER_REGISTER[5]", ()),
            optional(word(*ROLES), "role", "role of all clients"),
            need={"pva_beacons": "pva"},
        ),
        EpicsSpec,
    ),
    "modbus": _GatewayReader(
        _rows(
            "modbus",
            "127.0.0.1:5020",
            optional(_units, "units", "{ CONTROLLER = UNIT } of those that have another one here than on their line", {}),
            optional(word(*ROLES), "role", "role of all masters"),
        ),
        ModbusSpec,
    ),
    "mqtt": _GatewayReader(
        TableRows(
            written=f"[{GATEWAY}.mqtt]",
            keys=(
                optional(_broker, "broker", "HOST:PORT of the broker", "127.0.0.1:1883"),
                optional(_topic, "topic", "with what topics begin; the name of the world follows", "steptwin"),
                optional(positive_time, "interval", "how often values are looked at", 100 * MILLISECOND),
                optional(texts, "registers", "further points to show: MACHINE.POINT, such as table.USER_REGISTER[5]", ()),
                optional(whole_seconds, "keep_alive", "after how long a broker that is silent is given up", 15 * SECOND),
                optional(whole(1, 1_000_000), "store", "events, with sparkplug values, that are kept while it is away", 4096),
                optional(text_value, "user", "name of the user for the broker"),
                optional(text_value, "password_file", "file with the password"),
                optional(text_value, "password_variable", "variable of the environment with the password"),
                optional(flag, "tls", "whether the connection is encrypted", False),
                optional(text_value, "ca", "file with the authorities of the broker's certificate, PEM; the system's without"),
                optional(text_value, "certificate", "file with the certificate of this client, PEM"),
                optional(text_value, "key", "file with its key, PEM"),
                optional(text_value, "tokens", "file with lines ROLE NAME TOKEN; commands have a token"),
                optional(word(*ROLES), "role", "role of commands without a token; viewer without"),
                optional(
                    word("homeassistant"), "discovery", "announces the topics to this program, which then shows them by itself"
                ),
                optional(_sparkplug, "sparkplug", "{ group, node, host }: Sparkplug B instead of JSON; host is the primary host"),
            ),
            need={
                "ca": "tls",
                "certificate": "key",
                "key": "certificate",
                "password_file": "user",
                "password_variable": "user",
            },
            exclude=(
                ("password_file", "password_variable"),
                ("sparkplug", "topic"),
                ("sparkplug", "discovery"),
                ("sparkplug", "tokens"),
            ),
        ),
        MqttSpec,
    ),
}

GATEWAYS: Mapping[str, TableRows] = {name: kind.rows for name, kind in _KINDS.items()}
"""The tables of each kind of gateway."""


def read_gateways(text: TomlText) -> Iterator[GatewaySpec]:
    """The gateways of a description; errors are added to ``text``."""
    given = text.data.get(GATEWAY, {})
    if not isinstance(given, Mapping):
        text.wrong((GATEWAY,), "D002", f"[{GATEWAY}] is {given!r}", f"expected tables: {_written()}")
        return
    for kind, table in given.items():
        path = (GATEWAY, kind)
        if kind in GATEWAYS:
            rows = GATEWAYS[kind]
            values = read_table(text, path, table, rows.keys)
            check_sense(text, path, rows, table)
            yield _KINDS[kind].make(kind=kind, file=text.source.name, **values)
        else:
            fix = text.key_replacement(path, kind, list(GATEWAYS))
            near = text.near(kind, list(GATEWAYS))
            text.wrong(path, "D004", f"there is no [{GATEWAY}.{kind}]{near}", f"permitted: {_written()}", fix)


def _written() -> str:
    return ", ".join(rows.written for rows in GATEWAYS.values())
