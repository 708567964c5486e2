"""``steptwin pause``, ``step``, ``resume`` and ``save`` at a world that really runs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.conftest import STEPTWIN
from typer.testing import CliRunner

from steptwin.cli import app

FEEDER = Path(__file__).parents[2] / "examples" / "worlds" / "feeder.toml"
Up = subprocess.Popen[str]


@pytest.fixture
def up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Up]:
    """The bar feeder, which stands at 0 s."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "feeder.toml").write_text(FEEDER.read_text().replace("127.0.0.1:5020", "127.0.0.1:0"))
    command = [STEPTWIN, "up", "feeder.toml", "--speed", "0", "--ready-file", "ready.json", "--session", "end.json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
        begin = time.monotonic()
        while not (tmp_path / "ready.json").exists() and process.poll() is None and time.monotonic() < begin + 60:
            time.sleep(0.02)
        yield process
        process.kill()


def invoke(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_running_world_in_somebodys_hands(up: Up) -> None:
    assert invoke("step") == "    0.002083 s  table      M1_EN: 1\nbar feeder paused at 0.002083334 s\n"
    assert invoke("step", "2s") == "bar feeder paused at 2.002083334 s\n"
    assert invoke("step", "1ms", "--show", "note") == "bar feeder paused at 2.003083334 s\n"
    invoke("pin", "table.IN8=1")
    told = invoke("step", "--until", "start.pressed", "1min").splitlines()
    assert told[0].endswith("table      M1 is at its home position")
    assert told[-1].startswith("bar feeder paused at 6.06")
    assert "warning: x.position > 300 did not come true\n" in invoke("step", "1ms", "--until", "x.position > 300")

    told = invoke("save", "now.json").splitlines()
    assert told[0].startswith("wrote now.json: 1 inputs, digest ")
    digest = told[0].rpartition(" ")[2]
    assert invoke("replay", "now.json").endswith(f"1 inputs: the same, digest {digest}\n")

    stood = json.loads(invoke("pause", "--json"))
    stepped = json.loads(invoke("step", "30s", "--json"))
    assert int(stepped["time_ns"]) == int(stood["time_ns"]) + 30 * 10**9
    assert any("past the middle" in event["text"] for event in stepped["events"])
    assert invoke("resume", "--speed", "50").endswith(" s, 50 virtual seconds a second\n")
    stood = json.loads(invoke("pause", "--json"))
    assert (stood["paused"], stood["speed"]) == (True, 50.0)
    assert invoke("pause") == f"bar feeder paused at {stood['time_s']:.9f} s\n"

    up.send_signal(signal.SIGINT)
    told = (up.stdout or sys.stdin).read().splitlines()
    assert up.wait(60) == 0
    assert "running, 50 virtual seconds per second" in "\n".join(told)
    assert f"1 inputs: the same, digest {told[-1].rpartition(' ')[2]}" in invoke("replay", "end.json")


def test_a_session_goes_on_in_virtual_time_and_live(up: Up) -> None:
    invoke("step", "5s")
    invoke("pin", "table.IN8=1")
    invoke("save", "now.json")
    up.send_signal(signal.SIGINT)
    assert up.wait(60) == 0
    whole = invoke("run", "feeder.toml", "--for", "20s", "--input", "table.IN8=1@5s")
    rest = invoke("run", "now.json", "--for", "15s")
    assert "20 s of bar feeder, from 5 s on in" in rest
    assert rest.splitlines()[-1] == whole.splitlines()[-1]
