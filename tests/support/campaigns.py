"""Small campaigns: an axis that a script moves, and a door that opens at some moment."""

from __future__ import annotations

from pathlib import Path

WORLD = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 800.0
vel = 100.0

[[axis]]
name = "x"
drive = "table.M1"
pitch = 4.0
start = 10.0

[[script]]
name = "go"
steps = [
  { write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 40 } },
  { wait = "1 s" },
  { expect = "table.IN1 == 0" },
]
"""
CAMPAIGN = """
[campaign]
world = "world.toml"
runs = 40
seed = 7
end = "1500 ms"

[[vary]]
name = "t"
between = ["500 ms", "1500 ms"]
[[step]]
at = "t"
do = { set = { "table.IN1" = 1 } }
[[measure]]
name = "opened"
when = "table.IN1"
[[measure]]
name = "place"
value = "x.position"
"""
"""A run fails where the door opens in the first second of the script, that is in half of all."""


def campaign_file(folder: Path, text: str = CAMPAIGN, world: str = WORLD) -> Path:
    """A campaign and its world in a folder."""
    (folder / "world.toml").write_text(world)
    path = folder / "doors.toml"
    path.write_text(text)
    return path
