"""Output as lines of JSON: what programs that collect logs read."""

from __future__ import annotations

import json
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import running
from pymodbus.client import ModbusTcpClient
from tests.conftest import run_command, until

from steptwin.errors import Misuse
from steptwin.live.options import LogOptions

WORLD = """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
[gateway.mqtt]
broker = "127.0.0.1:1"
[[event]]
when = "table.M1_EN"
steps = [{ note = "zasilony → on" }]
"""


def lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "output").read_text("utf-8").splitlines()]


def test_everything_of_a_world_is_an_object(tmp_path: Path) -> None:
    pytest.importorskip("aiomqtt")
    (tmp_path / "hall.toml").write_text(WORLD, "utf-8")
    with running(tmp_path, "up", "hall.toml", "--log-format", "json", "--log-frames", is_quiet=False) as points:
        with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
            assert not master.write_coil(2000, True, device_id=1).isError()
        until(lambda: any(one["kind"] == "note" for one in lines(tmp_path)), "the note has been written")
    found = lines(tmp_path)
    assert {"timestamp", "level", "event", "kind"} <= set.intersection(*(set(one) for one in found))
    assert abs((datetime.fromisoformat(found[0]["timestamp"]) - datetime.now(UTC)).total_seconds()) < 300
    assert (found[0]["kind"], found[0]["end_points"][0]["port"]) == ("begin", points["tcp"]["port"])
    by_kind = {one["kind"]: one for one in found}
    assert (by_kind["notice"]["level"], "connection refused" in by_kind["notice"]["event"]) == ("warning", True)
    note = by_kind["note"]
    assert (note["controller"], note["data"]["note"], int(note["time_ns"]) > 0) == ("world", "zasilony → on", True)
    frames = [(one["direction"], one["data"][14:], one["event"]) for one in found if one["kind"] == "frame"]
    assert frames[0] == ("in", "0507d0ff00", "write M1_EN = ON")
    assert found[-1]["event"].startswith("ran for ")


def test_a_bridge_too(tmp_path: Path) -> None:
    (tmp_path / "hall.toml").write_text(WORLD.partition("[gateway")[0], "utf-8")
    with running(tmp_path, "up", "hall.toml") as points:
        device = f"127.0.0.1:{points['tcp']['port']}"
        (tmp_path / "b").mkdir()
        text = f'[[device]]\nname = "table"\naddress = "{device}"\n[gateway.prometheus]\nlisten = "127.0.0.1:0"\n'
        (tmp_path / "b" / "cell.toml").write_text(text, "utf-8")
        with running(tmp_path / "b", "bridge", "cell.toml", "--log-format", "json") as served:
            expected = served["prometheus"]["url"]
    (begin,) = lines(tmp_path / "b")
    assert [point["url"] for point in begin["end_points"]] == [expected]


def test_other_formats_are_refused() -> None:
    with pytest.raises(Misuse, match="--log-format xml: permitted are text and json"):
        LogOptions(log_format="xml").output()
    found = run_command(("serve", "mic488", "--log-format", "xml"), dict(os.environ))
    assert (found.returncode, "permitted are text and json" in found.stderr) == (2, True)
