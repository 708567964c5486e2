"""Motor records and others for independent clients: ophyd-async's Motor, pyepics, pvaPy; each in a process of its own."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import GatewayWorld, running, served
from tests.gateways.opcua.test_bridge import free_port

from steptwin import World
from steptwin.gateways.epics import gateway as epics
from steptwin.gateways.epics.options import EpicsSpec
from steptwin.gateways.kinds import read_gateways
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.toml.reader import WorldError

CLIENTS = Path(__file__).parents[1] / "clients"
TABLE = """
    [[mic488]]
    name = "table"
    [gateway.epics]
    prefix = "ST:"
    listen = "127.0.0.1:0"
"""


def client(program: str, port: int, name: str) -> dict[str, Any]:
    return run_client(program, name, EPICS_CA_ADDR_LIST=f"127.0.0.1:{port}", EPICS_CA_AUTO_ADDR_LIST="NO")


def run_client(program: str, name: str, **variables: str) -> dict[str, Any]:
    environment = {**os.environ, **variables}
    done = subprocess.run(
        [sys.executable, str(CLIENTS / program), name], env=environment, capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


EXPECTED = {
    "while it is off": True,
    "moved": [1, 30.0, 30.0],
    "stopped": [True, True],
    "dial limits": [0.0, 100.0],
    "limit of the client": True,
    "limit of the record": [True, 1, [40.0, 40.0]],
    "no limits": True,
    "velocity": [500.0, 1.0],
    "set": [7.0, 7.0, -113.0, 120.0],
    "paused": [0, False, 7.0],
    "moved on": [17.0, 17.0, 1],
}


def test_a_motor_of_ophyd_async(tmp_path: Path) -> None:
    with served(TABLE, tmp_path, "--audit", str(tmp_path / "audit")) as points:
        assert client("ophyd_motor.py", points["epics"]["port"], "ST:table:M1") == EXPECTED
    first = json.loads((tmp_path / "audit").read_text().splitlines()[0])
    assert "(EPICS, 127.0.0.1:" in first["viewer"]
    assert (first["do"], first["fields"]["controller"]) == ("move", "table")


def test_a_motor_of_a_device_behind_the_bridge(tmp_path: Path) -> None:
    """The device is a served twin."""
    port = free_port()
    cell = f'[[device]]\nname = "table"\naddress = "127.0.0.1:{port},kind=mic488"\n[gateway.epics]\nlisten = "127.0.0.1:0"\n'
    (tmp_path / "cell.toml").write_text(cell)
    with (
        running(tmp_path, "serve", "mic488", "--tcp", f"127.0.0.1:{port}"),
        running(tmp_path, "bridge", "cell.toml") as points,
    ):
        assert client("ophyd_motor.py", points["epics"]["port"], "table:M1") == EXPECTED


def test_records_for_pyepics(tmp_path: Path) -> None:
    with served(f'{TABLE}registers = ["table.USER_REGISTER[5]"]\n', tmp_path) as points:
        assert client("pyepics_records.py", points["epics"]["port"], "ST:table:") == {
            "moved": [20.0, 1, 0],
            "tweaked": [17.0, 0],
            "turned": [17.0, 17.0, 34.0],
            "jogs": [1, True],
            "jogged": [0, True, True],
            "values": [1, 42.0, "ok", "imp", "ST:table:M1"],
            "alarm": 0,
            "stopped": [True, True],
        }


PV_EXPECTED = {
    "types": [f"epics:nt/{name}:1.0" for name in ("NTScalar", "NTScalar", "NTEnum", "NTScalar", "NTEnum")],
    "while it is off": (
        "channel ST:table:M1 PvaClientPut::put table: position command ignored: M1 is not enabled: switch its drive on first"
    ),
    "moved": [30.0, 30.0, 1],
    "seen": [1, 0, 1, 0, 1],
    "by": 20.0,
    "display": ["imp", 0, -(2.0**31), 2.0**31 - 1, "Position."],
    "time": True,
    "alarm": {"severity": 0, "status": 0, "message": ""},
    "velocity": ["imp/s", "s"],
    "limits": [-5.0, 40.0, -5.0, 40.0],
    "beyond": [
        "channel ST:table:M1 PvaClientPut::put table M1: 50 imp: permitted are -5 to 40 imp (LLM, HLM)",
        1,
        20.0,
    ],
    "states": {"index": 3, "choices": ["Stop", "Pause", "Move", "Go"]},
    "no state": "index '9' out of bounds",
    "read only": "channel ST:table:M1.RBV PvaClientPut::put RBV cannot be put",
    "on its way": 0,
    "stopped": [True, True],
    "a jog ends with its channel": 0,
    "values": [1, 42.0, "ok", "ST:table:M1"],
    "unknown": {"severity": 3, "status": 6, "message": "not known"},
    "stopped by the controller": True,
}


def test_records_for_pvapy(tmp_path: Path) -> None:
    """Over PV Access, found by a search."""
    with served(f'{TABLE}pva = "127.0.0.1:0"\nregisters = ["table.USER_REGISTER[5]"]\n', tmp_path) as points:
        pva = points["epics"]["pva"]
        search = {"EPICS_PVA_ADDR_LIST": pva["host"], "EPICS_PVA_BROADCAST_PORT": str(pva["search_port"])}
        found = run_client("pvapy_records.py", "ST:table:", **search, EPICS_PVA_AUTO_ADDR_LIST="NO")
    assert found == PV_EXPECTED


def test_clients_of_pv_access_are_listed() -> None:
    """By their address, with the channels that they have."""
    text = f'{TABLE}pva = "127.0.0.1:0"\n'
    (spec,) = read_gateways(World.from_toml(text).spec.text)
    assert isinstance(spec, EpicsSpec)
    gateway = epics.make(spec, GatewayWorld(text), Path())
    program = (
        "import pvaccess, sys\nc = pvaccess.Channel('ST:table:M1.VELO')\nc.setTimeout(30.0)\nc.put(5.0)\n"
        "print('put', flush=True)\nsys.stdin.read()"
    )

    async def scene() -> None:
        pva: Any = (await gateway.open(listen_any=False, notice=print))["pva"]
        environment = {
            **os.environ,
            "EPICS_PVA_ADDR_LIST": pva["host"],
            "EPICS_PVA_BROADCAST_PORT": str(pva["search_port"]),
            "EPICS_PVA_AUTO_ADDR_LIST": "NO",
        }
        client = await asyncio.create_subprocess_exec(
            sys.executable, "-c", program, env=environment, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE
        )
        assert client.stdout is not None
        assert client.stdin is not None
        assert await client.stdout.readline() == b"put\n"
        (found,) = gateway.state().clients or ()
        assert (found.follows, found.role) == (("ST:table:M1.VELO",), "engineer")
        assert found.place.startswith("127.0.0.1:")
        assert found.name
        client.stdin.close()
        await client.wait()
        await gateway.close()

    asyncio.run(scene())
    assert gateway.state().clients == ()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('pva = "127.0.0.1:65535"', "the port is at most 65534, because the next one is for searches"),
        ('pva_beacons = "127.0.0.1:5076"', "pva_beacons means nothing without pva"),
        ('prefix = "A.B"', "names of records have letters"),
        ('beacons = "127.0.0.1:0"', "the port for beacons is 1 to 65535"),
        ('role = "boss"', "permitted are viewer, operator, engineer"),
    ],
)
def test_mistakes_are_reported(keys: str, message: str) -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", f'[[mic488]]\nname = "table"\n[gateway.epics]\n{keys}')
    assert message in str(error.value)
