"""Scenes of workpieces in space: cups and jaws that take them from belts, nests and turntables."""

from __future__ import annotations

from scenes import DRIVES, MOVES, OUTPUTS, Scene, axis, table

SPACE = f"""
{DRIVES}

{axis("x", "c.M1", "pitch = 5.0", "at = [0, 0, ⟨150..160⟩]", 'along = "⟨+x|+y⟩"')}

{axis("turn", "c.M2", 'kind = "rotary"', "pulses_per_unit = 40.0", "at = [⟨10..40⟩, 30, 60]")}

{table("body", "disc", "diameter = 120", "height = 20", on="turn")}

{table("cylinder", "lift", "at = [0, 0, ⟨-2..2⟩]", extend="c.OUT1", on="x", along="-z")}
stroke = 40
extend_time = "⟨20..90⟩ ms"

{table("conveyor", "p", 'along = "⟨+x|-y⟩"', "at = [⟨-60..0⟩, 0, 80]", run="c.OUT2")}
length = 150
speed = ⟨100..400⟩
?ramp_up = "⟨10..60⟩ ms"
feed_every = "⟨80..200⟩ ms"
workpiece = [⟨12..30⟩, ⟨10..30⟩, 20]
?mass = ⟨0.1..2.0⟩

{table("nest", "tray", "at = [0, ⟨-60..-20⟩, 80]", "cells = [3, ⟨#1..2⟩]", "pitch = [30, 30]")}
workpiece = [⟨10..24⟩, 20]
filled = ⟨#0..6⟩
?snap = ⟨0.5..6.0⟩
"""
BEAMS = f"""
{table("beam", "low", "at = [-20, -20, ⟨82..98⟩]", "length = 90", along="⟨+x|+y⟩", to="c.IN1")}
?contact = "NC"
?hysteresis = ⟨1..9⟩

{table("beam", "high", 'on = "lift"', "at = [-40, 0, -30]", "length = 90", 'along = "+x"')}
?count = 3; pitch = 8
"""
WORKPIECE_SCENES: dict[str, Scene] = {
    "cup in space": Scene(
        f"""
{SPACE}
{table("vacuum", "cup", "at = [0, 0, ⟨-16..-10⟩]", ejector="c.OUT3", on="lift")}
diameter = ⟨2..14⟩
reach = ⟨2..9⟩
build_up = "⟨10..50⟩ ms"
{BEAMS}

{table("collision", "bump", 'between = ["workpieces", "disc"]')}

! kind = "leak", element = "cup"
! kind = "stuck-output", element = "⟨low|high⟩", output = "seen", level = ⟨#0..1⟩
* cup.held or low.seen and tray.count < ⟨#1..5⟩
* cup.dropped > ⟨#0..1⟩ or bump.hit
""",
        OUTPUTS
        + MOVES
        + """
{ put = "p", front = ⟨1..90⟩ }
{ put = "⟨p|tray⟩" }
{ remove = "⟨p|tray⟩.⟨#1..4⟩" }
""",
    ),
    "jaws in space": Scene(
        f"""
{SPACE}
{table("gripper", "jaws", "at = [0, 0, ⟨-36..-26⟩]", close="c.OUT3", on="lift", along="⟨+x|+y⟩")}
stroke = 40
overlap = ⟨2..9⟩
?close_time = "⟨20..90⟩ ms"
{BEAMS}

{table("body", "wall", "at = [50, 0, 0]", "size = [6, 60, 140]")}
?when = "c.OUT4"

{table("collision", "bump", 'between = ["lift", "wall"]', effect="⟨jam|report⟩")}
reset = "c.OUT4"

{table("body", "hand", "size = [10, 10, 10]", on="lift")}

! kind = "worn-jaws", element = "jaws"
* jaws.mass > 0 or high.seen
""",
        OUTPUTS + MOVES,
    ),
}
