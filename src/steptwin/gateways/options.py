"""Options of gateways: what ``[gateway.NAME]`` of a description may contain.

Each gateway has its own in ``gateways/NAME/options.py``. These modules import no library, so that descriptions are checked and
edited where it is not installed.
"""

from __future__ import annotations

from typing import ClassVar

from steptwin.controller import MILLISECOND, Nanos
from steptwin.simulation.describe.servicetables import GATEWAY
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import address_value, positive_time, texts


@table()
class GatewaySpec(TableSpec):
    """A table ``[gateway.NAME]`` with its values. What serves it is ``make`` in ``gateways/NAME/gateway.py``."""

    extra: ClassVar[str] = ""
    """The extra of the package with its libraries; empty where it needs none."""
    listen: str | None = None
    """HOST:PORT where it is reached; None for one that only connects to others."""
    file: str = ""
    """The name of the file with the description."""

    @property
    def kind(self) -> str:
        return name_of(type(self))


def name_of(spec: type[GatewaySpec]) -> str:
    """NAME of ``[gateway.NAME]``."""
    return spec.rows.written.removeprefix(f"[{GATEWAY}.").removesuffix("]")


def listens(default: str) -> str:
    """The key ``listen``."""
    return key(address_value, "HOST:PORT where it is reached", default=default)


def samples(meaning: str) -> Nanos:
    """The key ``interval``, ns."""
    return key(positive_time, meaning, default=100 * MILLISECOND)


def shows() -> tuple[str, ...]:
    """The key ``registers``."""
    return key(texts, "further points to show: CONTROLLER.POINT, such as table.USER_REGISTER[5]", default=())
