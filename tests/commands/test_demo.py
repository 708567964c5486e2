"""The demo machine."""

from __future__ import annotations

import socket
import tomllib
from pathlib import Path

import pytest

from steptwin.commands import demo


def test_what_others_have_is_left_to_them(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(demo, "runtime_directory", lambda: tmp_path)
    monkeypatch.setattr(demo, "HAS_PTYS", True)
    (tmp_path / "m1486").symlink_to("/dev/null")
    with socket.create_server(("127.0.0.1", 0)) as other, socket.create_server(("127.0.0.1", 0)) as closed:
        taken, free = other.getsockname()[1], closed.getsockname()[1]
        closed.close()
        monkeypatch.setattr(demo, "PORTS", (taken, free, taken))
        described = tomllib.loads(demo.describe_demo())
    bus, chips = described["line"]
    assert (bus["tcp"], bus["rtu_tcp"], bus["pty"]) == ("127.0.0.1:0", f"127.0.0.1:{free}", str(tmp_path / "mic488"))
    assert (chips["tcp"], "pty" in chips) == ("127.0.0.1:0", False)
