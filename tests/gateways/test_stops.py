"""After a stop nothing begins that was asked for before it: every way to a device behind a bridge, whatever waits where."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Protocol

import pytest
from aiomqtt import Message
from asyncua import Client, ua
from bridge_rig import AXIS, PLACE, BridgeRig
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.errors import SteptwinError
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.devicefile import read_device_file
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.records import Putter
from steptwin.gateways.epics.recordset import make_records
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.modbus import MasterGateway
from steptwin.gateways.mqtt.jsoncommands import Doorkeeper, JsonCommands, JsonRequest
from steptwin.gateways.mqtt.sparkplug import SparkplugFace
from steptwin.gateways.mqtt.sparkplugcodec import SparkplugMetric, SparkplugPayload, SparkplugType, decode_payload, encode_payload
from steptwin.gateways.mqtt.sparkplugmetrics import RESULT, Namespace, rows_of
from steptwin.gateways.opcua.addressspace import node_id
from steptwin.gateways.opcua.gateway import OpcUaGateway
from steptwin.gateways.points import CLOCK
from steptwin.gateways.sampling import Sampler
from steptwin.machine import SECOND
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import RegisterItem, encoded
from steptwin.subject import commands as command
from steptwin.subject.commands import Command
from steptwin.wire import pdu
from steptwin.world import script as steps

MOTIONS = ("move", "jog", "home", "program")
PLACES = ("gateway", "line", "sent")
"""Where the command is when the stop comes: behind another command, behind a read on the line, on its own way."""
SILENCE_S = 0.5
TARGET, VELOCITY, LEASE_S = 400.0, 20.0, 5.0


class Way(Protocol):
    """Two clients of one way. ``ask`` raises for what is refused."""

    async def ask(self, what: str) -> None: ...
    async def stop(self, what: str) -> None: ...


COMMANDS: dict[str, Command] = {
    "move": command.Move("table", AXIS, to=TARGET),
    "jog": command.Jog("table", AXIS, VELOCITY),
    "home": command.Home("table", AXIS, VELOCITY),
    "program": command.ControlProgram("table", "start"),
}
STOPS: dict[str, Command] = {
    "axis": command.StopAxes("table", AXIS),
    "controller": command.StopAxes("table"),
    "program": command.ControlProgram("table", "stop"),
    "everything": command.StopAll(),
    "registers": steps.Write((("table", f"M{AXIS}_STOP", 1.0),)),
}
FURTHER = {"studio": ("everything", "registers")}
"""Stops that only these ways have."""


class Refused(Exception):
    """As the protocol says it."""


# ---------------------------------------------------------------------- the ways


class Composite:
    """The studio, over REST and WebSocket: `steptwin.studio.hub` asks the same subject."""

    def __init__(self, rig: BridgeRig) -> None:
        self._rig = rig

    async def ask(self, what: str) -> None:
        wanted = COMMANDS[what]
        if isinstance(wanted, command.Jog):
            await self._rig.subject.begin_jog(wanted)
        else:
            await self._rig.subject.do(wanted)

    async def stop(self, what: str) -> None:
        await self._rig.subject.do(STOPS[what])


@asynccontextmanager
async def studio(rig: BridgeRig) -> AsyncGenerator[Way]:
    yield Composite(rig)


class Masters:
    """Registers, as a write of one and as a raw request of Modbus."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._number = 0
        self._registers = register_map("1.70")

    def _pdu(self, key: str, value: float, axis: int | None = None) -> bytes:
        item = RegisterItem(self._registers.of(key, axis))
        return pdu.encode_request(encoded(item, value, DataType.REAL))

    async def _send(self, request: bytes) -> None:
        self._number += 1
        reader, writer = await asyncio.open_connection("127.0.0.1", self._port)
        writer.write(struct.pack(">HHHB", self._number, 0, len(request) + 1, 1) + request)
        *_, length, _, function = struct.unpack(">HHHBB", await reader.readexactly(8))
        rest = await reader.readexactly(length - 2)
        writer.close()
        if function & 0x80:
            raise Refused(f"exception {rest[0]:02}")

    async def ask(self, what: str) -> None:
        requests: dict[str, tuple[Any, ...]] = {
            "move": ("POS_ABS", TARGET, AXIS),
            "jog": ("JOG_PLUS", 1, AXIS),
            "home": ("HOME", VELOCITY, AXIS),
            "program": ("PROGRAM_CTRL", 1),
        }
        await self._send(self._pdu(*requests[what]))

    async def stop(self, what: str) -> None:
        requests: dict[str, tuple[Any, ...]] = {
            "axis": ("STOP", 1, AXIS),
            "controller": ("M_STOP", 15),
            "program": ("PROGRAM_CTRL", 0),
        }
        await self._send(self._pdu(*requests[what]))


