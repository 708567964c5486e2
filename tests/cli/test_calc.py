"""``steptwin calc``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.errors import Misuse

SCREW = ("--lead", "5", "--microsteps", "16")


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["calc", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_times_of_a_move_with_units() -> None:
    text = printed("mic488", *SCREW, "--distance", "15cm", "--velocity", "600rpm", "--acceleration", "300", "--axis", "3")
    assert "M3_VMAX = 50" in text
    assert "total time                 3.166667  s" in text
    assert "trapezoid: t = v/(2·a)" in text


def test_what_a_time_determines() -> None:
    text = printed(
        "m1486", "--distance", "50rev", "--velocity", "2000", "--acceleration", "5000", "--time", "5.4s", "--find", "profile"
    )
    assert text.startswith("M1486A: profile = ")
    assert "parabolic ramp" in text


def test_gear_of_mechanics() -> None:
    assert json.loads(printed("mic488", *SCREW, "--json"))["pulses_per_unit"]["mm"] == 640
    assert "mm                      640" in printed("mic488", *SCREW)
    assert printed("mic488", "--lead", "0.5cm", "--microsteps", "16") == printed("mic488", *SCREW)


@pytest.mark.parametrize(("suffix", "head"), [("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_picture(tmp_path: Path, suffix: str, head: bytes) -> None:
    file = tmp_path / f"move.{suffix}"
    data = json.loads(
        printed("m1486", "--distance", "1rev", "--velocity", "500", "--acceleration", "900", "-o", str(file), "--json")
    )
    assert data["values"]["distance"] == 12800
    assert file.read_bytes().startswith(head)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("mic488", "--lead", "5", "--distance", "3mm"), "--microsteps is missing"),
        (("mic488", "--gear", "640", "--distance", "3mm"), "--unit is missing"),
        (("mic488", "--unit", "mm", "--distance", "3mm"), "how many pulses are 1 mm is not known"),
        (("mic488", "--gear", "640", *SCREW), "--gear and the mechanics exclude each other"),
        (("mic488", "--unit", "step", *SCREW), "unit step: a MIC488 has imp, rev"),
        (("mic488", "--variant", "B"), "--variant is not for the MIC488"),
        (("mic488", "--lead", "5deg", "--microsteps", "16"), "--lead: '5deg' is not a length: units are mm, cm, m"),
        (("m1486", "--gear", "3"), "--gear is not for the M1486"),
        (("m1486", "--deceleration", "3"), "--deceleration is not for the M1486A"),
        (("m1486", "--variant", "Z"), "no M1486 variant is called 'Z'"),
        (("m1486", "--distance", "3mm"), "--distance: mm is not known in pulses: give the lead"),
        (("m1486", "--velocity", "30"), "distance, acceleration: missing"),
        (
            ("m1486", "--distance", "1rev", "--velocity", "500", "--acceleration", "900", "-o", "move.pdf"),
            "pictures are .png, .svg",
        ),
    ],
)
def test_wrong_use(arguments: tuple[str, ...], message: str) -> None:
    with pytest.raises(Misuse) as caught:
        CliRunner().invoke(app, ["calc", *arguments], catch_exceptions=False)
    assert message in str(caught.value)
