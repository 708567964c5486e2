"""The axis on which properties are tried: 800 pulses per mm, 4 mm per turn; by default 100 mm take 2.1 s."""

from __future__ import annotations


def slide(
    table: str = "table",
    axis: str = "x",
    *,
    vel: float = 50.0,
    ramps: float = 500.0,
    travel: tuple[float, float] | None = (-50.0, 150.0),
    more: str = "",
) -> str:
    """The description of an axis on M1 of a MIC488; mm, mm/s, mm/s². ``more``: keys of the controller."""
    ends = "" if travel is None else f"travel = [{travel[0]}, {travel[1]}]\n"
    return f"""
[[mic488]]
name = "{table}"
{more}
[mic488.M1]
unit = "mm"
gear = 800.0
acc = {ramps}
dec = {ramps}
vel = {vel}

[[axis]]
name = "{axis}"
drive = "{table}.M1"
pitch = 4.0
{ends}"""


GUARD = """
[[button]]
name = "guard"
to = "table.IN1"
"""