@asynccontextmanager
async def modbus(rig: BridgeRig) -> AsyncGenerator[Way]:
    gateway = MasterGateway(_spec('[gateway.modbus]\nlisten = "127.0.0.1:0"\n'), rig.subject, Path())
    place: Any = await gateway.open(listen_any=False, notice=pytest.fail)
    yield Masters(place["port"])
    await gateway.close()


class Nodes:
    def __init__(self, one: Client, other: Client) -> None:
        self._one, self._other = one, other

    @staticmethod
    async def _call(client: Client, path: str, kind: str, method: str, *given: ua.Variant) -> None:
        node = client.get_node(f"ns=2;s={path}")
        try:
            await node.call_method(node_id(f"types.{kind}.{method}"), *given)
        except ua.UaStatusCodeError as error:
            raise Refused(str(error)) from None

    async def ask(self, what: str) -> None:
        number, lease = ua.Variant(VELOCITY), ua.Variant(LEASE_S)
        axis = f"table.M{AXIS}"
        calls: dict[str, tuple[Any, ...]] = {
            "move": (axis, "Axis", "MoveTo", ua.Variant(TARGET)),
            "jog": (axis, "Axis", "Jog", number, lease),
            "home": (axis, "Axis", "Home", number),
            "program": ("table.program", "Program", "Start"),
        }
        calling = asyncio.create_task(self._call(self._one, *calls[what]))
        async with asyncio.timeout(SILENCE_S / 10.0):  # the session is answered while the command waits
            assert await self._one.get_node(ua.ObjectIds.Server_ServerStatus_State).read_value() == ua.ServerState.Running
        await calling

    async def stop(self, what: str) -> None:
        """By the same client where it is a controller, otherwise by the other one."""
        calls = {
            "axis": (self._other, f"table.M{AXIS}", "Axis"),
            "controller": (self._one, "table", "Controller"),
            "program": (self._other, "table.program", "Program"),
        }
        client, path, kind = calls[what]
        await self._call(client, path, kind, "Stop")

    async def leave(self) -> None:
        """The session ends; its connection does not."""
        await self._one.close_session()


@asynccontextmanager
async def opcua(rig: BridgeRig) -> AsyncGenerator[Way]:
    gateway = OpcUaGateway(_spec('[gateway.opcua]\nlisten = "127.0.0.1:0"\n'), rig.subject, Path())
    place: Any = await gateway.open(listen_any=False, notice=pytest.fail)
    async with Client(place["url"], timeout=60) as one, Client(place["url"], timeout=60) as other:
        yield Nodes(one, other)
    await gateway.close()


class Topics:
    def __init__(self, commands: JsonCommands) -> None:
        self._commands = commands
        self._number = 0

    async def _do(self, **message: object) -> None:
        self._number += 1
        payload = json.dumps({"machine": "table", **message, "id": self._number}).encode()
        answer: Any = await self._commands.answer(JsonRequest(payload, is_retained=False))
        if "error" in answer:
            raise Refused(answer["error"])

    async def ask(self, what: str) -> None:
        messages: dict[str, dict[str, object]] = {
            "move": {"do": "move", "axis": AXIS, "to": TARGET},
            "jog": {"do": "jog", "axis": AXIS, "velocity": VELOCITY, "lease_s": LEASE_S},
            "home": {"do": "home", "axis": AXIS, "velocity": VELOCITY},
            "program": {"do": "program", "action": "start"},
        }
        await self._do(**messages[what])

    async def stop(self, what: str) -> None:
        messages: dict[str, dict[str, object]] = {
            "axis": {"do": "stop", "axis": AXIS},
            "controller": {"do": "stop"},
            "program": {"do": "program", "action": "stop"},
        }
        await self._do(**messages[what])

    async def leave(self) -> None:
        """The broker is lost."""
        self._commands.lost()


