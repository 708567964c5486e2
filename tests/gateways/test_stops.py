"""After a stop nothing begins that was asked for before it: every way to twins of `up` and to devices behind a bridge.

Drivers are in `tests/drivers/m1486/test_stops.py` and `tests/drivers/mic488/test_stops.py`.
"""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias, cast

import httpx
import pytest
from aiomqtt import Message
from asyncua import Client, ua
from bridge_rig import AXIS, PLACE, BridgeRig, ChipBridgeRig
from fastapi import FastAPI
from studio_rig import NoConnections, NoWork
from up_rig import UpRig
from virtual_loop import run_virtually

from steptwin.access.audit import Audit
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.controller import SECOND
from steptwin.errors import SteptwinError
from steptwin.eventloop import result_of
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.records import Putter
from steptwin.gateways.epics.recordset import make_records
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.modbus.gateway import MasterGateway
from steptwin.gateways.mqtt.jsoncommands import Doorkeeper, JsonCommands, JsonRequest
from steptwin.gateways.mqtt.sparkplug import SparkplugFace
from steptwin.gateways.mqtt.sparkplugcodec import SparkplugMetric, SparkplugPayload, SparkplugType, decode_payload, encode_payload
from steptwin.gateways.mqtt.sparkplugmetrics import RESULT, Namespace, rows_of
from steptwin.gateways.opcua.addressspace import node_id
from steptwin.gateways.opcua.gateway import OpcUaGateway
from steptwin.gateways.points import CLOCK
from steptwin.gateways.sampling import Sampler
from steptwin.live.devicefile import read_device_file
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import RegisterItem, encoded
from steptwin.simulation.script import steps
from steptwin.studio.hub import Hub
from steptwin.studio.rest import Rest
from steptwin.studio.surroundings import PresentMoment, Surroundings
from steptwin.studio.viewersession import ViewerSession
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, command_to_json
from steptwin.subject.contract import Result
from steptwin.subject.dispatch import respond
from steptwin.wire import pdu

MOTIONS = ("move", "jog", "home", "program")
PLACES = ("gateway", "line", "sent")
"""Where the command is when the stop comes: behind another command, behind a read on the line, on its own way."""
SILENCE_S = 0.5
LEASE_S = 5.0
QUIET_S = 4.0
"""Longer than anything that is under way takes to begin."""
LONGEST_S = 100.0
"""Until a program is in an EEPROM over a slow line, or a driver has given it up."""
PROGRAM = "[\n@5\nF6400\nR\nW50\nB6400\nR\nJ5\n]"
"""Of an M1486; it runs as soon as it is there."""


class Way(Protocol):
    """Two clients of one way. ``ask`` raises for what is refused."""

    async def ask(self, what: str) -> None: ...
    async def stop(self, what: str) -> None: ...


class Numbers(NamedTuple):
    """In the units of the axis of a rig."""

    distance: float
    velocity: float


MILLIMETRES, FULL_STEPS, MICROSTEPS = Numbers(400.0, 20.0), Numbers(2000.0, 1000.0), Numbers(128_000.0, 64_000.0)


def command_for(what: str, numbers: Numbers) -> Command:
    match what:
        case "move":
            return command.Move("table", AXIS, by=numbers.distance)
        case "jog":
            return command.Jog("table", AXIS, numbers.velocity)
        case "home":
            return command.Home("table", AXIS, numbers.velocity)
        case _:
            return command.ControlProgram("table", "start")


STOPS: dict[str, Command] = {
    "axis": command.StopAxes("table", AXIS),
    "controller": command.StopAxes("table"),
    "program": command.ControlProgram("table", "stop"),
    "all": command.StopAll(),
    "registers": steps.Write((("table", f"M{AXIS}_STOP", 1.0),)),
}


AnyRig: TypeAlias = Any
"""One of those below, with ``numbers``."""


class Refused(Exception):
    """As the protocol says it."""


# ---------------------------------------------------------------------- the ways


