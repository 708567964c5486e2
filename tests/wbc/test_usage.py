"""What a program uses, found without executing it."""

from __future__ import annotations

import pytest

from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.usage import homing_sides

NONE, LEFT, RIGHT, UNKNOWN = frozenset[int](), frozenset({-1}), frozenset({1}), frozenset({0})


def sides(text: str) -> dict[int, frozenset[int]]:
    checked = check(text, parse_positions("")[0])
    assert checked.executable is not None, checked.errors
    return homing_sides(checked.executable.steps)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("HOME M1 -5\n", {1: LEFT}),  # the sign of the velocity: - KL, + KR
        ("HOME M4 0.5\n", {4: RIGHT}),
        ("v = 0\nHOME M2 v\n", {2: NONE}),  # MIC-41: accepted, does nothing
        ("#v -7\nHOME M1 v\n", {1: LEFT}),
        ("v = -3\nHOME M1 v\n", {1: LEFT}),
        ("v = -3\nv = 2\nHOME M1 v\n", {1: LEFT | RIGHT}),
        ("v = -3\nw = 2\nHOME M1 v\n", {1: LEFT}),
        ("v = $R0\nHOME M1 v\n", {1: UNKNOWN}),
        ("v = -3\nv = v + 4\nHOME M1 v\n", {1: UNKNOWN}),
        ("HOME M3 $R0\n", {3: UNKNOWN}),
        ("HOME M1 -5\nHOME M1 5\nHOME M2 5\n", {1: LEFT | RIGHT, 2: RIGHT}),
        ("VABS M1 -5\nPABS M1 5\n", {}),
    ],
)
def test_sides_to_which_a_program_homes(text: str, expected: dict[int, frozenset[int]]) -> None:
    assert sides(text) == expected


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("M1 = ON\nVABS M1 5\nWAITPOS\n", 3),
        ("M1 = ON\nM2 = ON\nVABS M1 -5\nOUT1 = ON\nPABS M2 3\nWAITPOS\nBRAKE M1\n", 6),
        ("M1 = ON\nVABS M1 5\nDELAY 1\nBRAKE M1\nWAITPOS\n", None),
        ("M1 = ON\nVABS M1 5\nPABS M1 0\nWAITPOS\n", None),
        ("M1 = ON\nVABS M1 0\nWAITPOS\n", None),  # it brakes
        ("M1 = ON\nVABS M1 5\nM1 = OFF\nWAITPOS\n", None),
        ("M1 = ON\nVABS M1 5\nIF IN1 = ON\nSTOP M1\nENDIF\nWAITPOS\n", None),  # perhaps
        ("CFGINT_IN1 = RIS\nM1 = ON\nVABS M1 5\nWAITPOS\nEND\nINT_IN1:\nSTOP M1\nRETURN\n", None),
    ],
)
def test_a_wait_for_the_end_of_a_velocity(text: str, line: int | None) -> None:
    found = [one for one in check(text).diagnostics if one.code == "W225"]
    assert [text.count("\n", 0, one.span.start) + 1 for one in found] == ([] if line is None else [line])


def test_an_interrupt_without_label_is_told_once() -> None:
    found = check("CFGINT_IN1 = RIS\nCFGINT_IN2 = RIS\nDELAY 1\nCFGINT_IN1 = ON\n").diagnostics
    assert [one.message for one in found if "interrupt" in one.message] == [
        f"the interrupt of {name} is enabled, but there is no label INT_{name}" for name in ("IN1", "IN2")
    ]
