"""Answers to what is supported and what is not (OPC 10000-4, 10000-11), over a socket to the client of asyncua."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

import pytest
from asyncua import Client, Node, ua
from asyncua.ua.ua_binary import struct_from_binary
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.gateways.contract import HistoryValue
from steptwin.gateways.kinds import read_gateways
from steptwin.gateways.opcua.addressspace import node_id
from steptwin.gateways.opcua.gateway import OpcUaGateway
from steptwin.gateways.opcua.limits import MOST_READ
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.opcua.session import ADDITIONAL_INFO
from steptwin.simulation.describe.description import read_world

WORLD = """
[[mic488]]
name = "table"
[gateway.opcua]
listen = "127.0.0.1:0"
registers = ["table.USER_REGISTER[5]"]
"""
VOLTS, TEXT, TRUTH, REGISTER = "pins.AIN1", "status", "pins.IN3", "registers.USER_REGISTER[5]"
ARRAY = "registers.USER_REGISTER"
BEGIN = datetime(2026, 3, 1, tzinfo=UTC)


class StoredHistory:
    """Ten values, one a second, of which the fourth to sixth have the same moment."""

    moments = tuple(BEGIN + timedelta(seconds=n if n not in (4, 5) else 3) for n in range(10))

    async def values(self, point: str, begin: datetime | None, end: datetime | None, most: int | None) -> list[HistoryValue]:
        kept = [HistoryValue(at, float(n)) for n, at in enumerate(self.moments) if end is None or at <= end]
        held = [one for one in kept if begin is not None and one.at < begin]
        return [*held[-1:], *(one for one in kept if begin is None or one.at >= begin)][:most]


def spec(text: str = WORLD) -> OpcUaSpec:
    (found,) = read_gateways(read_world("hall.toml", text).text)
    assert isinstance(found, OpcUaSpec)
    return found


@asynccontextmanager
async def connected(subject: Any) -> AsyncGenerator[Client]:
    gateway = OpcUaGateway(spec(), subject, Path())
    place: Any = await gateway.open(listen_any=False, notice=pytest.fail)
    try:
        async with Client(place["url"], timeout=60) as client:
            yield client
    finally:
        await gateway.close()


def node(client: Client, name: str) -> Node:
    return client.get_node(f"ns=2;s=table.{name}")


async def write(found: Node, value: float) -> None:
    """Without the time stamps that the client adds."""
    await found.write_attribute(ua.AttributeIds.Value, ua.DataValue(ua.Variant(value)))


class Seen:
    def __init__(self) -> None:
        self.values: list[Any] = []

    def datachange_notification(self, node: Node, value: Any, data: Any) -> None:
        self.values.append(value)


def item(found: Node, filter_: Any, attribute: Any = ua.AttributeIds.Value, index: str | None = None) -> Any:
    what = ua.ReadValueId(found.nodeid, attribute, index)
    settings = ua.MonitoringParameters(ClientHandle=7, SamplingInterval=100.0, Filter=filter_, QueueSize=10, DiscardOldest=True)
    return ua.MonitoredItemCreateRequest(what, ua.MonitoringMode.Reporting, settings)


def changes(band: float, kind: int = 1, trigger: Any = ua.DataChangeTrigger.StatusValue) -> Any:
    return ua.DataChangeFilter(trigger, kind, band)


async def check_a_dead_band_keeps_quiet(client: Client, world: GatewayWorld) -> None:
    volts, seen = node(client, VOLTS), Seen()
    subscription = await client.create_subscription(100, cast("Any", seen))
    monitored: Any = subscription
    await monitored.deadband_monitor(volts, 1.0)
    for tenths in range(0, 46, 5):
        await write(volts, tenths / 10.0)
        await asyncio.sleep(0.3)
    await asyncio.sleep(1.0)
    assert seen.values == [0.0, 1.5, 3.0, 4.5]


async def check_an_item_that_is_enabled_again_reports_its_value(client: Client, world: GatewayWorld) -> None:
    volts, seen = node(client, VOLTS), Seen()
    await write(volts, 0.0)
    subscription: Any = await client.create_subscription(100, cast("Any", seen))
    handle = await subscription.subscribe_data_change(volts)

    async def switch(mode: ua.MonitoringMode) -> None:
        await asyncio.sleep(1.0)
        wanted = ua.SetMonitoringModeParameters(subscription.subscription_id, mode, [handle])
        assert await client.uaclient.set_monitoring_mode(wanted) == [ua.StatusCode()]

    for values in ((6.0, 0.0), (), (6.0,)):
        await switch(ua.MonitoringMode.Disabled)
        for value in values:
            await write(volts, value)
        await switch(ua.MonitoringMode.Reporting)
    await switch(ua.MonitoringMode.Reporting)
    await asyncio.sleep(1.0)
    assert seen.values == [0.0, 0.0, 0.0, 6.0]


FILTERS: dict[str, tuple[str, Any, Any, str]] = {
    "percent": (VOLTS, changes(1.0, 2), ua.AttributeIds.Value, "BadMonitoredItemFilterUnsupported"),
    "unknown kind": (VOLTS, changes(1.0, 7), ua.AttributeIds.Value, "BadDeadbandFilterInvalid"),
    "negative": (VOLTS, changes(-1.0), ua.AttributeIds.Value, "BadDeadbandFilterInvalid"),
    "of a text": (TEXT, changes(1.0), ua.AttributeIds.Value, "BadFilterNotAllowed"),
    "of a truth value": (TRUTH, changes(1.0), ua.AttributeIds.Value, "BadFilterNotAllowed"),
    "of a name": (VOLTS, changes(1.0), ua.AttributeIds.DisplayName, "BadFilterNotAllowed"),
    "aggregate": (VOLTS, ua.AggregateFilter(), ua.AttributeIds.Value, "BadMonitoredItemFilterUnsupported"),
    "events of a value": (VOLTS, ua.EventFilter(), ua.AttributeIds.Value, "BadFilterNotAllowed"),
    "absolute": (VOLTS, changes(1.0), ua.AttributeIds.Value, "Good"),
    "of an array": (ARRAY, changes(1.0), ua.AttributeIds.Value, "Good"),
    "trigger of a text": (TEXT, changes(0.0, 0, ua.DataChangeTrigger.Status), ua.AttributeIds.Value, "Good"),
}


async def check_filters_that_are_not_supported_are_refused(client: Client, world: GatewayWorld) -> None:
    subscription = await client.create_subscription(100, cast("Any", Seen()))
    items = [item(node(client, name), filter_, attribute) for name, filter_, attribute, _ in FILTERS.values()]
    wanted = ua.CreateMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, items)
    results = await client.uaclient.create_monitored_items(wanted)
    assert {case: one.StatusCode.name for case, one in zip(FILTERS, results, strict=True)} == {
        case: code for case, (*_, code) in FILTERS.items()
    }
    server = item(client.nodes.server, changes(0.0), ua.AttributeIds.EventNotifier)
    wanted = ua.CreateMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, [server])
    (result,) = await client.uaclient.create_monitored_items(wanted)
    assert result.StatusCode.name == "BadFilterNotAllowed"
    modified = ua.MonitoredItemModifyRequest(results[8].MonitoredItemId, items[2].RequestedParameters)
    unknown = ua.MonitoredItemModifyRequest(99, items[8].RequestedParameters)
    asked = ua.ModifyMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, [modified, unknown])
    answers = await client.uaclient.modify_monitored_items(asked)
    assert [one.StatusCode.name for one in answers] == ["BadDeadbandFilterInvalid", "BadMonitoredItemIdInvalid"]


RANGES = {
    "5": [7],
    "4:6": [0, 7, 0],
    "1998:5000": [0, 0],
    "1999": [0],
    "2000": "BadIndexRangeNoData",
    "5000": "BadIndexRangeNoData",
    "6:5": "BadIndexRangeInvalid",
    "5:5": "BadIndexRangeInvalid",
    "x": "BadIndexRangeInvalid",
    "-1": "BadIndexRangeInvalid",
    "0,1": "BadIndexRangeNoData",
}


async def check_parts_of_an_array(client: Client, world: GatewayWorld) -> None:
    await write(node(client, REGISTER), 7.0)
    array = node(client, ARRAY).nodeid
    asked = ua.ReadParameters(NodesToRead=[ua.ReadValueId(array, ua.AttributeIds.Value, text) for text in RANGES])
    found: list[Any] = await client.uaclient.read(asked)
    shown = {
        text: one.Value.Value if one.StatusCode.is_good() else one.StatusCode.name
        for text, one in zip(RANGES, found, strict=True)
    }
    assert shown == RANGES
    number = ua.ReadParameters(NodesToRead=[ua.ReadValueId(node(client, VOLTS).nodeid, ua.AttributeIds.Value, "0")])
    (scalar,) = cast("list[Any]", await client.uaclient.read(number))
    assert scalar.StatusCode.name == "BadIndexRangeNoData"
    seen = Seen()
    subscription = await client.create_subscription(100, cast("Any", seen))
    items = [item(node(client, ARRAY), None, index=text) for text in ("4:6", "6:5")]
    wanted = ua.CreateMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, items)
    results = await client.uaclient.create_monitored_items(wanted)
    assert [one.StatusCode.name for one in results] == ["Good", "BadIndexRangeInvalid"]


async def check_a_value_with_a_status_is_not_written(client: Client, world: GatewayWorld) -> None:
    before = await node(client, REGISTER).read_value()
    for code in ("BadSensorFailure", "UncertainLastUsableValue", "GoodLocalOverride"):
        value = ua.DataValue(ua.Variant(77.0), ua.StatusCode(getattr(ua.StatusCodes, code)))
        with pytest.raises(ua.uaerrors.BadWriteNotSupported):
            await node(client, REGISTER).write_attribute(ua.AttributeIds.Value, value)
    assert await node(client, REGISTER).read_value() == before


async def history(client: Client, details: Any, wanted: Any) -> Any:
    asked = ua.HistoryReadParameters(details, ReleaseContinuationPoints=False, NodesToRead=[wanted])
    (result,) = await client.uaclient.history_read(asked)
    return result


async def pages(client: Client, most: int, *, begin: float = 0.0, end: float = 20.0, bounds: bool = False) -> list[Any]:
    """The values of each page; the status of the first where it has none."""
    details = ua.ReadRawModifiedDetails(
        IsReadModified=False,
        StartTime=BEGIN + timedelta(seconds=begin),
        EndTime=BEGIN + timedelta(seconds=end),
        NumValuesPerNode=most,
        ReturnBounds=bounds,
    )
    found: list[Any] = []
    point: bytes | None = None
    while True:
        wanted = ua.HistoryReadValueId(NodeId=node(client, VOLTS).nodeid, ContinuationPoint=point)
        result = await history(client, details, wanted)
        values = getattr(result.HistoryData, "DataValues", [])
        shown = [one.Value.Value if one.StatusCode.is_good() else one.StatusCode.name for one in values]
        found.append(shown or result.StatusCode.name)
        point = result.ContinuationPoint
        if not point:
            return found


async def check_the_past_is_read_page_by_page(client: Client, world: GatewayWorld) -> None:
    forwards = [float(n) for n in range(10)]
    assert await pages(client, 0) == [forwards]
    assert await pages(client, 10) == [forwards]
    for most in (1, 2, 4, 5):
        found = await pages(client, most)
        assert [one for page in found for one in page] == forwards
        assert {len(page) for page in found[:-1]} <= {most}
        back = await pages(client, most, begin=20.0, end=0.0)
        assert [one for page in back for one in page] == forwards[::-1]
    assert await pages(client, 5, begin=100.0, end=200.0) == ["GoodNoData"]
    assert await pages(client, 5, begin=6.5, end=8.5) == [[7.0, 8.0]]
    assert await pages(client, 2, begin=6.5, end=8.5, bounds=True) == [[6.0, 7.0], [8.0, 9.0]]
    assert await pages(client, 5, begin=-1.0, end=0.5, bounds=True) == [["BadBoundNotFound", 0.0, 1.0]]
    assert await pages(client, 3, begin=8.5, end=20.0, bounds=True) == [[8.0, 9.0, "BadBoundNotFound"]]


async def check_pasts_that_cannot_be_read(client: Client, world: GatewayWorld) -> None:
    async def asked(details: Any, name: str = VOLTS, point: bytes | None = None) -> str:
        wanted = ua.HistoryReadValueId(NodeId=node(client, name).nodeid, ContinuationPoint=point)
        return str((await history(client, details, wanted)).StatusCode.name)

    span: dict[str, Any] = {"StartTime": BEGIN, "EndTime": BEGIN + timedelta(seconds=9)}
    raw = ua.ReadRawModifiedDetails(
        IsReadModified=False, StartTime=BEGIN, EndTime=BEGIN + timedelta(seconds=9), NumValuesPerNode=3
    )
    assert await asked(raw, point=b"12345678") == "BadContinuationPointInvalid"
    assert await asked(ua.ReadRawModifiedDetails(IsReadModified=True, **span)) == "BadHistoryOperationUnsupported"
    assert await asked(ua.ReadProcessedDetails(**span)) == "BadHistoryOperationUnsupported"
    assert await asked(raw, "Model") == "BadHistoryOperationUnsupported"


async def check_one_read_has_an_upper_bound(client: Client, world: GatewayWorld) -> None:
    limit = client.get_node(ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerRead)
    assert await limit.read_value() == MOST_READ
    one = ua.ReadValueId(node(client, VOLTS).nodeid, ua.AttributeIds.Value)
    found: list[Any] = await client.uaclient.read(ua.ReadParameters(NodesToRead=[one] * MOST_READ))
    assert {value.StatusCode.name for value in found} == {"Good"}
    with pytest.raises(ua.uaerrors.BadTooManyOperations):
        await client.uaclient.read(ua.ReadParameters(NodesToRead=[one] * (MOST_READ + 1)))


async def check_a_refusal_says_why_to_a_client_that_asks(client: Client, world: GatewayWorld) -> None:
    stop = ua.CallMethodRequest(node(client, "M1").nodeid, node_id("types.Axis.Stop"), [])
    move = ua.CallMethodRequest(node(client, "M1").nodeid, node_id("types.Axis.MoveTo"), [ua.Variant(5.0)])

    async def asked(bits: int, *calls: ua.CallMethodRequest) -> tuple[list[str], list[str | None]]:
        request: Any = ua.CallRequest()
        request.Parameters.MethodsToCall = list(calls)
        request.RequestHeader.ReturnDiagnostics = bits
        protocol: Any = client.uaclient.protocol
        answer: Any = struct_from_binary(ua.CallResponse, await protocol.send_request(request))
        return [one.StatusCode.name for one in answer.Results], [one.AdditionalInfo for one in answer.DiagnosticInfos]

    refused = ["Good", "BadInvalidState"]
    assert await asked(0, stop, move) == (refused, [])
    assert await asked(0x20, stop, move) == (refused, [])
    codes, (of_stop, of_move) = await asked(ADDITIONAL_INFO, stop, move)
    assert (codes, of_stop) == (refused, None)
    assert "not enabled" in str(of_move)
    assert await asked(ADDITIONAL_INFO, stop, stop) == (["Good", "Good"], [])


async def check_what_the_gateway_refuses_is_in_the_audit_log(client: Client, world: GatewayWorld) -> None:
    logged: list[tuple[object, ...]] = []
    world.audit = lambda who, do, fields, outcome: logged.append((do, fields.get("value"), fields.get("code"), outcome))
    for value in (99.0, float("nan"), "text"):
        with pytest.raises(ua.UaStatusCodeError):
            await node(client, VOLTS).write_attribute(ua.AttributeIds.Value, ua.DataValue(ua.Variant(value)))
    with pytest.raises(ua.uaerrors.BadArgumentsMissing):
        await node(client, "M1").call_method(node_id("types.Axis.MoveTo"))
    world.audit = None
    assert logged == [
        ("write", "99.0", "BadOutOfRange", "misuse"),
        ("write", "nan", "BadOutOfRange", "misuse"),
        ("write", "text", "BadTypeMismatch", "misuse"),
        ("call", None, "BadArgumentsMissing", "misuse"),
    ]


CHECKS = (
    check_a_refusal_says_why_to_a_client_that_asks,
    check_what_the_gateway_refuses_is_in_the_audit_log,
    check_a_dead_band_keeps_quiet,
    check_an_item_that_is_enabled_again_reports_its_value,
    check_filters_that_are_not_supported_are_refused,
    check_parts_of_an_array,
    check_a_value_with_a_status_is_not_written,
    check_the_past_is_read_page_by_page,
    check_pasts_that_cannot_be_read,
    check_one_read_has_an_upper_bound,
)


def test_answers_over_a_socket() -> None:
    """With one server, whose start is what takes time."""

    async def story() -> None:
        world = GatewayWorld(WORLD)
        world.history = StoredHistory()
        async with connected(world) as client:
            for check in CHECKS:
                await check(client, world)

    run_virtually(story())
