"""Every way in takes the same numbers: commands, options, registers, pins, faults, JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from shell import Shell

from steptwin.drivers.typed import tied
from steptwin.errors import Misuse, SteptwinError
from steptwin.languages.travels import parse_travel
from steptwin.live.pace import read_speed
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import value_of
from steptwin.simulation.faults import read as read_fault
from steptwin.subject.commands import read_command

OTHERS = ("1,000", "1_000", "１２", "0x10", "9" * 5000, "nan", "inf", "1e999")
"""What is not a number."""

WAYS: dict[str, Callable[[str], object]] = {
    "move": lambda text: tied([f"1={text}"], 4)[1],
    "register": lambda text: value_of(register_map().named("M1_POS_ABS"), text),
    "travel": lambda text: parse_travel(f"M1=-500..{text}")[0].high_u,
    "speed": read_speed,
    "fault": lambda text: read_fault(f"gap for_ms={text}"),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_has_this_grammar(way: str) -> None:
    if way != "travel":  # a list with commas
        assert WAYS[way]("12,5") == WAYS[way]("12.5")
    for text in OTHERS:
        with pytest.raises(SteptwinError):
            WAYS[way](text)


@pytest.mark.parametrize("text", OTHERS, ids=lambda text: text[:20])
def test_options_have_this_grammar(shell: Shell, text: str) -> None:
    shell("calc", "mic488", "--gear", text)
    assert shell.code == 2
    assert "number" in shell.errors or "thousands" in shell.errors


def test_options_take_a_decimal_comma(shell: Shell) -> None:
    m1486 = ("calc", "m1486", "--distance", "1rev", "--velocity", "500", "--acceleration", "900", "--json")
    assert json.loads(shell(*m1486, "--ratio", "2,5")) == json.loads(shell(*m1486, "--ratio", "2.5"))


@pytest.mark.parametrize("value", [True, None, "1", "0x10", [1], 10**400])
def test_json_takes_numbers_only(value: object) -> None:
    for name, fields in (
        ("write", {"values": {"table.M1_ACC": value}}),
        ("set", {"levels": {"table.AIN1": value}}),
        ("seek", {"controller": "table", "axis": 1, "velocity": value}),
        ("seek", {"controller": "table", "axis": value, "velocity": 1}),
        ("subscribe", {"bound": value}),
    ):
        with pytest.raises(Misuse):
            read_command(name, fields)


def test_a_huge_number_of_a_file_is_a_finding(shell: Shell, tmp_path: Path) -> None:
    """More digits than a double has, and more than Python reads."""
    examples = Path(__file__).parents[2] / "examples" / "mic488"
    for digits in ("9" * 400, "9" * 5000, "-" + "9" * 400):
        texts = {
            "a.cfg": (examples / "feeder.cfg").read_text("latin-1").replace("Int=", f"Int={digits}\nX=", 1),
            "a.csv": f"1;{digits};x;x;x\n",
            "a.prg": f"SET A = {digits}\n#const B {digits}\nDELAY {digits}\nPABS M1 {digits}\nMOVEPTP {digits} 1\n",
            "a.m1486": f"F{digits}\nS{digits}\nJ{digits}\nW{digits}\n",
            "a.toml": f'[[mic488]]\nname = "m"\nunit = {digits}\n[[axis]]\nname = "x"\ndrive = "m.M1"\npitch = {digits}\n',
        }
        for name, text in texts.items():
            (tmp_path / name).write_text(text)
            shell("check", str(tmp_path / name))
            assert shell.code in (1, 2), name
            (tmp_path / name).unlink()
