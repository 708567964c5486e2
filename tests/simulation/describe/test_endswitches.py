"""Warnings about switches at the ends of axes."""

from __future__ import annotations

import pytest

from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.world.check import diagnose

MIC = """\
[[mic488]]
name = "m"
[mic488.M1]
limit_mode = "{mode}"
in_kl = "IN1"
[mic488.IN1]
level = "{level}"
[[axis]]
name = "x"
drive = "m.M1"
pitch = 5.0
travel = [-1, 50]
{axis}
[[axis.switch]]
{zone}
contact = "{contact}"
to = "m.IN1"
{rest}
"""
CHIP = """\
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "c"
line = "chips"
[[axis]]
name = "y"
drive = "c.M1"
pitch = 5.0
start = {start}
[[axis.switch]]
below = 0
to = "c.B8"
contact = "{contact}"
[[script]]
name = "s"
steps = [{steps}]
{rest}
"""
SEEK = '{ home = "c.M1", seek = "-B8" }'
OTHER = '[[event]]\nat = "1 s"\nsteps = [{ send = "chips", text = "g+" }]'


def mic(
    contact: str, level: str = "active high", zone: str = "below = 0", mode: str = "KL", axis: str = "", rest: str = ""
) -> str:
    return MIC.format(contact=contact, level=level, zone=zone, mode=mode, axis=axis, rest=rest)


def warnings(text: str) -> list[tuple[str, str | None]]:
    return [(one.message, one.hint) for one in diagnose("m.toml", text, no_files).findings]


NC = (
    "m.IN1 is 1 wherever this switch is off, which for m is on: from there x never moves towards it",
    "contact = 'NO' here, or level = 'active low' in [m.IN1]",
)
NO = (
    "m.IN1 is 0 wherever this switch is off, which for m is on: from there x never moves towards it",
    "contact = 'NC' here, or level = 'active high' in [m.IN1]",
)
PARALLEL = 'join = "parallel"\n[[axis.switch]]\nabove = 40\ncontact = "NO"\njoin = "parallel"\nto = "m.IN1"'


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (mic("NO"), []),
        (mic("NC"), [NC]),
        (mic("NC", "active low"), []),
        (mic("NO", "active low"), [NO]),
        (mic("NC", mode="OFF"), []),
        (mic("NC", mode="KR"), []),
        (mic("NC", zone="position = 0\nwidth = 1"), [NC]),
        (mic("NC", zone="above = 10"), []),  # on below 10: the same as NO with below
        (mic("NC", zone="above = 10", axis="inverted = true"), [NC]),
        (mic("NO", rest=PARALLEL), []),
        (mic("NC", rest='join = "series"\n[[button]]\nname = "b"\nto = "m.IN1"\njoin = "series"'), []),
    ],
)
def test_a_limit_switch_with_the_wrong_contact(text: str, found: list[tuple[str, str]]) -> None:
    assert warnings(text) == found


@pytest.mark.parametrize(
    ("rest", "found"),
    [
        (
            "",
            [
                (
                    "nothing is joined to m.IN2, so this switch never goes on or off",
                    "an [[axis.switch]] with to = 'm.IN2', or no in_kr",
                )
            ],
        ),
        ('[[button]]\nname = "b"\nto = "m.IN2"', []),
        ('[[script]]\nname = "s"\nsteps = [{ repeat = 2, steps = [{ set = { "m.IN2" = 1 } }] }]', []),
    ],
)
def test_an_input_of_a_switch_to_which_nothing_is_joined(rest: str, found: list[tuple[str, str]]) -> None:
    assert warnings(f'[[mic488]]\nname = "m"\n[mic488.M1]\nin_kr = "IN2"\nin_kl = "none"\n{rest}') == found


SEEKS_NOTHING = (
    "this seek ends at once, without any motion: c.B8 is 0 when the world begins",
    "another start of y, or a switch on c.B8 with contact = 'NC'",
)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (CHIP.format(contact="NO", start=4, steps=SEEK, rest=""), [SEEKS_NOTHING]),
        (CHIP.format(contact="NC", start=4, steps=SEEK, rest=""), []),
        (CHIP.format(contact="NO", start=4, steps='{ move = "c.M1", by = -9000 }, ' + SEEK, rest=""), []),
        (CHIP.format(contact="NO", start=4, steps=SEEK, rest=OTHER), []),
    ],
)
def test_a_first_seek_that_ends_at_once(text: str, found: list[tuple[str, str]]) -> None:
    assert warnings(text) == found


def test_a_level_that_something_else_drives() -> None:
    set_it = '{ wait = "1 s" }, { set = { "m.in3" = 1, "m.IN4" = 1 } }'
    text = f'[[mic488]]\nname = "m"\n[[button]]\nname = "b"\nto = "m.IN3"\n[[script]]\nname = "s"\nsteps = [{set_it}]'
    assert warnings(text) == [
        (
            "m.IN3 is driven from line 3: this level lasts only until that drives it again",
            "{ fault = { kind = 'stuck', machine = 'm', pin = 'IN3', value = 1 } } holds it",
        )
    ]
