"""The Sparkplug face without a broker: what is kept meanwhile, states of the host, clocks that jump."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from datetime import datetime, timedelta, tzinfo
from typing import Any

import pytest
from aiomqtt import Message
from aiomqtt.exceptions import MqttError
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.access.roles import Role
from steptwin.controller import MILLISECOND
from steptwin.gateways import sampling
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.mqtt.connection import Publication, SessionOver
from steptwin.gateways.mqtt.sparkplug import SparkplugFace
from steptwin.gateways.mqtt.sparkplugcodec import SparkplugMetric, SparkplugPayload, SparkplugType, decode_payload, encode_payload
from steptwin.gateways.mqtt.sparkplugmetrics import Namespace, rows_of
from steptwin.gateways.sampling import Sampler
from steptwin.subject import commands as command

WORLD = '[[mic488]]\nname = "table"\n[mic488.M1]\nunit = "mm"\nvel = 40.0\n'
INTERVAL_S = 0.1


class Broker:
    """A link that takes everything, until it is broken."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, SparkplugPayload]] = []
        self.topics: list[str] = []
        self.is_broken = False

    async def publish(self, one: Publication) -> None:
        if self.is_broken:
            raise MqttError("the connection was lost")
        self.sent.append((one.topic.split("/")[2], decode_payload(one.payload)))

    async def publish_all(self, all_of: Any) -> None:
        for one in all_of:
            await self.publish(one)

    async def subscribe(self, topic: str, *, retained: bool) -> None:
        self.topics.append(topic)

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.sent]


class Rig:
    def __init__(self, *, store: int = 1000, host: str | None = None) -> None:
        self.world = GatewayWorld(WORLD)
        rows = rows_of(self.world.description, {})
        self.names = {row.alias: row.name for of in rows.values() for row in of}
        self.aliases = {name: alias for alias, name in self.names.items()}
        self.face = SparkplugFace(
            Namespace("plant", "hall", host),
            rows,
            self.world,
            Sampler(self.world.samples, {}),
            GatewayClient("anybody", Role.ENGINEER, "MQTT, Sparkplug B"),
            interval=round(INTERVAL_S * 1000) * MILLISECOND,
            store=store,
        )
        self.face.start(pytest.fail)
        self.broker = Broker()
        self.session: asyncio.Task[None] | None = None

    async def connect(self) -> None:
        self.face.will()
        self.broker = Broker()
        self.session = asyncio.create_task(self.face.run(self.broker))
        await self.tick()

    async def lose(self) -> None:
        assert self.session is not None
        self.session.cancel()
        await asyncio.wait((self.session,))
        self.face.lost()

    async def tick(self, times: int = 2) -> None:
        for _ in range(times):
            self.world.inner.do(command.Advance(duration=round(INTERVAL_S * 1e9)))
            await asyncio.sleep(INTERVAL_S)

    def move(self, to: float) -> None:
        self.world.inner.do(command.Enable("table", 1))
        self.world.inner.do(command.Move("table", 1, to=to))

    def metrics(self, name: str, kind: str = "DDATA") -> list[SparkplugMetric]:
        found = [metric for sent, payload in self.broker.sent if sent == kind for metric in payload.metrics]
        return [metric for metric in found if self.names.get(metric.alias or 0) == name]

    def message(self, topic: str, payload: bytes, *, retained: bool = False) -> None:
        self.face.take(self.broker, Message(topic, payload, 1, retained, 1, None))


def numbers(found: list[SparkplugMetric]) -> list[float]:
    return [metric.value for metric in found if isinstance(metric.value, int | float)]


def story(act: Callable[[], Awaitable[Rig]]) -> None:
    async def play() -> None:
        rig = await act()
        rig.face.close()
        if rig.session is not None:
            await rig.lose()

    run_virtually(play())


def test_it_subscribes_before_it_is_born() -> None:
    async def act() -> Rig:
        rig = Rig(host="scada")
        await rig.tick()
        await rig.connect()
        assert rig.broker.topics == ["spBv1.0/plant/NCMD/hall", "spBv1.0/plant/DCMD/hall/+", "spBv1.0/STATE/scada"]
        assert rig.broker.kinds == []
        rig.message("spBv1.0/STATE/scada", b'{"online": true, "timestamp": 5}')
        await rig.tick()
        assert rig.broker.kinds[:2] == ["NBIRTH", "DBIRTH"]
        return rig

    story(act)


