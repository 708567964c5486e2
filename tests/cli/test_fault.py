"""`steptwin fault` and `--fault` as a user types them."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.cli.serve_m1486 import ChipLineOptions, ChipOptions, serve_m1486
from steptwin.cli.serve_mic488 import Mic488Options, ModbusOptions, serve_mic488
from steptwin.cli.serving import Served, TwinOptions
from steptwin.errors import Misuse
from steptwin.simulation.faults import KINDS

Serve = Callable[..., Any]


def kinds(form: str) -> str:
    result = CliRunner().invoke(app, ["fault", "--kinds", "--format", form])
    assert result.exit_code == 0
    return result.output


def test_every_kind_and_parameter_is_explained() -> None:
    tables = json.loads(kinds("json"))
    rows = [row for title, table in tables.items() if title.startswith("Faults of") for row in table]
    assert [row["kind"] for row in rows] == list(KINDS)
    common = {row["parameter"] for row in tables["Where and when"]}
    for row in rows:
        for parameter in KINDS[row["kind"]].parameters:
            assert parameter.name in common or f"{parameter.name} (" in row["its own parameters"]
    assert "| `crc` | The answer has a wrong CRC." in kinds("md")
    assert "crc         The answer has a wrong CRC." in kinds("text")


def test_what_is_no_fault_is_refused_and_what_the_twin_cannot_have(serve: Serve) -> None:
    twin = serve("--demo")
    wrong = twin.command("fault", "crc", "nth=0")
    assert (wrong.returncode, wrong.stderr) == (2, "steptwin: fault (crc): nth = 0: permitted are whole numbers 1 and more\n")
    refused = twin.command("fault", "crc", "unit=3")
    assert (refused.returncode, refused.stderr) == (2, "steptwin: fault crc: unit = 3: served are 1\n")


def test_a_stuck_switch_stays_stuck_under_a_hand(serve: Serve) -> None:
    twin = serve("--demo")
    twin.command("fault", "stuck", "pin=IN9", "value=1")
    twin.command("pin", "IN9=0")
    assert json.loads(twin.command("pin", "--json").stdout)["mic488.IN9"] == 1
    twin.command("fault", "--clear-all")
    assert json.loads(twin.command("pin", "--json").stdout)["mic488.IN9"] == 0


def test_faults_of_a_line_of_chips(serve_m1486: Serve) -> None:
    twin = serve_m1486("--fault", "flip nth=2 bit=0 link=tcp-1")
    with socket.create_connection(("127.0.0.1", twin.tcp_port), timeout=60) as host:
        host.sendall(b"U20\rU20\rU20\r")
        heard = b""
        while len(heard) < 3:
            heard += host.recv(3)
    assert heard == b"A@A"
    assert json.loads(twin.command("fault", "--json").stdout) == [
        {"name": "flip", "fault": "flip nth=2 bit=0 link=tcp-1", "seen": 3, "acted": 1}
    ]


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("crc", "fault crc happens on Modbus RTU: line 'bus' carries Modbus TCP"),
        ("busy unit=7", "fault busy: unit = 7: served are 1"),
        ("stuck pin=IN99", "fault stuck: pin = 'IN99'"),
        ("bang", "fault: kind = 'bang': permitted are flip,"),
    ],
)
def test_a_twin_that_cannot_have_the_fault_does_not_start(
    fault: str, text: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(Misuse) as refused:
        serve_mic488(
            Served(kind="mic488", line=ModbusOptions(tcp="127.0.0.1:0"), twin=TwinOptions(fault=(fault,))), Mic488Options()
        )
    assert str(refused.value).startswith(text)
    assert [file for _, _, files in os.walk(tmp_path) for file in files] == []


def test_frames_of_chips_cannot_go_wrong(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(Misuse, match="fault late happens on Modbus RTU and Modbus TCP: line 'bus' carries M1486"):
        serve_m1486(
            Served(kind="m1486", line=ChipLineOptions(tcp="127.0.0.1:0"), twin=TwinOptions(fault=("late",))), ChipOptions()
        )
