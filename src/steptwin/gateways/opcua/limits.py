"""How much one request may ask for, so that the world goes on meanwhile."""

from __future__ import annotations

from asyncua import Server, ua

MOST_READ = 1000
"""Nodes in a read (MaxNodesPerRead)."""
AT_ONCE = 100
"""Values that are read or shown before others get their turn."""


async def tell_limits(server: Server) -> None:
    """Show clients what this server permits; the library says 10 000."""
    node = server.get_node(ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerRead)
    await node.write_value(ua.Variant(MOST_READ, ua.VariantType.UInt32))
