"""Warnings about what lies in something else when the world begins."""

from __future__ import annotations

import pytest

from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.world.check import diagnose

MACHINE = """\
[[mic488]]
name = "m"
[[axis]]
name = "x"
drive = "m.M1"
pitch = 5.0
travel = [0, 200]
at = [0, 0, 100]
[[axis]]
name = "turn"
kind = "rotary"
drive = "m.M2"
unit = "degree"
pulses_per_unit = 100
at = [0, 500, 0]
[[vacuum]]
name = "cup"
ejector = "m.OUT1"
at = [0, 0, 500]
reach = 1000
"""


def body(name: str, on: str, at: str, size: str = "[20, 20, 20]", more: str = "") -> str:
    place = f"at = {at}\n" if at else ""
    return f'[[body]]\nname = "{name}"\n' + (f'on = "{on}"\n' if on else "") + place + f"size = {size}\n{more}"


def warnings(text: str) -> list[tuple[str, str]]:
    """Each with the line that it is about."""
    whole = MACHINE + text
    found = diagnose("m.toml", whole, no_files).findings
    return [(one.message, whole[one.span.start :].partition("\n")[0]) for one in found]


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        # What moves out of something.
        (
            body("head", "x", "[0, 0, 0]") + body("post", "", "[15, 0, 90]"),
            [("head and post overlap by 5 mm when the world begins", "at = [15, 0, 90]")],
        ),
        (body("head", "x", "[0, 0, 0]") + body("post", "", "[20, 0, 90]"), []),  # their faces touch
        (body("head", "x", "[0, 0, 0]") + body("door", "", "[15, 0, 90]", more='when = "time > 1"\n'), []),
        # A slide on its rail, all along it; one that leaves a rail that is too short.
        (body("slide", "x", "[0, 0, 0]") + body("rail", "", "[100, 0, 105]", "[260, 10, 10]"), []),
        (
            body("slide", "x", "[0, 0, 0]") + body("rail", "", "[50, 0, 105]", "[160, 10, 10]"),
            [("slide and rail overlap by 15 mm when the world begins", "at = [50, 0, 105]")],
        ),
        # A hinge; a table that turns away from what is in it.
        (body("arm", "turn", "[40, 0, 0]", "[100, 20, 20]") + body("column", "", "[0, 500, 0]"), []),
        (
            body("arm", "turn", "[40, 0, 0]", "[100, 20, 20]") + body("post", "", "[85, 500, 0]"),
            [("arm and post overlap by 15 mm when the world begins", "at = [85, 500, 0]")],
        ),
        # Parts that stand still against each other may be made of several bodies, but not hidden.
        (body("beam", "", "[0, 0, 0]", "[200, 20, 20]") + body("brace", "", "[0, 0, 0]", "[20, 200, 20]"), []),
        (
            body("box", "", "[0, 0, 0]", "[200, 200, 200]") + body("part", "", "[0, 0, 50]"),
            [("part lies inside box", "at = [0, 0, 50]")],
        ),
        (
            body("part", "", "[0, 0, 50]") + body("box", "", "[0, 0, 0]", "[200, 200, 200]"),
            [("part lies inside box", "at = [0, 0, 50]")],
        ),
        (
            body("plate", "", "[0, 0, 0]", "[200, 200, 10]") + body("post", "plate", ""),
            [("post stands 10 mm deep in plate, which it is on", "[[body]]")],
        ),
        (body("plate", "", "[0, 0, 0]", "[200, 200, 10]") + body("post", "plate", "[0, 0, 5]"), []),
        # Nests.
        (
            body("plate", "", "[0, 0, 0]", "[200, 200, 30]") + '[[nest]]\nname = "tray"\non = "plate"\n',
            [("workpieces in tray are inside plate, whose top is 30 mm above it", "[[nest]]")],
        ),
        (
            body("plate", "", "[0, 0, 0]", "[200, 200, 30]")
            + '[[nest]]\nname = "tray"\non = "plate"\nat = [0, 0, 5]\nworkpiece = [20, 20, 20]\nfilled = 1\n',
            [("workpieces in tray are inside plate, whose top is 25 mm above it", "at = [0, 0, 5]")],
        ),
        (
            body("plate", "", "[0, 0, 0]", "[200, 200, 30]")
            + '[[nest]]\nname = "pocket"\non = "plate"\nat = [0, 0, 20]\nworkpiece = [20, 20, 20]\nfilled = 1\n',
            [],
        ),
        (body("plate", "", "[0, 0, 0]", "[200, 200, 30]") + '[[nest]]\nname = "tray"\non = "plate"\nat = [0, 0, 30]\n', []),
    ],
)
def test_what_lies_in_something_else_is_warned_of(text: str, messages: list[tuple[str, str]]) -> None:
    assert warnings(text) == messages


def test_a_pair_that_may_overlap_is_no_warning() -> None:
    text = body("head", "x", "[0, 0, 0]") + body("post", "", "[15, 0, 90]") + body("far", "", "[900, 0, 0]")
    permitted = '[[collision]]\nname = "c"\nall = true\nexcept = [["x", "post"]]\n'
    assert warnings(text + permitted) == []
    workpieces = permitted.replace('["x", "post"]', '["x", "post"], ["head", "workpieces"]')
    assert warnings(text + '[[nest]]\nname = "tray"\nat = [0, 0, 470]\nworkpiece = 20\nfilled = 1\n' + workpieces) == []


def test_what_moves_without_a_known_end_is_not_judged() -> None:
    text = MACHINE.replace("travel = [0, 200]\n", "") + body("head", "x", "[0, 0, 0]") + body("post", "", "[15, 0, 90]")
    assert diagnose("m.toml", text, no_files).findings == []


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        (
            body("plate", "", "", "[200, 200, 20]") + body("post", "", "[0, 0, 22.5]"),
            ["post hangs in the air, 2.5 mm above plate"],
        ),
        (body("plate", "", "", "[200, 200, 20]") + body("post", "", "[0, 0, 20]"), []),
        # What it stands on is not described, or is at its side.
        (body("plate", "", "", "[200, 200, 20]") + body("post", "", "[0, 0, 26]"), []),
        (body("plate", "", "", "[200, 200, 20]") + body("post", "", "[110, 0, 22.5]"), []),
        (body("plate", "", "", "[200, 200, 20]") + body("arm", "", "[0, 0, 22.5]") + body("mast", "", "[20, 0, 20]"), []),
        # It moves against what is below it, or with that.
        (body("plate", "", "[0, 0, 77.5]", "[200, 200, 20]") + body("slide", "x", ""), []),
        (
            body("slide", "x", "") + body("head", "x", "[0, 0, 21]"),
            ["head hangs in the air, 1 mm above slide"],
        ),
        (body("plate", "", "", "[200, 200, 20]") + body("hand", "", "[0, 0, 21]", more='when = "time > 1"\n'), []),
    ],
)
def test_bodies_that_hang_just_above_one(text: str, messages: list[str]) -> None:
    assert [message for message, _ in warnings(text)] == messages
