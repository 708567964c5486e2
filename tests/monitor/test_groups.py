"""Registers in groups, and values as people type them."""

from __future__ import annotations

import io
import sys

import pytest

from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType, Type
from steptwin.mic488.registers import FIRMWARES, register_map
from steptwin.monitor import monitor
from steptwin.monitor.groups import groups_of, permitted, shown


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_every_register_is_in_one_group(firmware: str) -> None:
    registers = register_map(firmware)
    grouped = [register.name for members in groups_of(registers).values() for register in members]
    assert sorted(grouped) == sorted(register.name for register in registers if register.type is not Type.MEMORY)


def test_values_as_people_read_them() -> None:
    registers = register_map()
    control, output, acc = registers.named("PROGRAM_CTRL"), registers.named("OUT1"), registers.named("M1_ACC")
    assert shown(control, 1) == "START (1)"
    assert shown(control, 7) == "unknown (7)"
    assert shown(output, True) == "on"
    assert shown(acc, 12.5) == "12.5"
    assert permitted(output, DataType.REAL, "u") == "on, off"
    assert permitted(registers.named("IN1"), DataType.REAL, "u") == "read only"


def test_without_textual_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "textual", None)
    with pytest.raises(Misuse, match=r"in a clone 'make extras' installs it, elsewhere 'pip install textual'"):
        monitor(None, 5.0)


@pytest.mark.parametrize(
    ("device", "hz", "text"),
    [
        ("tcp://127.0.0.1:1", 0.0, "--hz 0: permitted are"),
        ("tcp://127.0.0.1:1", 50.0, "--hz 50: permitted are"),
        ("nonsense:", 5.0, "'nonsense:' is not an address"),
        ("tcp://127.0.0.1:1,chip=7", 5.0, "the monitor is for a MIC488; tcp://127.0.0.1:1 is of kind m1486"),
        ("tcp://127.0.0.1:1", 5.0, "the monitor needs a terminal"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_the_screen_is_taken(
    monkeypatch: pytest.MonkeyPatch, device: str, hz: float, text: str
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO())
    with pytest.raises(Misuse, match=text):
        monitor(device, hz)