@asynccontextmanager
async def mqtt(rig: BridgeRig) -> AsyncGenerator[Way]:
    spec: Any = _spec('[gateway.mqtt]\nrole = "engineer"\n')
    commands = JsonCommands(rig.subject, Doorkeeper(spec, Path()), asyncio.get_running_loop().time)
    yield Topics(commands)
    commands.lost()


class EdgeNode:
    def __init__(self, rig: BridgeRig) -> None:
        rows = rows_of(rig.subject.description, {})
        self._result = next(row.alias for row in rows["table"] if row.name == RESULT)
        client = GatewayClient("anybody", Role.ENGINEER)
        self.face = SparkplugFace(
            Namespace("plant", "cell", None),
            rows,
            rig.subject,
            Sampler(rig.subject, {}),
            client,
            interval=SECOND // 10,
            store=1000,
        )
        self.results: list[str] = []

    async def publish(self, one: Any) -> None: ...

    async def publish_all(self, all_of: Any) -> None:
        for one in all_of:
            self.results += [str(metric.value) for metric in decode_payload(one.payload).metrics if metric.alias == self._result]

    async def subscribe(self, topic: str, *, retained: bool) -> None: ...

    async def _write(self, name: str, value: Any) -> None:
        kind = SparkplugType.BOOLEAN if value is True else SparkplugType.DOUBLE
        payload = SparkplugPayload(timestamp=0, metrics=(SparkplugMetric(name=name, type=kind, value=value),))
        self.face.take(self, Message("spBv1.0/plant/DCMD/cell/table", encode_payload(payload), 1, False, 1, None))
        result = await self._result_of(f"{name}: ")
        if not result.endswith(": done"):
            raise Refused(result)

    async def _result_of(self, begin: str) -> str:
        for _ in range(1000):
            mine = [one for one in self.results if one.startswith(begin)]
            if mine:
                self.results.remove(mine[0])
                return mine[0]
            await asyncio.sleep(0.01)
        raise AssertionError(begin)

    async def ask(self, what: str) -> None:
        axis = f"M{AXIS}/Commands"
        metrics = {
            "move": (f"{axis}/MoveTo", TARGET),
            "home": (f"{axis}/Home", VELOCITY),
            "program": ("program/Commands/Start", True),
        }
        await self._write(*metrics[what])

    async def stop(self, what: str) -> None:
        metrics = {"axis": f"M{AXIS}/Commands/Stop", "controller": "Commands/Stop", "program": "program/Commands/Stop"}
        await self._write(metrics[what], True)


@asynccontextmanager
async def sparkplug(rig: BridgeRig) -> AsyncGenerator[Way]:
    node = EdgeNode(rig)
    node.face.start(pytest.fail)
    node.face.will()
    session = asyncio.create_task(node.face.run(node))
    await rig.wait(0.5)
    yield node
    session.cancel()
    node.face.close()


class Records:
    def __init__(self, rig: BridgeRig, leases: JogLeases) -> None:
        sampler = Sampler(rig.subject, {})
        controllers = {name: EpicsController(name, rig.subject, sampler, leases, Role.ENGINEER) for name in ("table", CLOCK)}
        self._controller = controllers["table"]
        self._records = make_records("ST:", rig.subject, controllers, {"table": []})

    async def _put(self, name: str, field: str, value: float, who: str) -> None:
        try:
            await self._records[f"ST:table:{name}"].put(Putter(who, who, (who, 1)), field, value)
        except SteptwinError as error:
            raise Refused(str(error)) from None

    async def ask(self, what: str) -> None:
        """A put that moves is over when the motion is: it is not waited for longer than that needs."""
        axis = f"M{AXIS}"
        puts = {
            "move": (axis, "VAL", TARGET),
            "jog": (axis, "JOGF", 1),
            "home": (axis, "HOMF", 1),
            "program": ("program:Start", "VAL", 1),
        }
        name, field, value = puts[what]
        put = asyncio.create_task(self._put(name, field, value, "one"))
        while not put.done():
            await asyncio.sleep(0.1)
            await self._controller.refresh()
        await put

    async def stop(self, what: str) -> None:
        puts = {"axis": (f"M{AXIS}", "STOP"), "controller": ("Stop", "VAL"), "program": ("program:Stop", "VAL")}
        await self._put(*puts[what], 1, "other")

    async def leave(self) -> None:
        await self._controller.leave(("one", 1))

    async def release(self) -> None:
        await self._put(f"M{AXIS}", "JOGF", 0, "one")


