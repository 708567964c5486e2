"""Which variables get another value from a sample."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any, cast

from asyncua import Server
from gateway_rig import GatewayWorld

from steptwin.gateways.opcua.addressspace import NAMESPACE_URI, AddressSpaceBuilder, PointNode, node_id
from steptwin.gateways.opcua.service import NodeService, WatchedNodes
from steptwin.gateways.points import PointValue, points_of
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.simulation.script.steps import Set

WATCHED = ("pins.IN3", "pins.IN4", "M1.position", "program.state")


class Seen:
    def __init__(self) -> None:
        self.values: list[object] = []

    def datachange_notification(self, node: object, value: object, data: object) -> None:
        self.values.append(value)


class Rig:
    def __init__(self) -> None:
        self.world = GatewayWorld('[[mic488]]\nname = "table"\n')
        self.sampler = Sampler(self.world.samples, {})
        self.nodes = WatchedNodes()
        points = {point.name: point for point in points_of(self.world.description.controllers[0], self.world.description)}
        self.all_of = {name: PointNode(node_id(f"table.{name}"), points[name]) for name in WATCHED}
        for node in self.all_of.values():
            self.nodes.add(node)

    def sample(self) -> Sample:
        return asyncio.run(self.sampler.take("table"))

    def changes(self) -> dict[str, PointValue]:
        found: Iterator[tuple[PointNode, PointValue]] = self.nodes.changes(self.sample())
        return {node.point.name: value for node, value in found}


def test_only_what_has_changed() -> None:
    rig = Rig()
    assert rig.changes() == {"pins.IN3": 0.0, "pins.IN4": 0.0, "M1.position": 0.0, "program.state": "stopped"}
    assert rig.changes() == {}
    rig.world.inner.do(Set((("table", "IN3", 1.0),)))
    assert rig.changes() == {"pins.IN3": 1.0}
    rig.nodes.add(rig.all_of["pins.IN4"])
    assert rig.changes() == {}


def test_what_is_not_known_and_is_known_again() -> None:
    rig = Rig()
    rig.changes()
    rig.world.silent.add("table")
    assert rig.changes() == dict.fromkeys(WATCHED)
    rig.world.silent.clear()
    assert set(rig.changes()) == set(WATCHED)


def test_what_nobody_follows_is_left_out() -> None:
    rig = Rig()
    assert rig.nodes.keep({rig.all_of["pins.IN3"].id})
    assert rig.changes() == {"pins.IN3": 0.0}
    assert not rig.nodes.keep(())


def test_who_follows_a_variable_is_told_what_it_is_after_somebody_has_read_it() -> None:
    """It was another value for a moment, in which it was read."""
    world = GatewayWorld('[[mic488]]\nname = "table"\n')
    seen = Seen()

    async def scene() -> None:
        server = Server()
        await server.init()
        await server.register_namespace(NAMESPACE_URI)
        builder = AddressSpaceBuilder(world.description, {})
        await builder.add_to(server)
        service = NodeService(server, world, Sampler(world.samples, {}), builder, None)
        await service.refresh_all()
        node = node_id("table.pins.IN3")
        subscription = await server.create_subscription(0, cast("Any", seen))
        await subscription.subscribe_data_change(server.get_node(node))
        service.watch([node])
        await service.publish(1.0)
        world.inner.do(Set((("table", "IN3", 1.0),)))
        await service.refresh([node])
        world.inner.do(Set((("table", "IN3", 0.0),)))
        for _ in range(3):
            await service.publish(0.2)
        value = server.read_attribute_value(node).Value
        assert value is not None
        assert value.Value is False
        service.close()
        await subscription.delete()
        await server.iserver.isession.close_session()

    asyncio.run(scene())
    assert seen.values == [False, True, False]
