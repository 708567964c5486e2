"""Where ``steptwin serve`` listens without being told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from steptwin.cli import app


@pytest.mark.parametrize(
    ("device", "option", "expected"),
    [
        ("mic488", [], ("mic488", "127.0.0.1:5020", "127.0.0.1:5021")),
        ("mic488", ["--listen-any"], ("mic488", "0.0.0.0:5020", "0.0.0.0:5021")),
        ("mic488", ["--tcp", "127.0.0.1:0"], (None, "127.0.0.1:0", None)),
        ("m1486", [], ("m1486", "127.0.0.1:5022", None)),
        ("m1486", ["--listen-any"], ("m1486", "0.0.0.0:5022", None)),
    ],
)
def test_end_points_without_addresses(
    monkeypatch: pytest.MonkeyPatch, device: str, option: list[str], expected: tuple[str | None, ...]
) -> None:
    served: list[Any] = []
    monkeypatch.setattr(f"steptwin.commands.serve.serve_{device}", served.append)
    assert CliRunner().invoke(app, ["serve", device, *option]).exit_code == 0
    (options,) = served
    pty: Path | None = options.pty
    assert (pty and pty.name, options.tcp, getattr(options, "rtu_tcp", None)) == expected