@asynccontextmanager
async def epics(rig: BridgeRig) -> AsyncGenerator[Way]:
    leases = JogLeases(rig.subject)
    records = Records(rig, leases)
    await records._records[f"ST:table:M{AXIS}"].refresh()
    await records._records[f"ST:table:M{AXIS}"].put(Putter("one", "one", 1), "HVEL", VELOCITY)
    yield records
    leases.close()


def _spec(table: str) -> Any:
    (found,) = read_device_file("cell.toml", f'[[device]]\nname = "table"\naddress = "/dev/ttyUSB0"\n{table}').gateways
    return found


WAYS: dict[str, Callable[[BridgeRig], Any]] = {one.__name__: one for one in (studio, modbus, opcua, mqtt, sparkplug, epics)}

# ---------------------------------------------------------------------- the table


async def _asked(asking: Awaitable[None]) -> str:
    try:
        await asking
    except (SteptwinError, Refused) as error:
        return str(error)
    return "done"


async def _occupy(rig: BridgeRig, place: str) -> asyncio.Task[Any] | None:
    """Let something be on the line, for which the command has to wait."""
    rig.line.fall_silent()
    wanted: dict[str, Command] = {
        "gateway": steps.Write((("table", "USER_REGISTER[5]", 1.0),)),
        "line": steps.Request(PLACE, 1, bytes.fromhex("0300000001"), SECOND),
    }
    if place not in wanted:
        return None
    task = asyncio.create_task(rig.subject.do(wanted[place]))
    await rig.wait(0.02)
    return task


async def check_case(rig: BridgeRig, way: Way, what: str, place: str, stop: str) -> None:
    await rig.subject.do(command.Enable("table", AXIS, on=True))
    case = f"{what}, {place}, {stop}"
    before = await _occupy(rig, place)
    asked = asyncio.create_task(_asked(way.ask(what)))
    await rig.wait(0.05)
    stopping = asyncio.create_task(_asked(way.stop(stop)))
    await rig.wait(SILENCE_S)
    rig.line.answer_again()
    assert await stopping == "done", case
    there = rig.position
    await rig.wait(2.0)
    if place != "sent":
        assert await asked != "done", f"{case}: it was done"
    assert (rig.is_moving, rig.position) == (False, there), case
    assert not rig.is_running, case
    await asked
    if before is not None:
        await asyncio.wait((before,))


@pytest.mark.parametrize("name", WAYS)
def test_what_was_asked_for_before_a_stop_does_not_begin_after_it(name: str) -> None:
    async def story() -> None:
        rig = BridgeRig()
        await rig.open()
        async with WAYS[name](rig) as way:
            for what in MOTIONS:
                for place in PLACES:
                    for stop in ("axis", "controller", *FURTHER.get(name, ())) if what != "program" else ("program",):
                        if (name, what) != ("sparkplug", "jog"):  # it has no jog
                            await check_case(rig, way, what, place, stop)
        await rig.close()

    run_virtually(story())


@pytest.mark.parametrize(("name", "end"), [("opcua", "leave"), ("mqtt", "leave"), ("epics", "leave"), ("epics", "release")])
def test_a_jog_whose_client_lets_go_before_it_begins_does_not_last(name: str, end: str) -> None:
    async def story() -> None:
        rig = BridgeRig()
        await rig.open()
        async with WAYS[name](rig) as way:
            await rig.subject.do(command.Enable("table", AXIS, on=True))
            rig.line.fall_silent()
            asked = asyncio.create_task(_asked(way.ask("jog")))
            await rig.wait(0.05)
            ending = asyncio.create_task(getattr(way, end)())
            await rig.wait(SILENCE_S)
            rig.line.answer_again()
            await ending
            await rig.wait(1.0)
            there = rig.position
            await rig.wait(2.0)
            assert (rig.is_moving, rig.position) == (False, there)
            if name != "opcua":  # nobody is there for an answer
                assert "let go" in await asked
            asked.cancel()
        await rig.close()

    run_virtually(story())
