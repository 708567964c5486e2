"""Warnings about cups, jaws and beams that are of no use where they are."""

from __future__ import annotations

import pytest

from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.world.check import diagnose

AXES = """\
[[mic488]]
name = "m"
[[axis]]
name = "x"
drive = "m.M1"
pitch = 5.0
travel = [0, 300]
at = [0, 0, 400]
[[cylinder]]
name = "lift"
extend = "m.OUT1"
stroke = 50
on = "x"
along = "-z"
"""
TRAY = """\
[[nest]]
name = "tray"
at = [100, 0, 300]
workpiece = [40, 40, 20]
filled = 1
"""


def cup(at: str, name: str = "cup") -> str:
    return f'[[vacuum]]\nname = "{name}"\nejector = "m.OUT2"\non = "lift"\nat = {at}\n'


def jaws(at: str) -> str:
    return f'[[gripper]]\nname = "jaws"\nclose = "m.OUT3"\noverlap = 5\nstroke = 50\non = "lift"\nat = {at}\n'


def beam(at: str, sees: str, name: str = "gate") -> str:
    return f'[[beam]]\nname = "{name}"\nat = {at}\nlength = 100\nalong = "+y"\nsees = {sees}\nto = "m.IN1"\n'


def warnings(text: str) -> list[tuple[str, str]]:
    """Each with the line that it is about."""
    found = diagnose("m.toml", text, no_files).findings
    return [(one.message, text[one.span.start :].partition("\n")[0]) for one in found]


HEAD = '[[body]]\nname = "head"\non = "x"\nat = [0, 0, 100]\nsize = [20, 20, 20]\n'


SEES_NO_HEAD = ("gate never sees head: along x they stay 40 mm apart", 'sees = ["head"]')


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        # The cylinder lowers from 400 to 350, tops are at 320.
        (TRAY + cup("[0, 0, -28]"), []),
        (
            TRAY + cup("[0, 0, -27]"),
            [("cup never comes to a workpiece: it stays 1 mm too high for those on tray", "at = [0, 0, -27]")],
        ),
        (
            TRAY + cup("[0, 0, -120]"),
            [("cup never comes to a workpiece: it stays 18 mm too low for those on tray", "at = [0, 0, -120]")],
        ),
        (TRAY + cup("[-250, 0, -30]"), []),
        (
            TRAY + cup("[-400, 0, -30]"),
            [("cup never comes to a workpiece: along x it stays 95 mm beside those on tray", "at = [-400, 0, -30]")],
        ),
        (TRAY.replace("filled = 1", "filled = 3") + cup("[0, 0, 2]"), []),  # three layers
        # Jaws go over a workpiece.
        (TRAY + jaws("[0, 0, -35]"), []),
        (
            TRAY + jaws("[0, 0, -34]"),
            [("jaws never comes to a workpiece: it stays 1 mm too high for those on tray", "at = [0, 0, -34]")],
        ),
        # Where another one may have stacked workpieces there is no limit.
        (TRAY + cup("[0, 0, -28]") + cup("[0, 0, 100]", "other"), []),
        (
            TRAY + cup("[0, 0, -28]") + cup("[0, 500, 100]", "other"),
            [("other never comes to a workpiece: along y it stays 395 mm beside those on tray", "at = [0, 500, 100]")],
        ),
        # Without workpieces, and without an end of the travel, nothing is known.
        (TRAY.replace("filled = 1", "") + cup("[0, 0, 500]"), []),
        (
            TRAY
            + '[[axis]]\nname = "z"\ndrive = "m.M3"\npitch = 5.0\non = "x"\nalong = "-z"\n'
            + cup("[0, 0, 500]").replace('on = "lift"', 'on = "z"'),
            [],
        ),
        # Beams see what is carried past them, and what falls.
        (TRAY + cup("[0, 0, -28]") + beam("[250, -50, 200]", '["workpieces"]'), []),
        (
            TRAY + cup("[0, 0, -28]") + beam("[250, -50, 400]", '["workpieces"]'),
            [("gate never sees workpieces: along z they stay 8 mm apart", 'sees = ["workpieces"]')],
        ),
        (
            HEAD + beam("[350, -50, 510]", '["head"]'),
            [SEES_NO_HEAD],
        ),
        (HEAD + beam("[305, -50, 510]", '["head"]'), []),
        (HEAD + beam("[350, -50, 510]", '["head"]').replace("length", "hysteresis = 1\nlength"), [SEES_NO_HEAD]),
    ],
)
def test_what_is_of_no_use_is_warned_of(text: str, messages: list[tuple[str, str]]) -> None:
    assert warnings(AXES + text) == messages


def test_what_turns_comes_all_around() -> None:
    """An arm of 100 mm with a cup on its end."""
    arm = '[[axis]]\nname = "arm"\nkind = "rotary"\ndrive = "m.M1"\nunit = "degree"\npulses_per_unit = 100\nat = [0, 0, 300]\n'
    text = '[[mic488]]\nname = "m"\n' + arm + cup("[100, 0, 21]").replace('on = "lift"', 'on = "arm"')
    assert warnings(text + TRAY) == []
    assert warnings(text + TRAY.replace("[100, 0, 300]", "[0, -100, 300]")) == []
    assert warnings(text + TRAY.replace("[100, 0, 300]", "[0, -250, 300]")) == [
        ("cup never comes to a workpiece: along y it stays 45 mm beside those on tray", "at = [100, 0, 21]")
    ]


