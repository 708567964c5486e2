"""What a computer lacks: ports that others have, libraries, a page that is not built, a runtime directory of another user."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from steptwin.errors import Refusal
from steptwin.live import doctor
from steptwin.live.doctor import Finding, examine
from steptwin.live.ports import FoundPort


def found(what: str) -> Finding:
    return next(each for each in examine() if each.what == what)


def test_a_port_that_somebody_else_has_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        monkeypatch.setattr(doctor, "PORTS", (port,))
        assert found(f"port {port}").found == "taken"
    assert found(f"port {port}").found == "free"


def test_what_the_studio_cannot_run_without_is_vital(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "lacking", lambda extra: ["fastapi"] if extra in {"studio", "plots"} else [])
    assert found("extra studio") == Finding(
        "extra studio", "without fastapi", "pip install 'steptwin[studio]', in a clone make extras", is_vital=True
    )
    assert found("extra plots") == Finding("extra plots", "not installed")
    assert found("extra scene") == Finding("extra scene", "installed")

    def not_built() -> Path:
        raise Refusal("'make page' builds it")

    monkeypatch.setattr(doctor, "find_page", not_built)
    assert found("page of the studio") == Finding("page of the studio", "not built", "'make page' builds it", is_vital=True)


def test_a_runtime_directory_that_cannot_be_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "steptwin").write_text("a file")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    row = found("runtime directory")
    assert (row.is_vital, "set XDG_RUNTIME_DIR" in row.todo) == (True, True), row


def test_a_serial_port_of_another_group_names_the_group(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    device = tmp_path / "ttyUSB9"
    device.touch()
    monkeypatch.setattr(doctor, "serial_ports", lambda: [FoundPort(str(device), "adapter")])
    assert found(str(device)) == Finding(str(device), "adapter")
    monkeypatch.setattr(doctor.os, "access", lambda path, mode: path != device)
    row = found(str(device))
    assert (row.found, f"-aG {device.group()} " in row.todo) == ("adapter, no permission to open it", True)