class Endpoint:
    """The control endpoint of a world."""

    def __init__(self, rig: AnyRig) -> None:
        self._rig = rig

    async def _do(self, wanted: Command) -> None:
        async def answered(one: Command, _: object) -> Result:
            return await self._rig.control.answer(one)

        answer: Any = await respond(answered, json.dumps(command_to_json(wanted)).encode(), _raise)
        if "error" in answer:
            raise Refused(answer["error"])

    async def ask(self, what: str) -> None:
        await self._do(command_for(what, self._rig.numbers))

    async def stop(self, what: str) -> None:
        await self._do(STOPS[what])


@asynccontextmanager
async def control(rig: AnyRig) -> AsyncGenerator[Way]:
    yield Endpoint(rig)


class Viewers:
    """Of a studio. A jog is renewed as long as that is possible."""

    def __init__(self, rig: AnyRig, one: Callable[[str], Awaitable[Any]], other: Callable[[str], Awaitable[Any]]) -> None:
        self._rig = rig
        self._one, self._other = one, other
        self._renewing: asyncio.Task[None] | None = None

    @staticmethod
    async def _do(ask: Callable[[str], Awaitable[Any]], message: dict[str, object]) -> Any:
        answer = await ask(json.dumps(message))
        if "error" in answer:
            raise Refused(answer["error"])
        return answer["ok"]

    async def ask(self, what: str) -> None:
        found = await self._do(self._one, command_to_json(command_for(what, self._rig.numbers)))
        if what == "jog":
            self._renewing = asyncio.create_task(self._renew(found["lease"]))

    async def _renew(self, lease: int) -> None:
        with suppress(Refused):
            while True:
                await self._do(self._one, {"do": "renew", "lease": lease})
                await asyncio.sleep(0.08)

    async def stop(self, what: str) -> None:
        """By anybody, that of a program and by registers by who has control."""
        await self._do(self._one if what in ("program", "registers") else self._other, command_to_json(STOPS[what]))

    async def close(self) -> None:
        if self._renewing is not None:
            self._renewing.cancel()


def _hub(rig: AnyRig) -> tuple[Hub, Callable[[], int]]:
    loop = asyncio.get_running_loop()

    def now() -> int:
        return round(loop.time() * SECOND)

    around = Surroundings(
        moment=lambda: PresentMoment(now(), running=True, speed=1.0),
        gate=AccessGate(open_to=Role.ENGINEER),
        audit=Audit(lambda: "2026-01-01T00:00:00Z"),
        program="0",
        programs=cast("Any", None),
        connections=NoConnections(),
        work=NoWork(),
        on_internal=_raise,
    )
    return Hub(rig.composite, rig.composite, around), now


def _raise(error: Exception) -> None:
    raise error


@asynccontextmanager
async def websocket(rig: AnyRig) -> AsyncGenerator[Way]:
    hub, now = _hub(rig)
    one, other = ViewerSession(hub, "one"), ViewerSession(hub, "other")
    for session in (one, other):
        assert "ok" in await result_of(session.receive('{"do": "hello", "version": 2}', now()))
    viewers = Viewers(rig, lambda text: result_of(one.receive(text, now())), lambda text: result_of(other.receive(text, now())))
    yield viewers
    await viewers.close()


@asynccontextmanager
async def rest(rig: AnyRig) -> AsyncGenerator[Way]:
    app = FastAPI()
    Rest(*_hub(rig)).add_to(app)

    async def ask(text: str) -> Any:
        message = json.loads(text)
        answer = await client.post(f"/api/do/{message.pop('do')}", json=message)
        found = answer.json()
        assert (answer.status_code == 200) is ("ok" in found)
        return found

    async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://studio") as client:
        viewers = Viewers(rig, ask, ask)
        yield viewers
        await viewers.close()


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
            "move": ("POS_REL", MILLIMETRES.distance, AXIS),
            "jog": ("JOG_PLUS", 1, AXIS),
            "home": ("HOME", MILLIMETRES.velocity, AXIS),
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
async def modbus(rig: AnyRig) -> AsyncGenerator[Way]:
    gateway = MasterGateway(_spec('[gateway.modbus]\nlisten = "127.0.0.1:0"\n'), rig.subject, Path())
    place: Any = await gateway.open(listen_any=False, notice=pytest.fail)
    yield Masters(place["port"])
    await gateway.close()