def test_what_changed_meanwhile_is_historical_and_in_order() -> None:
    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        await rig.lose()
        rig.move(40.0)
        await rig.tick(20)
        await rig.connect()
        stored = rig.metrics("M1/position")
        assert len(stored) > 8
        assert all(metric.is_historical for metric in stored)
        values = numbers(stored)
        assert values == sorted(set(values)), "each once"
        assert rig.broker.kinds[:2] == ["NBIRTH", "DBIRTH"]
        assert [payload.seq for _, payload in rig.broker.sent] == list(range(len(rig.broker.sent)))
        rig.move(80.0)
        await rig.tick(4)
        live = rig.metrics("M1/position")[len(stored) :]
        assert live
        assert not any(metric.is_historical for metric in live)
        return rig

    story(act)


def test_what_is_kept_is_bounded_and_what_is_lost_is_counted() -> None:
    async def act() -> Rig:
        rig = Rig(store=10)
        await rig.tick()
        rig.move(400.0)
        await rig.tick(30)
        await rig.connect()
        sent = [metric for kind, payload in rig.broker.sent if kind.endswith("DATA") for metric in payload.metrics]
        stored = [metric for metric in sent if metric.is_historical]
        assert len(stored) == 10
        (dropped,) = rig.metrics("Store/Dropped", "NBIRTH")
        assert isinstance(dropped.value, int)
        assert dropped.value > 10
        return rig

    story(act)


def test_a_session_that_is_lost_while_it_sends_loses_nothing() -> None:
    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        rig.move(400.0)
        await rig.tick()
        rig.broker.is_broken = True
        await rig.tick(4)
        assert rig.session is not None
        assert isinstance(rig.session.exception(), MqttError)
        before = numbers(rig.metrics("M1/position"))
        rig.face.lost()
        await rig.connect()
        after = rig.metrics("M1/position")
        assert all(metric.is_historical for metric in after[:2]), "they are older than the birth"
        values = [*before, *numbers(after)]
        assert values == sorted(set(values))
        return rig

    story(act)


@pytest.mark.parametrize(
    "payload",
    [b"", b"ONLINE", b"[]", b"{}", b'{"online": 1, "timestamp": 5}', b'{"online": true}', b'{"online": true, "timestamp": "5"}'],
)
def test_a_state_that_is_none_is_not_taken(payload: bytes) -> None:
    async def act() -> Rig:
        rig = Rig(host="scada")
        await rig.tick()
        await rig.connect()
        rig.message("spBv1.0/STATE/scada", payload)
        await rig.tick()
        assert rig.broker.kinds == []
        return rig

    story(act)


def test_it_leaves_when_its_host_does() -> None:
    async def act() -> Rig:
        rig = Rig(host="scada")
        await rig.tick()
        await rig.connect()
        rig.message("spBv1.0/STATE/scada", b'{"online": true, "timestamp": 5}')
        await rig.tick()
        rig.message("spBv1.0/STATE/scada", b'{"online": false, "timestamp": 4}')
        with pytest.raises(SessionOver, match="the primary host scada is offline"):
            rig.message("spBv1.0/STATE/scada", b'{"online": false, "timestamp": 5}')
        await rig.face.leave(rig.broker)
        kind, payload = rig.broker.sent[-1]
        assert (kind, payload.seq, payload.metrics[0].name, payload.metrics[0].value) == ("NDEATH", None, "bdSeq", 0)
        return rig

    story(act)


def test_bdseq_goes_from_0_to_255_and_round() -> None:
    async def act() -> Rig:
        rig = Rig()
        wills = []
        for _ in range(257):
            for _ in range(3):  # the broker cannot be reached twice
                will = decode_payload(rig.face.will().payload).metrics[0].value
            wills.append(will)
            session = asyncio.create_task(rig.face.run(rig.broker))
            await asyncio.sleep(0)
            session.cancel()
            await asyncio.wait((session,))
        assert wills == [*range(256), 0]
        return rig

    story(act)


