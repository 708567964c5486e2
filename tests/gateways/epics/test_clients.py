"""Motor records and others for independent clients: ophyd-async's Motor, pyepics; each in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import running, served
from tests.gateways.opcua.test_bridge import free_port

from steptwin.world.description import read_world
from steptwin.world.reader import WorldError

CLIENTS = Path(__file__).parents[1] / "clients"
TABLE = """
    [[mic488]]
    name = "table"
    [gateway.epics]
    prefix = "ST:"
    listen = "127.0.0.1:0"
"""


def client(program: str, port: int, name: str) -> dict[str, Any]:
    environment = {**os.environ, "EPICS_CA_ADDR_LIST": f"127.0.0.1:{port}", "EPICS_CA_AUTO_ADDR_LIST": "NO"}
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
    assert (first["do"], first["fields"]["machine"]) == ("move", "table")


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


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('prefix = "A.B"', "names of records have letters"),
        ('beacons = "127.0.0.1:0"', "the port for beacons is 1 to 65535"),
        ('role = "boss"', "permitted are viewer, operator, engineer"),
    ],
)
def test_mistakes_are_reported(keys: str, message: str) -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", f'[[mic488]]\nname = "table"\n[gateway.epics]\n{keys}')
    assert message in str(error.value)