class Nodes:
    def __init__(self, one: Client, other: Client, numbers: Numbers) -> None:
        self._one, self._other = one, other
        self._numbers = numbers

    @staticmethod
    async def _call(client: Client, path: str, kind: str, method: str, *given: ua.Variant) -> None:
        node = client.get_node(f"ns=2;s={path}")
        try:
            await node.call_method(node_id(f"types.{kind}.{method}"), *given)
        except ua.UaStatusCodeError as error:
            raise Refused(str(error)) from None

    async def ask(self, what: str) -> None:
        distance, velocity = map(ua.Variant, self._numbers)
        axis = f"table.M{AXIS}"
        calls: dict[str, tuple[Any, ...]] = {
            "move": (axis, "Axis", "MoveBy", distance),
            "jog": (axis, "Axis", "Jog", velocity, ua.Variant(LEASE_S)),
            "home": (axis, "Axis", "Home", velocity),
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
async def opcua(rig: AnyRig) -> AsyncGenerator[Way]:
    gateway = OpcUaGateway(_spec('[gateway.opcua]\nlisten = "127.0.0.1:0"\n'), rig.subject, Path())
    place: Any = await gateway.open(listen_any=False, notice=pytest.fail)
    async with Client(place["url"], timeout=60) as one, Client(place["url"], timeout=60) as other:
        yield Nodes(one, other, rig.numbers)
    await gateway.close()


class Topics:
    def __init__(self, commands: JsonCommands, numbers: Numbers) -> None:
        self._commands = commands
        self._numbers = numbers
        self._number = 0

    async def _do(self, message: dict[str, object]) -> None:
        self._number += 1
        payload = json.dumps({**message, "id": self._number}).encode()
        answer: Any = await self._commands.answer(JsonRequest(payload, is_retained=False))
        if "error" in answer:
            raise Refused(answer["error"])

    async def ask(self, what: str) -> None:
        lease = {"lease_s": LEASE_S} if what == "jog" else {}
        await self._do({**command_to_json(command_for(what, self._numbers)), **lease})

    async def stop(self, what: str) -> None:
        await self._do(command_to_json(STOPS[what]))

    async def leave(self) -> None:
        """The broker is lost."""
        self._commands.lost()


@asynccontextmanager
async def mqtt(rig: AnyRig) -> AsyncGenerator[Way]:
    spec: Any = _spec('[gateway.mqtt]\nrole = "engineer"\n')
    commands = JsonCommands(rig.subject, Doorkeeper(spec, Path()), asyncio.get_running_loop().time)
    yield Topics(commands, rig.numbers)
    commands.lost()


class EdgeNode:
    def __init__(self, rig: AnyRig) -> None:
        self._numbers = rig.numbers
        rows = rows_of(rig.subject.description, {})
        self._result = next(row.alias for row in rows["table"] if row.name == RESULT)
        client = GatewayClient("anybody", Role.ENGINEER)
        self.face = SparkplugFace(
            Namespace("plant", "cell", None),
            rows,
            rig.subject,
            Sampler(rig.subject.samples, {}),
            client,
            interval=SECOND // 10,
            store=1000,
        )
        self.results: list[str] = []
        self.is_born = False

    async def publish(self, one: Any) -> None:
        self.is_born |= "/DBIRTH/" in str(one.topic)

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
        for _ in range(10_000):
            mine = [one for one in self.results if one.startswith(begin)]
            if mine:
                self.results.remove(mine[0])
                return mine[0]
            await asyncio.sleep(0.01)
        raise AssertionError(begin)

    async def ask(self, what: str) -> None:
        axis = f"M{AXIS}/Commands"
        metrics = {
            "move": (f"{axis}/MoveBy", self._numbers.distance),
            "home": (f"{axis}/Home", self._numbers.velocity),
            "program": ("program/Commands/Start", True),
        }
        await self._write(*metrics[what])

    async def stop(self, what: str) -> None:
        metrics = {"axis": f"M{AXIS}/Commands/Stop", "controller": "Commands/Stop", "program": "program/Commands/Stop"}
        await self._write(metrics[what], True)


@asynccontextmanager
async def sparkplug(rig: AnyRig) -> AsyncGenerator[Way]:
    node = EdgeNode(rig)
    node.face.start(pytest.fail)
    node.face.will()
    session = asyncio.create_task(node.face.run(node))
    while not node.is_born:  # an E type takes its time
        await rig.wait(0.1)
    yield node
    session.cancel()
    node.face.close()


class Records:
    def __init__(self, rig: AnyRig, leases: JogLeases) -> None:
        self._numbers = rig.numbers
        sampler = Sampler(rig.subject.samples, {})
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
            "move": (axis, "VAL", self._numbers.distance),
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
async def epics(rig: AnyRig) -> AsyncGenerator[Way]:
    leases = JogLeases(rig.subject)
    records = Records(rig, leases)
    motor = records._records[f"ST:table:M{AXIS}"]
    await motor.refresh()
    for field in ("HVEL", "JVEL"):
        await motor.put(Putter("one", "one", 1), field, rig.numbers.velocity)
    yield records
    leases.close()


def _spec(table: str) -> Any:
    (found,) = read_device_file("cell.toml", f'[[device]]\nname = "table"\naddress = "/dev/ttyUSB0"\n{table}').services.gateways
    return found


WAYS: dict[str, Callable[[AnyRig], Any]] = {
    one.__name__: one for one in (control, websocket, rest, modbus, opcua, mqtt, sparkplug, epics)
}
STUDIO = ("websocket", "rest")

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


@pytest.mark.parametrize("name", [name for name in WAYS if name != "control"])
def test_what_was_asked_for_before_a_stop_does_not_begin_after_it(name: str) -> None:
    async def story() -> None:
        rig: Any = BridgeRig()
        rig.numbers = MILLIMETRES
        await rig.open()
        async with WAYS[name](rig) as way:
            further = ("all", "registers") if name in STUDIO else ()
            for what in MOTIONS:
                for place in PLACES:
                    for stop in ("axis", "controller", *further) if what != "program" else ("program", *further[:1]):
                        if (name, what) != ("sparkplug", "jog"):  # it has no jog
                            await check_case(rig, way, what, place, stop)
        await rig.close()

    run_virtually(story())


@pytest.mark.parametrize(("name", "end"), [("opcua", "leave"), ("mqtt", "leave"), ("epics", "leave"), ("epics", "release")])
def test_a_jog_whose_client_lets_go_before_it_begins_does_not_last(name: str, end: str) -> None:
    async def story() -> None:
        rig: AnyRig = BridgeRig()
        rig.numbers = MILLIMETRES
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


# ---------------------------------------------------------------------- a stop at a moment


RIGS: dict[str, tuple[Callable[[], Any], Numbers]] = {
    "MIC488": (lambda: UpRig("MIC488", is_slow=False), MILLIMETRES),
    "MIC488 on a slow line": (lambda: UpRig("MIC488", is_slow=True), MILLIMETRES),
    **{f"M1486{one}": (partial(UpRig, one, is_slow=False), MICROSTEPS) for one in ("A", "B", "C", "E1", "E2")},
    "M1486B on a slow line": (lambda: UpRig("B", is_slow=True), MICROSTEPS),
    "M1486E1 on a slow line": (lambda: UpRig("E1", is_slow=True), MICROSTEPS),
    "M1486B behind a bridge": (lambda: ChipBridgeRig("B"), FULL_STEPS),
    "M1486E1 behind a bridge": (lambda: ChipBridgeRig("E1"), FULL_STEPS),
}
MOMENTS_S = {"MIC488": (0.0, 0.003, 0.008, None), "slow": (0.0, 0.3, None), "M1486": (0.0, 0.002, None), "E": (0.0, 0.3, None)}
"""At once, in the time that a command takes until it moves something, and after it."""


FEW = ("MIC488 on a slow line", "M1486B", "M1486E1", "M1486B behind a bridge")
TRIED = {
    "control": [kind for kind in RIGS if "bridge" not in kind],
    "websocket": FEW,
    "rest": (*FEW, "M1486E1 behind a bridge"),
    "opcua": ("MIC488 on a slow line", "M1486E1"),
    "mqtt": FEW,
    "sparkplug": FEW,
    "epics": FEW,
}
"""By way: one has all kinds of worlds, for behind all of them is the same subject. Masters reach a world by its line."""


def moments_of(kind: str, what: str) -> tuple[float | None, ...]:
    if what == "begin" and "bridge" in kind:
        return (None,)  # it is not asked for by this way
    if kind.startswith("MIC488"):
        return MOMENTS_S["MIC488"]
    return MOMENTS_S["slow" if "slow" in kind else "E" if "E" in kind else "M1486"]


async def trial(rig: AnyRig, way: Way, what: str, stop: str, delay_s: float | None) -> str | None:
    """What was wrong; None if nothing was. Without ``delay_s`` it is stopped when it has begun."""
    case = f"{what}, stopped ({stop}) {'when it had begun' if delay_s is None else f'after {delay_s:g} s'}"
    begin = rig.now
    asked = asyncio.create_task(_asked(rig.begin_program(PROGRAM) if what == "begin" else way.ask(what)))
    if delay_s is None:
        while not rig.is_moving and rig.now < begin + LONGEST_S * SECOND and (not asked.done() or asked.result() == "done"):
            await rig.wait(0.02)
    await rig.wait(delay_s or 0.0)
    stopped = await asyncio.create_task(_asked(way.stop(stop)))
    at = rig.now
    if stopped != "done":
        return f"{case}: {stopped}"
    await rig.wait(QUIET_S)
    if late := [moment for moment in rig.begun if moment > at]:
        return f"{case}: a motion began {(late[0] - at) / SECOND:.3f} s behind the stop"
    if rig.is_moving:
        return f"{case}: it moves on"
    try:
        async with asyncio.timeout(LONGEST_S):
            outcome = await asked
    except TimeoutError:
        return f"{case}: there was no answer"
    if delay_s is None and outcome == "done" and not [moment for moment in rig.begun if begin <= moment <= at]:
        return f"{case}: it had not begun"
    return None


def cases(way: str, kind: str) -> list[tuple[str, str]]:
    everything = ("all",) if way in (*STUDIO, "control") else ()
    if kind.startswith("MIC488"):
        motions = [(what, stop) for what in ("move", "jog", "home") for stop in ("axis", "controller", *everything)]
        return motions + [("program", stop) for stop in ("program", *everything)]
    return [(what, stop) for what in ("move", "jog", "begin") for stop in ("axis", "controller", "program", *everything)]


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name, kinds in TRIED.items() for kind in kinds])
def test_nothing_begins_after_a_stop(name: str, kind: str) -> None:
    make, numbers = RIGS[kind]
    wanted = [
        (what, stop, delay_s)
        for what, stop in cases(name, kind)
        if (name, what) != ("sparkplug", "jog")
        for delay_s in moments_of(kind, what)
    ]

    async def story(of: list[tuple[str, str, float | None]]) -> list[str]:
        rig: AnyRig = make()
        rig.numbers = numbers
        await rig.open()
        if kind.startswith("MIC488"):
            await rig.subject.do(command.Enable("table", AXIS, on=True))
            await rig.wait(0.1)
        async with WAYS[name](rig) as way:
            found = [await trial(rig, way, *one) for one in of]
        await rig.close()
        return [fault for fault in found if fault is not None]

    # A stop makes the position of an M1486 unknown, and a record of EPICS moves to positions only.
    alone = [one for one in wanted if name == "epics" and one[0] == "move"]
    stories = [*([one] for one in alone), [one for one in wanted if one not in alone]]
    wrong = [fault for of in stories for fault in run_virtually(story(of))]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", ["websocket", "rest"])
def test_a_stop_that_failed_is_an_error_with_the_name(name: str) -> None:
    """`rest` checks that its status is not 200, too."""

    async def story() -> None:
        rig: AnyRig = ChipBridgeRig("B")
        rig.numbers = FULL_STEPS
        await rig.open()
        async with WAYS[name](rig) as way:
            rig.wire.severed = True
            for stop in ("all", "controller", "axis"):
                said = await _asked(way.stop(stop))
                assert "'code': 'failure'" in said
                assert "chip 7" in said
                assert stop != "all" or "not stopped: table (" in said
        await rig.close()

    run_virtually(story())
