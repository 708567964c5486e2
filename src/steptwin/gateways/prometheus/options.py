"""``[gateway.prometheus]``: its keys."""

from __future__ import annotations

from typing import ClassVar

from steptwin.gateways.options import GatewaySpec, listens
from steptwin.simulation.toml.table import table


@table("[gateway.prometheus]")
class PrometheusSpec(GatewaySpec):
    extra: ClassVar[str] = "metrics"
    listen: str = listens("127.0.0.1:9488")
