"""``steptwin verify`` against served twins: each generation and type, over a pty and over TCP."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

QUICK = ",timeout=0.1"


@pytest.mark.parametrize("firmware", ["1.23", "1.40", "1.70"])
def test_a_mic488_over_pty_and_tcp(serve: Callable[..., Any], tmp_path: Path, firmware: str) -> None:
    twin = serve("--firmware", firmware)
    report = tmp_path / "report.json"
    for place, line in ((twin.pty, "MIC-2"), (f"tcp://127.0.0.1:{twin.tcp_port}", "MIC-23")):
        done = twin.command("verify", "-d", f"{place}{QUICK}", "--write", "--json", str(report))
        assert (done.returncode, done.stderr) == (0, ""), done.stdout
        found = json.loads(report.read_text())
        assert (found["counts"]["refuted"], found["is_complete"]) == (0, True)
        assert {"MIC-1", "MIC-7", "MIC-28", line} <= {r["id"] for r in found["results"] if r["outcome"] == "confirmed"}
        assert found["device"]["firmware"] == (firmware if firmware == "1.23" else "1.70 or 1.40")
        assert found["permitted"] == "read, write"


@pytest.mark.parametrize("kind", ["A", "B", "C", "E1", "E2"])
def test_an_m1486_over_pty_and_tcp(serve_m1486: Callable[..., Any], tmp_path: Path, kind: str) -> None:
    twin = serve_m1486("--variant", kind)
    report = tmp_path / "report.json"
    for place in (twin.pty, f"tcp://127.0.0.1:{twin.tcp_port}"):
        device = f"{place},kind=m1486{QUICK}"
        if kind in ("E1", "E2"):
            refused = twin.command("verify", "-d", device)
            assert refused.returncode == 2
            assert "writes every command into its EEPROM, also those of checks: permit it with --write" in refused.stderr
        done = twin.command("verify", "-d", device, "--json", str(report), *(("--write",) if kind in ("E1", "E2") else ()))
        assert done.returncode == 0, done.stdout + done.stderr
        found = json.loads(report.read_text())
        assert (found["device"]["type"], found["counts"]["refuted"]) == (kind, 0)
        assert found["counts"]["confirmed"] >= 8


def test_what_is_refuted_is_shown_with_exit_code_1(serve: Callable[..., Any]) -> None:
    twin = serve("--lenient")
    done = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port}{QUICK}")
    assert done.returncode == 1
    assert "MIC-3   refuted     Reads of holes and of write-only registers" in done.stdout
    assert "expected exception 02 (illegal data address), came answer 03 02 00 00" in done.stdout
    assert "writes settings and puts them back: permit it with --write: MIC-4, MIC-7" in done.stdout


def test_a_motion_stays_within_its_bound(serve: Callable[..., Any]) -> None:
    twin = serve()
    device = f"tcp://127.0.0.1:{twin.tcp_port}{QUICK}"
    assert twin.command("enable", "1").returncode == 0
    done = twin.command("verify", "-d", device, "--move", "M1=3000")
    assert done.returncode == 0, done.stdout
    assert "MIC-10  confirmed   STOP during a motion" in done.stdout
    assert json.loads(twin.command("get", "M1_POS_ACT", "--json").stdout)["M1_POS_ACT"]["value"] == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--move", "1"], "--move 1: expected AXIS=DISTANCE, such as 1=0.5"),
        (["--move", "5=1"], "'5' is not an axis: permitted are 1 to 4, or M1 to M4"),
        (["--move", "1=0"], "a distance of 0 units: permitted are numbers other than 0"),
    ],
)
def test_bad_bounds(serve: Callable[..., Any], arguments: list[str], message: str) -> None:
    twin = serve()
    done = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port}", *arguments)
    assert (done.returncode, done.stderr) == (2, f"steptwin: {message}\n")


def test_a_chip_is_never_moved(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486()
    done = twin.command("verify", "-d", f"tcp://127.0.0.1:{twin.tcp_port},kind=m1486", "--move", "1=1")
    assert (done.returncode, done.stderr) == (2, "steptwin: no check moves an M1486: leave out --move\n")
