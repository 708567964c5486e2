"""A gateway that publishes nothing any more because of an error in it says so."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from gateway_rig import GatewayWorld

from steptwin import World
from steptwin.gateways import make_gateway
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
        monkeypatch.undo()
        await keeper.close()

    asyncio.run(scene())
    assert told[0] == "history: internal error, please report it: KeyError: 'M9'"