@pytest.mark.parametrize(
    ("on", "at", "by"),
    [
        (None, "[500, 0, 700]", None),
        (None, "[620, 0, 700]", None),  # half of both widths, and a workpiece
        (None, "[720, 0, 700]", "x it"),
        (None, "[500, 0, 650]", None),  # it goes down by less than a workpiece
        (None, "[500, 0, 500]", "z it"),
        ("lift", "[300, 0, 320]", None),  # from 250 to 700 mm and more
        ("lift", "[300, 0, 500]", "z it"),
    ],
)
def test_belts_that_are_apart_are_warned_of(on: str | None, at: str, by: str | None) -> None:
    belt = '[[conveyor]]\nname = "{}"\nlength = 500\nspeed = 100\nrun = "m.OUT1"\n'
    place = f"at = {at}\n" + ("" if on is None else f'on = "{on}"\n')
    found = warnings(AXES + belt.format("a") + 'at = [0, 0, 700]\nnext = "b"\n' + belt.format("b") + place)
    assert [line for _, line in found] == ([] if by is None else ['next = "b"'])
    assert by is None or f"a goes on to b, but along {by}s end stays" in found[0][0]


@pytest.mark.parametrize(
    ("switch", "messages"),
    [
        ("above = 300.0", []),
        ("above = 301.0", [("this switch is never on: x goes from 0 to 300", "above = 301.0")]),
        ("below = 0.0", []),
        ("below = -1.0", [("this switch is never on: x goes from 0 to 300", "below = -1.0")]),
        ("below = 300.0", [("this switch is always on: x goes from 0 to 300", "below = 300.0")]),
        ("below = 299.0", []),
        ("position = 303.0\nwidth = 6.0", []),
        ("position = 304.0\nwidth = 6.0", [("this switch is never on: x goes from 0 to 300", "position = 304.0")]),
        ("position = 304.0\nwidth = 6.0\nperiod = 100.0", []),
    ],
)
def test_switches_beyond_the_travel_are_warned_of(switch: str, messages: list[tuple[str, str]]) -> None:
    head, mark, tail = AXES.partition("[[cylinder]]")
    text = f'{head}[[axis.switch]]\nto = "m.IN1"\n{switch}\n{mark}{tail}'
    assert warnings(text) == messages
    assert warnings(text.replace("travel = [0, 300]", "")) == []
    turning = text.replace("pitch = 5.0", 'kind = "rotary"\nunit = "degree"\npulses_per_unit = 100')
    assert warnings(turning) == ([] if "position" in switch else messages)


def test_switches_beyond_the_stroke_are_warned_of() -> None:
    text = AXES + '[[cylinder.switch]]\nto = "m.IN1"\nabove = 51.0\n'
    assert warnings(text) == [("this switch is never on: lift goes from 0 to 50", "above = 51.0")]
    (one,) = diagnose("m.toml", text, no_files).findings
    assert one.hint == "let it change between 0 and 50, or give lift another travel"


PUSHER = """\
[[mic488]]
name = "m"
[[conveyor]]
name = "line"
length = 600
run = "m.OUT1"
speed = 100
workpiece = [40, 30, 60]
at = [0, 0, 100]
along = "{along}"
[[cylinder]]
name = "reject"
extend = "m.OUT2"
stroke = {stroke}
at = {at}
along = "{push}"
[[body]]
name = "blade"
on = "reject"
size = [10, 10, 40]
pushes = true
"""
FROM = {
    "+y": ("+x", [300, -80, 110]),
    "-y": ("-x", [-300, 80, 110]),
    "+x": ("+y", [-80, 300, 110]),
    "-x": ("-y", [80, -300, 110]),
}


@pytest.mark.parametrize("push", FROM)
@pytest.mark.parametrize(
    ("stroke", "missing"),
    [(94, None), (95.5, "14.5"), (100, "10"), (110, "0"), (110.001, None)],
    ids=["on the belt", "just over the edge", "too short", "exactly at the edge", "long enough"],
)
def test_a_pusher_that_leaves_workpieces_over_the_edge_of_a_belt(push: str, stroke: float, missing: str | None) -> None:
    along, at = FROM[push]
    text = PUSHER.format(along=along, stroke=stroke, at=at, push=push)
    message = f"blade does not push workpieces off line: their middle comes to {missing} mm before its edge"
    assert warnings(text) == ([] if missing is None else [(message, "[[body]]")])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[40, 30, 60]", "[40, 130, 60]"),
        ("workpiece = [40, 30, 60]\n", ""),
        ("[300, -80, 110]", "[700, -80, 110]"),
        ("[300, -80, 110]", "[300, -80, 170]"),
        ("[300, -80, 110]", "[300, -60, 110]"),
        ("pushes = true", ""),
    ],
    ids=["wider than the belt", "of no known size", "beside the belt", "above them", "already in one", "no pusher"],
)
def test_no_warning_of_a_pusher_where_nothing_is_certain(old: str, new: str) -> None:
    text = PUSHER.format(along="+x", stroke=100, at=[300, -80, 110], push="+y")
    assert len(warnings(text)) == 1
    assert warnings(text.replace(old, new)) == []
