"""A gateway that publishes nothing any more because of an error in it says so."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest
from gateway_rig import GatewayWorld

from steptwin import World
from steptwin.gateways import make_gateway
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.mqtt.jsonface import JsonFace
from steptwin.gateways.sampling import Sampler
from steptwin.history.keeper import HistoryKeeper

HALL = '[[mic488]]\nname = "table"\n'
OPCUA = '[gateway.opcua]\nlisten = "127.0.0.1:0"\n'
EPICS = '[gateway.epics]\nprefix = "ST:"\nlisten = "127.0.0.1:0"\nbeacons = "127.0.0.1:1"\n'


@pytest.mark.parametrize(("table", "name"), [(OPCUA, "opcua"), (EPICS, "epics")])
def test_an_error_in_it_is_told_and_shown(table: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    (spec,) = World.from_toml(HALL + table).spec.gateways
    gateway = make_gateway(spec, subject, tmp_path)
    told: list[str] = []

    def broken() -> None:
        raise KeyError("M9")

    async def scene() -> None:
        is_told = asyncio.Event()

        def notice(text: str) -> None:
            told.append(text)
            is_told.set()

        await gateway.open(listen_any=False, notice=notice)
        assert gateway.state()[:2] == (True, "listens")
        monkeypatch.setattr(subject.samples, "see_events", broken)
        async with asyncio.timeout(20):
            await is_told.wait()
        assert gateway.state()[:2] == (False, "internal error, please report it: KeyError: 'M9'")
        await gateway.close()

    asyncio.run(scene())
    assert told == [f"[gateway.{name}]: internal error, please report it: KeyError: 'M9'"]


def test_an_error_in_the_look_of_a_client_of_epics_is_told_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    (spec,) = World.from_toml(HALL + EPICS).spec.gateways
    gateway = make_gateway(spec, subject, tmp_path)
    told: list[str] = []

    async def broken(*_: object) -> None:
        raise KeyError("M9")

    async def scene() -> None:
        is_told = asyncio.Event()

        def notice(text: str) -> None:
            told.append(text)
            is_told.set()

        monkeypatch.setattr(EpicsController, "is_busy", True)
        monkeypatch.setattr(Sampler, "take", broken)
        await gateway.open(listen_any=False, notice=notice)
        async with asyncio.timeout(20):
            await is_told.wait()
        assert gateway.state()[:2] == (False, "internal error, please report it: KeyError: 'M9'")
        await gateway.close()

    asyncio.run(scene())
    assert told == ["[gateway.epics]: internal error, please report it: KeyError: 'M9'"]


@pytest.mark.parametrize("keys", ["", 'sparkplug = { group = "plant", node = "cell" }\n'])
def test_an_error_in_it_is_told_without_a_broker_too(keys: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    (spec,) = World.from_toml(f'{HALL}[gateway.mqtt]\nbroker = "127.0.0.1:1"\n{keys}').spec.gateways
    gateway = make_gateway(spec, subject, tmp_path)
    error = "internal error, please report it: KeyError: 'M9'"
    is_told = asyncio.Event()

    def notice(text: str) -> None:
        if text == f"[gateway.mqtt]: {error}":
            is_told.set()

    def broken(*_: object) -> None:
        raise KeyError("M9")

    async def scene() -> None:
        monkeypatch.setattr(subject.samples, "see_events", broken)
        monkeypatch.setattr(JsonFace, "will", broken)
        await gateway.open(listen_any=False, notice=notice)
        async with asyncio.timeout(20):
            await is_told.wait()
        assert gateway.state()[:2] == (False, error)
        await gateway.close()

    asyncio.run(scene())


def test_an_error_in_the_reading_of_a_device_ends_what_is_published(monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    (part,) = subject.description.machines
    real = replace(subject.description, machines=(replace(part, is_real=True),))
    monkeypatch.setattr(GatewayWorld, "description", real)
    subject.silence = KeyError("M9")
    subject.silent.add("table")

    async def scene() -> None:
        sampler = Sampler(subject, {})
        sampler.watch(["table"])

        async def sample() -> None:
            for _ in range(100):
                await sampler.changed(0.1)

        with pytest.raises(KeyError, match="M9"):
            await sample()

    asyncio.run(scene())


def test_an_error_that_ends_the_history_is_told_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    spec = World.from_toml(HALL + '[history]\ndatabase = "sqlite:///past.sqlite"\n').spec.history
    assert spec is not None
    keeper = HistoryKeeper(spec, subject, tmp_path)
    told: list[str] = []
    is_told = asyncio.Event()

    def notice(text: str) -> None:
        told.append(text)
        is_told.set()

    def broken() -> None:
        raise KeyError("M9")

    async def scene() -> None:
        await keeper.open(listen_any=False, notice=notice)
        monkeypatch.setattr(subject.samples, "see_events", broken)
        async with asyncio.timeout(20):
            await is_told.wait()
        assert keeper.state()[:2] == (False, "internal error, please report it: KeyError: 'M9'")
        await keeper.close()

    asyncio.run(scene())
    assert told[0] == "history: internal error, please report it: KeyError: 'M9'"
