"""``steptwin verify`` against served twins. What each check finds, on every generation and type, is in `tests/verify`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from shell import Shell

QUICK = ",timeout=0.1"


def test_a_mic488_over_pty_and_tcp(serve: Callable[..., Any], tmp_path: Path) -> None:
    twin = serve()
    report = tmp_path / "report.json"
    assert twin.command("enable", "1").returncode == 0
    for place, line, move in ((twin.pty, "MIC-2", []), (f"tcp://127.0.0.1:{twin.tcp_port}", "MIC-23", ["--move", "M1=3000"])):
        done = twin.command("verify", "-d", f"{place}{QUICK}", "--write", *move, "--json", str(report))
        assert (done.returncode, done.stderr) == (0, ""), done.stdout
        found = json.loads(report.read_text())
        assert (found["counts"]["refuted"], found["is_complete"]) == (0, True)
        assert {"MIC-1", "MIC-7", "MIC-28", line} <= {r["id"] for r in found["results"] if r["outcome"] == "confirmed"}
        assert found["device"]["firmware"] == "1.70 or 1.40"
        assert found["permitted"] == ("read, write, move" if move else "read, write")
    assert "MIC-10  confirmed   STOP during a motion" in done.stdout
    assert json.loads(twin.command("get", "M1_POS_ACT", "--json").stdout)["M1_POS_ACT"]["value"] == 0.0


def test_an_m1486_over_tcp(serve_m1486: Callable[..., Any], tmp_path: Path) -> None:
    twin = serve_m1486()
    report = tmp_path / "report.json"
    done = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port},kind=m1486{QUICK}", "--json", str(report))
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(report.read_text())
    assert (found["device"]["type"], found["counts"]["refuted"]) == ("A", 0)
    assert found["counts"]["confirmed"] >= 8


def test_checks_of_an_e_type_need_permission_to_write(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486("--variant", "E1")
    refused = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port},kind=m1486{QUICK}")
    assert refused.returncode == 2
    assert "writes every command into its EEPROM, also those of checks: permit it with --write" in refused.stderr


def test_what_is_refuted_is_shown_with_exit_code_1(serve: Callable[..., Any]) -> None:
    twin = serve("--lenient")
    done = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port}{QUICK}")
    assert done.returncode == 1
    assert "MIC-3   refuted     Reads of holes and of write-only registers" in done.stdout
    assert "expected exception 02 (illegal data address), came answer 03 02 00 00" in done.stdout
    assert "writes settings and puts them back: permit it with --write: MIC-4, MIC-7" in done.stdout


@pytest.mark.parametrize(
    ("kind", "move", "message"),
    [
        ("mic488", "1", "--move 1: expected AXIS=DISTANCE, such as 1=0.5"),
        ("mic488", "5=1", "'5' is not an axis: permitted are 1 to 4, or M1 to M4"),
        ("mic488", "1=0", "a distance of 0 units: permitted are numbers other than 0"),
        ("m1486", "1=1", "no check moves an M1486: leave out --move"),
    ],
)
def test_bad_bounds(shell: Shell, kind: str, move: str, message: str) -> None:
    """Nothing listens at port 1: they are found before a line is opened."""
    shell("verify", "-d", f"tcp://127.0.0.1:1,kind={kind}", "--move", move)
    assert (shell.code, shell.errors) == (2, f"steptwin: {message}\n")
