"""What `steptwin serve mic488` makes of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.files.programbanks import Banks
from steptwin.mic488.config import ConfigError, ControllerConfig, ProgramConfig
from steptwin.mic488.program import load
from steptwin.served.serve_mic488 import Mic488Options, load_config, remarks, serve
from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions

MISSPELT = "[Axis0]\nHomeMod=1\nGear=3\n"


def test_what_is_doubtful_in_a_configuration_is_told_and_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "machine.cfg"
    path.write_text(MISSPELT)
    assert load_config(path, "1.70").axes[0].gear == 3.0
    assert "machine.cfg:2:1: warning C005: [Axis0] HomeMod is not known; did you mean HomeMode?" in capsys.readouterr().err


def test_what_is_wrong_is_told_with_what_is_doubtful(tmp_path: Path) -> None:
    path = tmp_path / "machine.cfg"
    path.write_text(MISSPELT + "Acc=0\n")
    with pytest.raises(ConfigError, match=r"(?s)C005: \[Axis0\] HomeMod .*C008: \[Axis0\] Acc = 0 is not permitted"):
        load_config(path, "1.70")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"baud": 38401}, r"--baud 38401: permitted are 9600, 19200, 38400, 57600, 115200 bit/s"),
        ({"demo": True, "config": Path("m.cfg")}, r"--demo and --config m\.cfg: the demo has a configuration of its own"),
        (
            {"listen_any": True, "tcp": "127.0.0.1:0"},
            r"--listen-any .* \(addresses: 127\.0\.0\.1:0\); 0\.0\.0\.0:PORT",
        ),
        ({"listen_any": True, "pty": Path("p")}, r"--listen-any .* there is none \(addresses: none\)"),
        ({"tcp": "0.0.0.0:0"}, r"0\.0\.0\.0 is not a loopback address: .* --listen-any permits it"),
    ],
)
def test_options_that_cannot_be_meant(options: dict[str, Any], message: str) -> None:
    with pytest.raises(Misuse, match=message):
        serve(Mic488Options(**options))


TABLE, _ = parse_positions("A;1;x;x;x\n")
MOVES = load(check("M1 = ON\nMOVEPTP 0\n", TABLE))


@pytest.mark.parametrize(
    ("program", "banks", "remark"),
    [
        (ProgramConfig(activate=1), Banks(), ", which is empty (--program 0=FILE)"),
        (ProgramConfig(activate=1, prog_bank=2), Banks({0: MOVES}, {0: TABLE}), ", which is empty (--program 2=FILE)"),
        (
            ProgramConfig(activate=1, pos_bank=3),
            Banks({0: MOVES}, {0: TABLE}),
            " with position bank 3, which is empty (--positions 3=FILE)",
        ),
        (ProgramConfig(activate=1), Banks({0: MOVES}, {0: TABLE}), None),
        (ProgramConfig(activate=0), Banks(), None),
    ],
)
def test_a_configuration_that_starts_an_empty_bank_says_why_err_is_on(
    program: ProgramConfig, banks: Banks, remark: str | None
) -> None:
    shown = [text for text in remarks(Mic488Options(), ControllerConfig(program=program), banks) if text.startswith("ERR")]
    expected = [] if remark is None else [f"ERR is on: Activate=1 starts program bank {program.prog_bank} at power-on{remark}"]
    assert shown == expected
