"""``[gateway.mqtt]``: its keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from steptwin.access.roles import ROLES
from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.gateways.options import GatewaySpec, samples, shows
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import address_value, flag, permitting, text_value, whole, whole_seconds, word


@dataclass(frozen=True, slots=True, kw_only=True)
class SparkplugSpec:
    """Sparkplug B: ``group`` and ``node`` are ids of topics, ``host`` the primary host that is waited for, None without."""

    group: str
    node: str
    host: str | None = None


@permitting("HOST:PORT")
def _broker(value: Any) -> str:
    if address_value(value).endswith(":0"):
        raise Misuse(f"{value!r}: the port of a broker is 1 to 65535, usually 1883")
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


@table("[gateway.mqtt]")
class MqttSpec(GatewaySpec):
    """Files are relative to the description."""

    extra: ClassVar[str] = "mqtt"
    broker: str = key(_broker, "HOST:PORT of the broker", default="127.0.0.1:1883")
    topic: str = key(_topic, "with what topics begin; the name of the world follows", default="steptwin", excludes=("sparkplug",))
    interval: Nanos = samples("how often values are read")
    registers: tuple[str, ...] = shows()
    keep_alive: Nanos = key(whole_seconds, "after how long a broker that is silent is given up", default=15 * SECOND)
    store: int = key(whole(1, 1_000_000), "events, with sparkplug values, that are kept while it is away", default=4096)
    user: str | None = key(text_value, "name of the user for the broker", default=None)
    password_file: str | None = key(text_value, "file with the password", default=None, needs="user")
    password_variable: str | None = key(
        text_value,
        "variable of the environment with the password",
        default=None,
        needs="user",
        excludes=("password_file",),
    )
    tls: bool = key(flag, "whether the connection is encrypted", default=False)
    ca: str | None = key(
        text_value,
        "file with the authorities of the broker's certificate, PEM; the system's without",
        default=None,
        needs="tls",
    )
    certificate: str | None = key(text_value, "file with the certificate of this client, PEM", default=None, needs="key")
    its_key: str | None = key(text_value, "file with its key, PEM", name="key", default=None, needs="certificate")
    tokens: str | None = key(
        text_value, "file with lines ROLE NAME TOKEN; commands have a token", default=None, excludes=("sparkplug",)
    )
    role: str | None = key(word(*ROLES), "role of commands without a token; viewer without", default=None)
    """None: engineer where broker and clients are on this computer, otherwise viewer."""
    discovery: str | None = key(
        word("homeassistant"),
        "announces the topics to this program, which then shows them by itself",
        default=None,
        excludes=("sparkplug",),
    )
    sparkplug: SparkplugSpec | None = key(
        _sparkplug, "{ group, node, host }: Sparkplug B instead of JSON; host is the primary host", default=None
    )
