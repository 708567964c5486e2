"""Which variables get another value from a sample."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AttributeValue
from asyncua.server.server import Server
from gateway_rig import GatewayWorld

from steptwin.gateways.opcua.addressspace import NAMESPACE_URI, AddressSpaceBuilder, node_id
from steptwin.gateways.opcua.nodes import NodeMaker
from steptwin.gateways.opcua.service import NodeService, WatchedNode, WatchedNodes
from steptwin.gateways.opcua.session import GatewayServer
from steptwin.gateways.points import GatewayPoint, PointValue, points_of
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.simulation.script.steps import Set

WATCHED = ("pins.IN3", "pins.IN4", "M1.position", "program.state")


class Rig:
    def __init__(self) -> None:
        self.world = GatewayWorld('[[mic488]]\nname = "table"\n')
        self.sampler = Sampler(self.world, {})
        self.nodes = WatchedNodes()
        points = {point.name: point for point in points_of(self.world.description.machines[0], self.world.description)}
        self.all_of: dict[str, tuple[GatewayPoint, Any]] = {
            name: (points[name], AttributeValue(ua.DataValue())) for name in WATCHED
        }
        self.notified: list[Any] = []
        for point, attribute in self.all_of.values():
            attribute.datachange_callbacks[1] = self._notified
            self.nodes.add(point, attribute)

    async def _notified(self, handle: int, value: Any) -> None:
        self.notified.append((handle, value.Value.Value))

    def sample(self) -> Sample:
        return asyncio.run(self.sampler.take("table"))

    def changes(self) -> dict[str, PointValue]:
        found: Iterator[tuple[WatchedNode, PointValue]] = self.nodes.changes(self.sample())
        return {node.point.name: value for node, value in found}


def test_only_what_has_changed() -> None:
    rig = Rig()
    assert rig.changes() == {"pins.IN3": 0.0, "pins.IN4": 0.0, "M1.position": 0.0, "program.state": "stopped"}
    assert rig.changes() == {}
    rig.world.inner.do(Set((("table", "IN3", 1.0),)))
    assert rig.changes() == {"pins.IN3": 1.0}
    rig.nodes.add(*rig.all_of["pins.IN4"])
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
    for name in ("pins.IN4", "M1.position", "program.state"):
        rig.all_of[name][1].datachange_callbacks.clear()
    assert rig.nodes.keep_followed()
    assert rig.changes() == {"pins.IN3": 0.0}
    rig.all_of["pins.IN3"][1].datachange_callbacks.clear()
    assert not rig.nodes.keep_followed()


def test_who_follows_is_told_and_who_reads_gets_the_same_value() -> None:
    rig = Rig()
    sample = rig.sample()
    for node, value in rig.nodes.changes(sample):
        asyncio.run(node.notify(sample, value))
    assert rig.notified == [(1, False), (1, False), (1, 0.0), (1, "stopped")]
    assert rig.all_of["program.state"][1].value.Value.Value == "stopped"


def test_who_follows_a_variable_is_told_what_it_is_after_somebody_has_read_it() -> None:
    """It was another value for a moment, in which it was read."""
    world = GatewayWorld('[[mic488]]\nname = "table"\n')
    told: list[object] = []

    async def notified(_: int, value: ua.DataValue) -> None:
        told.append(None if value.Value is None else value.Value.Value)

    async def scene() -> None:
        server = Server(GatewayServer())
        await server.init()
        await server.register_namespace(NAMESPACE_URI)
        space = server.iserver.aspace
        builder = AddressSpaceBuilder(world.description, {})
        maker = NodeMaker(space)
        maker.add(builder.items)
        maker.refer(builder.references)
        service = NodeService(space, world, Sampler(world, {}), builder.points, builder.methods, builder.arrays, None)
        await service.refresh_all()
        node = node_id("table.pins.IN3")
        attribute = space[node].attributes[ua.AttributeIds.Value]
        attribute.datachange_callbacks[1] = notified
        service.watch([node])
        await service.publish(1.0)
        world.inner.do(Set((("table", "IN3", 1.0),)))
        await service.refresh([node])
        world.inner.do(Set((("table", "IN3", 0.0),)))
        for _ in range(3):
            await service.publish(0.2)
        assert attribute.value is not None
        assert attribute.value.Value is not None
        assert attribute.value.Value.Value is False
        service.close()

    asyncio.run(scene())
    assert told == [False, True, False]
