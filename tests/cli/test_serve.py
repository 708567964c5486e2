"""Where ``steptwin serve`` listens: as its options say, or without any."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.errors import Misuse

ANYWHERE = "127.0.0.1:0"


@pytest.mark.parametrize(
    ("device", "option", "expected"),
    [
        ("mic488", [], {"pty": "mic488", "tcp": "127.0.0.1:5020", "rtu_tcp": "127.0.0.1:5021"}),
        ("mic488", ["--listen-any"], {"pty": "mic488", "tcp": "0.0.0.0:5020", "rtu_tcp": "0.0.0.0:5021"}),
        ("mic488", ["--tcp", ANYWHERE], {"tcp": ANYWHERE}),
        ("mic488", ["--rtu-tcp", ANYWHERE, "--pty", "here/line"], {"rtu_tcp": ANYWHERE, "pty": "line"}),
        ("mic488", ["--rfc2217", ANYWHERE], {"rfc2217": ANYWHERE}),
        ("mic488", ["--serial", "COM3"], {"serial": "COM3"}),
        ("m1486", [], {"pty": "m1486", "tcp": "127.0.0.1:5022"}),
        ("m1486", ["--listen-any"], {"pty": "m1486", "tcp": "0.0.0.0:5022"}),
        ("m1486", ["--rfc2217", ANYWHERE], {"rfc2217": ANYWHERE}),
        ("m1486", ["--serial", "COM3", "--tcp", ANYWHERE], {"serial": "COM3", "tcp": ANYWHERE}),
    ],
)
def test_links_are_those_of_the_options_or_the_usual_ones(
    monkeypatch: pytest.MonkeyPatch, device: str, option: list[str], expected: dict[str, str]
) -> None:
    served: list[Any] = []
    monkeypatch.setattr(f"steptwin.cli.serve_{device}.serve_{device}", lambda twin, controllers: served.append(twin))
    assert CliRunner().invoke(app, ["serve", device, *option]).exit_code == 0
    links = served[0].links.items()
    assert {key: Path(value).name if key == "pty" else value for key, value in links if value is not None} == expected


def test_files_of_an_encrypted_line_are_given_together() -> None:
    words = ["serve", "mic488", "--tls-tcp", ANYWHERE, "--certificate", "a.pem", "--key", "a.key"]
    assert isinstance(CliRunner().invoke(app, words).exception, Misuse)
    printed = CliRunner().invoke(app, [*words, "--trusted", "clients", "--print-world"]).stdout
    assert f'tls_tcp = "{ANYWHERE}"' in printed
    assert f'trusted = "{Path("clients").absolute()}"' in printed


@pytest.mark.parametrize("device", ["mic488", "m1486"])
def test_time_and_control_are_as_with_up(monkeypatch: pytest.MonkeyPatch, device: str) -> None:
    started: list[Any] = []
    monkeypatch.setattr("steptwin.live.running.up_with", lambda world, options: started.append(options))
    words = ["serve", device, "--tcp", ANYWHERE, "--speed", "0.1", "--control", ANYWHERE]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert (started[0].live.speed, started[0].live.control) == ("0.1", ANYWHERE)
