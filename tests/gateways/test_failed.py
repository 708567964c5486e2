"""A gateway that publishes nothing any more because of an error in it says so."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from gateway_rig import GatewayWorld

from steptwin import World
from steptwin.gateways.contract import Gateway
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.kinds import make_gateway, read_gateways
from steptwin.gateways.mqtt.jsonface import JsonFace
from steptwin.gateways.sampling import Sampler
from steptwin.history.keeper import HistoryKeeper
from steptwin.history.options import read_history

HALL = '[[mic488]]\nname = "table"\n'
OPCUA = '[gateway.opcua]\nlisten = "127.0.0.1:0"\n'
EPICS = '[gateway.epics]\nprefix = "ST:"\nlisten = "127.0.0.1:0"\nbeacons = "127.0.0.1:1"\n'
ERROR = "internal error, please report it: KeyError: 'M9'"


def broken(*_: object) -> None:
    raise KeyError("M9")


async def broken_later(*_: object) -> None:
    broken()


def told_by(part: Gateway | HistoryKeeper, break_it: Callable[[], None], *, at_first: bool = False) -> list[str]:
    """The notices until one is about the error, which its state shows, too; it is broken once it is open, or ``at_first``."""
    told: list[str] = []

    async def scene() -> None:
        is_told = asyncio.Event()

        def notice(text: str) -> None:
            told.append(text)
            if ERROR in text:
                is_told.set()

        if at_first:
            break_it()
        await part.open(listen_any=False, notice=notice)
        if not at_first:
            break_it()
        async with asyncio.timeout(20):
            await is_told.wait()
        assert part.state()[:2] == (False, ERROR)
        await part.close()

    asyncio.run(scene())
    return told


def opened(table: str, subject: GatewayWorld, folder: Path) -> Gateway:
    (spec,) = read_gateways(World.from_toml(HALL + table).spec.text)
    return make_gateway(spec, subject, folder)


@pytest.mark.parametrize(("table", "name"), [(OPCUA, "opcua"), (EPICS, "epics")])
def test_an_error_in_it_is_told_and_shown(table: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    told = told_by(opened(table, subject, tmp_path), lambda: monkeypatch.setattr(subject.samples, "see_events", broken))
    assert told == [f"[gateway.{name}]: {ERROR}"]


def test_an_error_in_the_look_of_a_client_of_epics_is_told_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def break_it() -> None:
        monkeypatch.setattr(EpicsController, "is_busy", True)
        monkeypatch.setattr(Sampler, "take", broken_later)

    assert told_by(opened(EPICS, GatewayWorld(HALL), tmp_path), break_it, at_first=True) == [f"[gateway.epics]: {ERROR}"]


@pytest.mark.parametrize("keys", ["", 'sparkplug = { group = "plant", node = "cell" }\n'])
def test_an_error_in_it_is_told_without_a_broker_too(keys: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)

    def break_it() -> None:
        monkeypatch.setattr(subject.samples, "see_events", broken)
        monkeypatch.setattr(JsonFace, "will", broken)

    gateway = opened(f'[gateway.mqtt]\nbroker = "127.0.0.1:1"\n{keys}', subject, tmp_path)
    assert f"[gateway.mqtt]: {ERROR}" in told_by(gateway, break_it, at_first=True)


def test_an_error_in_the_reading_of_a_device_ends_what_is_published(monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    (part,) = subject.description.controllers
    real = replace(subject.description, controllers=(replace(part, is_real=True),))
    monkeypatch.setattr(GatewayWorld, "description", real)
    subject.silence = KeyError("M9")
    subject.silent.add("table")

    async def scene() -> None:
        sampler = Sampler(subject.samples, {})
        sampler.watch(["table"])

        async def sample() -> None:
            for _ in range(100):
                await sampler.changed(0.1)

        with pytest.raises(KeyError, match="M9"):
            await sample()

    asyncio.run(scene())


def test_an_error_that_ends_the_history_is_told_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subject = GatewayWorld(HALL)
    spec = read_history(World.from_toml(HALL + '[history]\ndatabase = "sqlite:///past.sqlite"\n').spec.text)
    assert spec is not None
    keeper = HistoryKeeper(spec, subject, tmp_path)
    assert told_by(keeper, lambda: monkeypatch.setattr(subject.samples, "see_events", broken))[0] == f"history: {ERROR}"
