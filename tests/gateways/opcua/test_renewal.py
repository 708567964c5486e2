"""A certificate of the server that expires while it runs: it is told, and a new one is taken without a restart."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asyncua import Client
from cryptography.x509 import load_der_x509_certificate, load_pem_x509_certificate
from gateway_rig import GatewayWorld

from steptwin import World
from steptwin.files.certificate import make_certificate
from steptwin.gateways.kinds import read_gateways
from steptwin.gateways.opcua import gateway as opcua
from steptwin.gateways.opcua import security
from steptwin.gateways.opcua.options import OpcUaSpec

HALL = '[[mic488]]\nname = "table"\n[gateway.opcua]\nlisten = "127.0.0.1:0"\nsecurity = "sign"\n'
KEYS = 'certificate = "own/certificate.pem"\nkey = "own/key.pem"\n'
LATER = timedelta(days=40_000)


async def serial_number(url: str) -> int:
    """Of the certificate that clients are shown."""
    async with asyncio.timeout(20):
        found = await Client(url).connect_and_get_server_endpoints()
    return load_der_x509_certificate(found[0].ServerCertificate).serial_number


def test_it_expires_and_is_renewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opcua, "LOOK_S", 0.02)
    moment = [datetime.now(UTC)]
    monkeypatch.setattr(security, "present", lambda: moment[0])
    first, key = make_certificate(tmp_path / "own", [], 2)
    (tmp_path / "new").mkdir()
    second, second_key = make_certificate(tmp_path / "new", [], 2)
    told: list[str] = []
    (spec,) = read_gateways(World.from_toml(HALL + KEYS).spec.text)
    assert isinstance(spec, OpcUaSpec)
    gateway = opcua.make(spec, GatewayWorld(HALL), tmp_path)

    async def until(is_so: Callable[[], bool]) -> None:
        for _ in range(2000):
            if is_so():
                return
            await asyncio.sleep(0.01)
        raise AssertionError(gateway.state())

    async def scene() -> None:
        url = str((await gateway.open(listen_any=False, notice=told.append))["url"])
        assert gateway.state()[:2] == (True, "listens")
        assert await serial_number(url) == load_pem_x509_certificate(first.read_bytes()).serial_number
        moment[0] += LATER
        await until(lambda: not gateway.state().is_up)
        assert gateway.state().text.startswith("own/certificate.pem has expired on ")
        first.write_bytes(b"not yet")
        await until(lambda: "own/certificate.pem, own/key.pem: " in gateway.state().text)
        first.write_bytes(second.read_bytes())
        await until(lambda: gateway.state().text.endswith("key.pem: they do not belong together"))
        moment[0] -= LATER
        key.write_bytes(second_key.read_bytes())
        await until(lambda: gateway.state().is_up)
        assert await serial_number(url) == load_pem_x509_certificate(second.read_bytes()).serial_number
        await gateway.close()

    asyncio.run(scene())
    assert told[0].startswith("[gateway.opcua]: own/certificate.pem has expired on ")
    assert told[0].endswith(" UTC: clients refuse it; renew it")
    assert told[-1] == "[gateway.opcua]: own/certificate.pem has been renewed; clients have to connect again"


def test_one_that_is_valid_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opcua, "LOOK_S", 0.01)
    make_certificate(tmp_path / "own", [], 2)
    told: list[str] = []
    (spec,) = read_gateways(World.from_toml(HALL + KEYS).spec.text)
    assert isinstance(spec, OpcUaSpec)
    gateway = opcua.make(spec, GatewayWorld(HALL), tmp_path)

    async def scene() -> None:
        await gateway.open(listen_any=False, notice=told.append)
        await asyncio.sleep(0.05)
        await gateway.close()
        assert not gateway.state().is_up

    asyncio.run(scene())
    assert told == []