def test_a_silent_controller_is_dead_and_its_birth_tells_all() -> None:
    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        rig.move(400.0)
        await rig.tick(3)
        rig.world.silent.add("table")
        await rig.tick(3)
        assert rig.broker.kinds[-1] == "DDEATH"
        count = len(rig.broker.sent)
        await rig.tick(30)
        assert [kind for kind in rig.broker.kinds[count:] if kind.startswith("D")] == []
        rig.world.silent.clear()
        await rig.tick(12)
        later = [kind for kind in rig.broker.kinds[count:] if kind.startswith("D")]
        assert later[0] == "DBIRTH"
        return rig

    story(act)


def test_a_wall_clock_that_goes_back_repeats_and_delays_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wall:
        offset = timedelta()

        @classmethod
        def now(cls, zone: tzinfo) -> datetime:
            return datetime.now(zone) + cls.offset

    monkeypatch.setattr(sampling, "datetime", Wall)

    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        rig.move(400.0)
        await rig.tick(5)
        Wall.offset = timedelta(hours=-1)
        await rig.tick(5)
        Wall.offset = timedelta(days=2)
        await rig.tick(5)
        found = rig.metrics("M1/position")
        assert len(found) >= 12
        assert numbers(found) == sorted(set(numbers(found))), "in order, and once"
        assert not any(metric.is_historical for metric in found)
        return rig

    story(act)


def test_a_command_by_name_or_alias_and_none_that_is_retained() -> None:
    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        noted: list[tuple[str, ...]] = []
        rig.world.audit = lambda who, do, fields, outcome: noted.append((str(who), do, outcome))
        enable = SparkplugMetric(name="M1/Commands/Enable", type=SparkplugType.BOOLEAN, value=True)
        by_alias = SparkplugMetric(alias=rig.aliases["M2/Commands/Enable"], type=None, value=None)
        rig.message("spBv1.0/plant/DCMD/hall/table", encode_payload(SparkplugPayload(metrics=(enable,))), retained=True)
        rig.message("spBv1.0/plant/DCMD/hall/nobody", encode_payload(SparkplugPayload(metrics=(enable,))))
        rig.message("spBv1.0/plant/DCMD/hall/table", b"\xff")
        await rig.tick()
        assert not any(isinstance(one, command.Enable) for one in rig.world.done)
        rig.message("spBv1.0/plant/DCMD/hall/table", encode_payload(SparkplugPayload(metrics=(enable, by_alias))))
        await rig.tick()
        assert [one for one in rig.world.done if isinstance(one, command.Enable)] == [command.Enable("table", 1)]
        who = "anybody (MQTT, Sparkplug B)"
        assert sorted(noted) == [(who, "enable", "done"), (who, "write", "misuse")]
        assert "None: expected true or false" in str(rig.metrics("Commands/Result")[-1].value)
        return rig

    story(act)


def test_every_command_has_a_result() -> None:
    wanted = {
        "M1/position": (5.0, "it can only be read"),
        "M9/nothing": (5.0, "the device has no metric of that name"),
        "pins/AIN1": (-1.0, "-1.0: permitted are numbers from 0 to 10"),
        "M1/Commands/MoveTo": (5.0, "position command ignored: M1 is not enabled: switch its drive on first"),
    }

    async def act() -> Rig:
        rig = Rig()
        await rig.tick()
        await rig.connect()
        logged: list[str] = []
        rig.world.audit = lambda who, do, fields, outcome: logged.append(f"{fields.get('metric', do)}: {outcome}")
        for name, (value, _) in wanted.items():
            metric = SparkplugMetric(name=name, type=SparkplugType.DOUBLE, value=value)
            rig.message("spBv1.0/plant/DCMD/hall/table", encode_payload(SparkplugPayload(metrics=(metric,))))
            await rig.tick()
        results = [str(one.value) for one in rig.metrics("Commands/Result")]
        for result, (name, (_, why)) in zip(results, wanted.items(), strict=True):
            assert result.startswith(f"{name}: ")
            assert why in result
        assert logged == [*(f"{name}: misuse" for name in list(wanted)[:3]), "move: ignored: not enabled"]
        return rig

    story(act)


def test_topics() -> None:
    assert Namespace("g", "n", "h").state == "spBv1.0/STATE/h"
    assert (Namespace("g", "n", None)("NBIRTH"), Namespace("g", "n", None)("DDATA", "d")) == (
        "spBv1.0/g/NBIRTH/n",
        "spBv1.0/g/DDATA/n/d",
    )
