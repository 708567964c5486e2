"""What `random_worlds` makes small worlds of: descriptions with gaps, and steps of an operator. See there for the notation.

Here is what several of them have: tables of controllers and elements, motors, and what is done with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Scene(NamedTuple):
    tables: str
    steps: str
    """One in each line, drawn by chance; those that begin with ``+`` come first, once."""
    files: Mapping[str, str] = MappingProxyType({})


def table(kind: str, name: str, /, *lines: str, **texts: str) -> str:
    """What a description has of a controller, a line or an element: its keys with a text in quotes, then other lines."""
    return "\n".join((f"[[{kind}]]", f'name = "{name}"', *(f'{key} = "{text}"' for key, text in texts.items()), *lines))


def controller(name: str, *lines: str, **drives: str) -> str:
    """A MIC488, its keys, and those of its drives by their names."""
    return table("mic488", name, *lines, *(f"[mic488.{drive}]\n{keys}" for drive, keys in drives.items()))


def axis(name: str, drive: str, *lines: str) -> str:
    return table("axis", name, *lines, drive=drive)


def switch(of: str, to: str, *lines: str) -> str:
    """A switch of an element that moves: of its last one above."""
    return "\n".join((f'[[{of}.switch]]\nto = "{to}"', *lines))


def wire(source: str, target: str) -> str:
    return f'[[wire]]\nfrom = "{source}"\nto = "{target}"'


def sensor(at: str, to: str) -> str:
    """A sensor of the last conveyor above."""
    return f'[[conveyor.sensor]]\nat = {at}\nto = "{to}"'


def stop(at: str, hold: str) -> str:
    """A stop of the last conveyor above."""
    return f'[[conveyor.stop]]\nat = {at}\nhold = "{hold}"'


QUICK = """acc = ⟨3000..9000⟩
dec = ⟨3000..9000⟩
vel = ⟨600..1200⟩"""
"""A drive in pulses."""
IN_MM = """unit = "mm"
gear = 640.0
acc = ⟨300..900⟩
dec = ⟨300..900⟩
vel = ⟨60..120⟩
mot_resol = 3200"""
DRIVES = controller("c", M1=IN_MM, M2=IN_MM)

PITCH = "pitch = 5.0"
SOME_PITCH = "?pitch = ⟨4.0..6.0⟩"
INVERTED = "?inverted = true"
TRAVEL = "travel = [⟨-12..-2⟩, ⟨35..58⟩]"
BACKLASH = "?backlash = ⟨0.02..0.4⟩"
MOTOR = """[axis.motor]
torque = [[0, ⟨0.7..1.2⟩], [⟨400..600⟩, ⟨0.4..0.7⟩], [⟨900..1400⟩, ⟨0.1..0.3⟩]]
inertia = ⟨0.00001..0.00008⟩
?mass = ⟨0.5..3.0⟩
?friction = ⟨0.01..0.08⟩
?friction_force = ⟨1.0..12.0⟩
?load = ⟨-0.15..0.15⟩
?force = ⟨-20.0..20.0⟩
?start_speed = ⟨60..300⟩"""
SWITCH = """?hysteresis = ⟨0.1..2.0⟩
?contact = "NC"
?bounce = "⟨1..5⟩ ms"; bounces = ⟨#1..4⟩"""

STALL = 'kind = "stall", axis = ⟨#1..2⟩, at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩'
OUTPUTS = """
{ write = { "c.OUT⟨#1..4⟩" = ⟨#0..1⟩ } }
{ write = { "c.OUT⟨#1..4⟩" = 1, "c.OUT⟨#5..6⟩" = ⟨#0..1⟩ } }
{ write = { "c.OUT⟨#1..4⟩" = 1 } }
{ write = { "c.OUT⟨#1..4⟩" = 0 } }
"""
MOVES = """
+ { write = { "c.M1_EN" = 1, "c.M2_EN" = 1 } }
{ write = { "c.M1_POS_ABS" = ⟨0..60⟩ } }
{ write = { "c.M1_POS_ABS" = ⟨-10..60⟩, "c.M2_POS_ABS" = ⟨-10..60⟩ } }
{ write = { "c.M1_POS_REL" = ⟨-30..30⟩ } }
{ write = { "c.M1_VEL_ABS" = ⟨-90..90⟩ } }
{ write = { "c.M⟨#1..2⟩_STOP" = 1 } }
{ write = { "c.M2_POS_ABS" = ⟨0..60⟩ } }
"""
