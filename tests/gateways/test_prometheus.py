"""Metrics of a running world as Prometheus' own tool reads them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import urllib.request
from collections.abc import Callable
from pathlib import Path

from pymodbus.client import ModbusTcpClient
from tests.conftest import STEPTWIN, until

WORLD = """
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [gateway.prometheus]
    listen = "127.0.0.1:0"
"""


def test_promtool_reads_the_metrics(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    promtool = require_peer("promtool")
    (tmp_path / "hall.toml").write_text(WORLD)
    ready = tmp_path / "ready.json"
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    process = subprocess.Popen(
        [STEPTWIN, "up", "hall.toml", "--ready-file", str(ready)], cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL
    )
    try:
        until(lambda: ready.exists() or process.poll() is not None, "it is ready")
        points = {point["kind"]: point for point in json.loads(ready.read_text())["end_points"]}
        url = points["prometheus"]["url"]
        with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
            assert not master.write_coil(2000, True, device_id=1).isError()
        with urllib.request.urlopen(url, timeout=60) as answer:
            text = answer.read().decode()
        assert 'steptwin_axis_enabled{axis="M1",controller="table"} 1.0\n' in text
        checked = subprocess.run(
            [promtool, "check", "metrics"], input=text, capture_output=True, text=True, timeout=60, check=False
        )
        assert (checked.returncode, checked.stderr) == (0, "")
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
