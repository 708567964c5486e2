"""Nodes are those that the library would make."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.server.server import Server
from gateway_rig import GatewayWorld

from steptwin.gateways.opcua.addressspace import NAMESPACE_URI, AddressSpaceBuilder, NodeReference
from steptwin.gateways.opcua.nodes import NodeMaker

HALL = '[[mic488]]\nname = "one"\n[[m1486]]\nname = "two"\n[[axis]]\nname = "x"\ndrive = "one.M1"\npitch = 5\n'


async def space_with(*, by_library: bool) -> AddressSpace:
    world = GatewayWorld(HALL)
    server = Server()
    await server.init()
    await server.register_namespace(NAMESPACE_URI)
    builder = AddressSpaceBuilder(world.description, {"one": ["M1_VMAX"]}, is_kept=True)
    if by_library:
        for result in await server.iserver.isession.add_nodes(builder.items):
            result.StatusCode.check()
        for code in await server.iserver.isession.add_references([_item(one, builder) for one in builder.references]):
            code.check()
    else:
        maker = NodeMaker(server.iserver.aspace)
        maker.add(builder.items)
        maker.refer(builder.references)
        with pytest.raises(AssertionError, match="is there already"):
            NodeMaker(server.iserver.aspace).add(builder.items[:1])
    return server.iserver.aspace


def _item(one: NodeReference, builder: AddressSpaceBuilder) -> ua.AddReferencesItem:
    found = ua.AddReferencesItem()
    found.IsForward = True
    found.ReferenceTypeId, found.SourceNodeId, found.TargetNodeId = one.kind, one.source, one.target
    found.TargetNodeClass = next(item.NodeClass for item in builder.items if item.RequestedNewNodeId == one.target)
    return found


def contents(space: AddressSpace) -> dict[ua.NodeId, tuple[dict[Any, Any], list[Any]]]:
    """Of each node its attributes, without moments, and its references."""
    found = {}
    for node in [*space.keys()]:
        data = space[node]
        values = {key: one.value for key, one in data.attributes.items()}
        found[node] = (
            {key: None if value is None else (value.Value, value.StatusCode) for key, value in values.items()},
            [str(one) for one in data.references],
        )
    return found


def test_they_are_those_of_the_service_of_the_library() -> None:
    expected = contents(asyncio.run(space_with(by_library=True)))
    found = contents(asyncio.run(space_with(by_library=False)))
    assert found.keys() == expected.keys()
    different = [str(node) for node in expected if found[node] != expected[node] and node.NamespaceIndex == 2]
    assert different == []
    assert sum(node.NamespaceIndex == 2 for node in found) > 200
