"""``[gateway.opcua]``: its keys."""

from __future__ import annotations

from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.gateways.options import GatewaySpec, listens, samples, shows
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import text_value, word


@table("[gateway.opcua]")
class OpcUaSpec(GatewaySpec):
    """Files are relative to the description."""

    extra: ClassVar[str] = "opcua"
    listen: str = listens("127.0.0.1:4840")
    interval: Nanos = samples("how often values that clients subscribe to are read")
    registers: tuple[str, ...] = shows()
    security: str = key(word("none", "sign", "encrypt"), "what connections need at least", default="none")
    certificate: str | None = key(text_value, "file with the certificate of the server, PEM", default=None, needs="key")
    its_key: str | None = key(text_value, "file with its key, PEM", name="key", default=None, needs="certificate")
    trusted: str | None = key(
        text_value, "folder with certificates of clients; only these are admitted", default=None, needs="certificate"
    )
    tokens: str | None = key(text_value, "file with lines ROLE NAME TOKEN; the token is the password of a user", default=None)
