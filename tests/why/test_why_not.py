"""Questions that begin with ``not``: what a condition lacks, and whether that comes by itself."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from steptwin.files.world import World

MACHINE = """
[world]
name = "w"
[[mic488]]
name = "c"
program = "p.prg"
start = true
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
travel = [0.0, 100.0]
[[button]]
name = "go"
to = "c.IN1"
[[relay]]
name = "k"
coil = "c.OUT1"
[[wire]]
from = "k.no"
to = "c.IN2"
"""
PROGRAM = b"DELAY 0.5\nOUT1 = ON\nDELAY 2\nOUT3 = ON\nWAIT IN1 = ON\nOUT4 = ON\n"
BEFORE = "c waits at line 3 `DELAY 2`"
ALONE = "it becomes true at {} s if nothing comes from outside"
OUTSIDE = "it does not become true within 60 s if nothing comes from outside: only from outside"


def lacks(condition: str, at: float) -> Sequence[str]:
    world = World.from_toml(MACHINE, {"p.prg": PROGRAM})
    world.run(5.0)
    answer = world.why(f"not {condition}", at)
    assert answer.state == f"not {condition} is true"
    return [link.text for link in answer.links]


@pytest.mark.parametrize(
    ("condition", "at", "links"),
    [
        ("c.OUT3", 1.0, ["c.OUT3 is 0 from the beginning", BEFORE, ALONE.format("2.502000")]),
        ("c.OUT4", 1.0, ["c.OUT4 is 0 from the beginning", BEFORE, OUTSIDE]),
        (
            "(c.IN2 and c.OUT3)",
            0.1,
            [
                "c.IN2 is 0 from the beginning, driven by k.no",
                "k.no is 0 from the beginning, driven by c.OUT1",
                "c.OUT1 is 0 from the beginning",
                "c waits at line 1 `DELAY 0.5`",
                "c.OUT3 is 0 from the beginning",
                ALONE.format("2.502000"),
            ],
        ),
        ("(c.IN2 and c.OUT3)", 1.0, ["c.OUT3 is 0 from the beginning", BEFORE, ALONE.format("2.502000")]),
        ("(c.OUT1 and not c.OUT3)", 3.0, ["c.OUT3 is 1 since 2.502000 s", OUTSIDE]),
        ("(x.position > 3 cm and c.OUT1)", 1.0, ["x.position is 0 mm", OUTSIDE]),
        (
            "(c.OUT3 or c.OUT4)",
            1.0,
            ["c.OUT3 is 0 from the beginning", BEFORE, "c.OUT4 is 0 from the beginning", ALONE.format("2.502000")],
        ),
        ("go", 1.0, ["go is 0 from the beginning, not pressed until then"]),
    ],
)
def test_what_is_lacking(condition: str, at: float, links: list[str]) -> None:
    assert lacks(condition, at)[: len(links)] == links


def test_a_condition_that_is_true_lacks_nothing() -> None:
    world = World.from_toml(MACHINE, {"p.prg": PROGRAM})
    world.run(5.0)
    answer = world.why("not c.OUT3")
    assert (answer.state, answer.links[0].text) == ("not c.OUT3 is false", "c.OUT3 became 1")
