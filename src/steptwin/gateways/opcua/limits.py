"""How much one request may ask for, so that the world goes on meanwhile."""

from __future__ import annotations

from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace

from steptwin.gateways.opcua.nodetypes import standard

MOST_READ = 1000
"""Nodes in a read (MaxNodesPerRead)."""
AT_ONCE = 100
"""Values that are read or shown before others get their turn."""


async def tell_limits(space: AddressSpace) -> None:
    """Show clients what this server permits; the library says 10 000."""
    node: Any = standard(ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerRead)
    await space.write_attribute_value(node, ua.AttributeIds.Value, ua.DataValue(ua.Variant(MOST_READ, ua.VariantType.UInt32)))
