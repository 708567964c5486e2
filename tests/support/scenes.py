"""What `random_worlds` makes small worlds of: descriptions with gaps, and steps of an operator. See there for the notation."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Scene(NamedTuple):
    tables: str
    steps: str
    """One in each line, drawn by chance; those that begin with ``+`` come first, once."""
    files: Mapping[str, str] = MappingProxyType({})


OUTPUTS = """
{ write = { "c.OUT⟨#1..4⟩" = ⟨#0..1⟩ } }
{ write = { "c.OUT⟨#1..4⟩" = 1, "c.OUT⟨#5..6⟩" = ⟨#0..1⟩ } }
{ write = { "c.OUT⟨#1..4⟩" = 1 } }
{ write = { "c.OUT⟨#1..4⟩" = 0 } }
"""
DRIVES = """
[[mic488]]
name = "c"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = ⟨300..900⟩
dec = ⟨300..900⟩
vel = ⟨60..120⟩
mot_resol = 3200
[mic488.M2]
unit = "mm"
gear = 640.0
acc = ⟨300..900⟩
dec = ⟨300..900⟩
vel = ⟨60..120⟩
mot_resol = 3200
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
MOTOR = """
torque = [[0, ⟨0.7..1.2⟩], [⟨400..600⟩, ⟨0.4..0.7⟩], [⟨900..1400⟩, ⟨0.1..0.3⟩]]
inertia = ⟨0.00001..0.00008⟩
?mass = ⟨0.5..3.0⟩
?friction = ⟨0.01..0.08⟩
?friction_force = ⟨1.0..12.0⟩
?load = ⟨-0.15..0.15⟩
?force = ⟨-20.0..20.0⟩
?start_speed = ⟨60..300⟩
"""
SWITCH = """
?hysteresis = ⟨0.1..2.0⟩
?contact = "NC"
?bounce = "⟨1..5⟩ ms"; bounces = ⟨#1..4⟩
"""

SCENES: dict[str, Scene] = {
    "logic": Scene(
        """
[[mic488]]
name = "c"

[[button]]
name = "a"
to = "g1.in1"
?contact = "NC"
?bounce = "⟨1..6⟩ ms"; bounces = ⟨#1..5⟩

[[button]]
name = "b"
to = "g1.in2"

[[button]]
name = "d"
to = "c.IN1"
join = "series"
?contact = "NC"

[[button]]
name = "e"
to = "c.IN1"
join = "series"
bounce = "⟨1..6⟩ ms"

[[gate]]
name = "g1"
kind = "⟨and|or|nand|nor|xor⟩"
inputs = ⟨#2..4⟩

[[gate]]
name = "g2"
kind = "⟨and|or|nand|nor|xor⟩"
inputs = ["c.OUT1", "t1.out", "l1.out"]

[[gate]]
name = "g3"
kind = "not"
inputs = ["⟨g1.out|c.OUT2⟩"]

[[latch]]
name = "l1"
set = "⟨g1.out|c.OUT1⟩"
reset = "⟨c.OUT2|n1.out⟩"
?priority = "⟨set|reset⟩"

[[timer]]
name = "t1"
kind = "⟨on-delay|off-delay|pulse⟩"
time = "⟨10..90⟩ ms"
input = "⟨c.OUT1|g1.out⟩"

[[timer]]
name = "t2"
kind = "⟨on-delay|off-delay|pulse⟩"
time = "⟨10..90⟩ ms"
input = "⟨l1.out|g3.out⟩"

[[counter]]
name = "n1"
preset = ⟨#1..4⟩
up = "⟨c.OUT1|g1.out|t1.out⟩"
?down = "c.OUT2"
?reset = "c.OUT3"

[[relay]]
name = "k1"
coil = "⟨c.OUT1|g2.out⟩"
?pull_in = "⟨5..30⟩ ms"
?drop_out = "⟨5..30⟩ ms"

[[wire]]
from = "k1.⟨no|nc⟩"
to = "c.IN2"
?delay = "⟨1..20⟩ ms"
?inverted = true

[[wire]]
from = "n1.out"
to = "c.IN3"
?delay = "⟨1..20⟩ ms"

! kind = "⟨welded-contact|open-coil⟩", element = "k1"
! kind = "stuck-output", element = "⟨g1|g2|g3|l1|t1|t2|n1⟩", level = ⟨#0..1⟩
! kind = "stuck-input", element = "l1", input = "⟨set|reset⟩", level = ⟨#0..1⟩
* n1.count ⟨>|>=|==⟩ ⟨#1..3⟩ or t1.out != t2.out
* not (a.pressed and k1.no) and c.IN1 < 0.5
""",
        OUTPUTS
        + """
{ press = "⟨a|b|d|e⟩", for = "⟨5..120⟩ ms" }
{ press = "⟨a|b|d|e⟩" }
{ release = "⟨a|b|d|e⟩" }
{ until = "⟨g1|g2|l1|t1|t2|n1⟩.out ⟨==|!=⟩ ⟨#0..1⟩", within = "⟨20..90⟩ ms" }
{ expect = "n1.count ⟨==|<|>=⟩ ⟨#0..3⟩ and ⟨a|b⟩.pressed" }
""",
    ),
    "pneumatics": Scene(
        f"""
[[mic488]]
name = "c"

[[cylinder]]
name = "z"
extend = "c.OUT1"
?stroke = ⟨40..160⟩
?extend_time = "⟨50..200⟩ ms"
?retract_time = "⟨50..200⟩ ms"
?switching = "⟨5..40⟩ ms"
[[cylinder.switch]]
above = ⟨20..40⟩
to = "c.IN1"
{SWITCH}
[[cylinder.switch]]
position = ⟨10..30⟩
width = ⟨1..6⟩
to = "c.IN2"
{SWITCH}

[[cylinder]]
name = "y"
valve = "double"
extend = "c.OUT2"
retract = "⟨c.OUT3|z.extended⟩"
?extend_time = "⟨50..200⟩ ms"
?retract_time = "⟨50..200⟩ ms"
?switching = "⟨5..40⟩ ms"
?start = "extended"

[[wire]]
from = "⟨z|y⟩.⟨extended|retracted⟩"
to = "c.IN3"

[[transducer]]
name = "way"
of = "⟨z|y⟩.position"
to = "c.AIN1"
points = [[0, ⟨0..1⟩], [⟨20..60⟩, ⟨5..8⟩], [100, ⟨2..4⟩]]
resolution = ⟨0.2..0.8⟩

! kind = "no-air", element = "⟨z|y⟩"
! kind = "jam", element = "⟨z|y⟩"
! kind = "stuck-output", element = "⟨z|y⟩", output = "⟨extended|retracted⟩", level = ⟨#0..1⟩
! kind = "drift", element = "way", volts = ⟨-2..2⟩
* z.position ⟨>|<|>=⟩ ⟨5..60⟩
* way.volts > ⟨1..5⟩ and y.position < ⟨20..80⟩
""",
        OUTPUTS
        + """
{ until = "⟨z|y⟩.⟨extended|retracted⟩", within = "⟨20..200⟩ ms" }
{ until = "z.position ⟨>|<⟩ y.position", within = "⟨20..200⟩ ms" }
""",
    ),
    "belts": Scene(
        """
[[mic488]]
name = "c"

[[conveyor]]
name = "p"
length = ⟨150..250⟩
speed = ⟨200..500⟩
?run = "c.OUT1"
feed = "c.OUT2"
?feed_every = "⟨150..400⟩ ms"
?workpiece = ⟨20..60⟩
?mass = ⟨0.1..2.0⟩
?marks = [⟨3..6⟩, ⟨10..15⟩]
?mark_width = ⟨1.0..3.0⟩
next = "q"
[[conveyor.sensor]]
at = ⟨40..120⟩
to = "c.IN1"
?contact = "NC"
?bounce = "⟨1..5⟩ ms"
[[conveyor.sensor]]
at = ⟨40..140⟩
to = "⟨c.IN2|t.in⟩"
sees = "⟨mark|workpiece⟩"
[[conveyor.stop]]
at = ⟨60..140⟩
hold = "c.OUT3"
[[conveyor.stop]]
at = ⟨60..140⟩
hold = "⟨c.OUT4|t.out⟩"

[[timer]]
name = "t"
kind = "off-delay"
time = "⟨30..120⟩ ms"

[[wire]]
from = "t.out"
to = "c.IN5"

[[conveyor]]
name = "q"
length = ⟨120..200⟩
speed = ⟨100..500⟩
?run = "c.OUT⟨#4..5⟩"
[[conveyor.sensor]]
at = ⟨5..90⟩
to = "c.IN4"
join = "⟨parallel|series⟩"
[[conveyor.stop]]
at = ⟨20..110⟩
?hold = "c.OUT⟨#5..6⟩"

! kind = "⟨belt-stop|empty-feeder⟩", element = "p"
! kind = "stuck-input", element = "⟨p|q⟩", input = "stop1", level = ⟨#0..1⟩
* p.count ⟨>|==|>=⟩ ⟨#1..3⟩ and q.count < ⟨#1..3⟩
""",
        OUTPUTS
        + """
+ { write = { "c.OUT1" = 1, "c.OUT5" = 1, "c.OUT2" = 1 } }
{ write = { "c.OUT2" = 0 } }
{ write = { "c.OUT2" = 1 } }
{ until = "c.IN⟨#1..4⟩ == ⟨#0..1⟩", within = "⟨20..200⟩ ms" }
{ expect = "p.count == ⟨#0..3⟩" }
""",
    ),
    "hands": Scene(
        """
[[mic488]]
name = "c"

[[conveyor]]
name = "p"
length = ⟨150..250⟩
speed = ⟨200..500⟩
?run = "cup.held"
feed_every = "⟨90..250⟩ ms"
workpiece = ⟨20..60⟩
?mass = ⟨0.1..2.0⟩
[[conveyor.stop]]
at = ⟨100..140⟩
hold = "c.OUT5"

[[conveyor]]
name = "q"
length = ⟨150..250⟩
speed = ⟨50..500⟩
?next = "p"

[[vacuum]]
name = "cup"
ejector = "c.OUT1"
pick = "c.OUT2"
place = "c.OUT3"
?from = "p"
?onto = "q"
?place_at = ⟨10..90⟩
?vacuum = ⟨60..90⟩
?threshold = ⟨20..55⟩
?build_up = "⟨10..90⟩ ms"
?release = "⟨10..90⟩ ms"

[[gripper]]
name = "jaws"
close = "c.OUT4"
pick = "⟨c.OUT2|cup.held⟩"
place = "c.OUT3"
from = "⟨p|q⟩"
pick_at = ⟨60..120⟩
?onto = "q"
?place_at = ⟨60..120⟩
?stroke = ⟨15..30⟩
?width = ⟨5..12⟩
?close_time = "⟨20..120⟩ ms"
?open_time = "⟨20..120⟩ ms"

[[wire]]
from = "jaws.⟨opened|closed|held⟩"
to = "c.IN1"

[[transducer]]
name = "air"
of = "cup.pressure"
to = "c.AIN1"
points = [[0, 1], [⟨20..60⟩, ⟨5..8⟩]]
resolution = ⟨0.2..0.8⟩

! kind = "leak", element = "cup"
! kind = "worn-jaws", element = "jaws"
! kind = "stuck-output", element = "⟨cup|jaws⟩", output = "held", level = ⟨#0..1⟩
* cup.pressure ⟨>|<⟩ ⟨10..50⟩
* jaws.position >= ⟨3..12⟩ or jaws.mass > 0 or cup.dropped + jaws.dropped > ⟨#0..1⟩
""",
        OUTPUTS
        + """
+ { write = { "c.OUT5" = 1, "c.OUT1" = 1, "c.OUT2" = 1 } }
{ write = { "c.OUT2" = ⟨#0..1⟩, "c.OUT3" = ⟨#0..1⟩ } }
{ write = { "c.OUT1" = ⟨#0..1⟩, "c.OUT4" = ⟨#0..1⟩ } }
{ until = "⟨cup|jaws⟩.held == ⟨#0..1⟩", within = "⟨20..200⟩ ms" }
""",
    ),
    "axes": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
?pitch = ⟨4.0..6.0⟩
?inverted = true
travel = [⟨-12..-2⟩, ⟨35..58⟩]
?start = ⟨0..20⟩
?backlash = ⟨0.02..0.4⟩
[[axis.switch]]
above = ⟨20..40⟩
to = "c.IN1"
{SWITCH}
[[axis.switch]]
below = ⟨0..10⟩
to = "c.IN2"
{SWITCH}
[[axis.switch]]
position = ⟨1..9⟩
width = ⟨0.5..3.0⟩
period = ⟨7.0..11.0⟩
to = "c.IN3"

[[axis]]
name = "y"
drive = "c.M2"
kind = "rotary"
pulses_per_rev = ⟨#2000..4000⟩
?unit = "⟨rev|degree⟩"
?inverted = true
[[axis.switch]]
position = ⟨0.1..0.9⟩
width = ⟨0.1..0.2⟩
to = "c.IN4"
{SWITCH}

! kind = "stall", axis = ⟨#1..2⟩, at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩
! kind = "lost-steps", axis = ⟨#1..2⟩, at_s = ⟨0.1..0.9⟩, pulses = ⟨#-60..60⟩, period_s = ⟨0.1..0.3⟩
! kind = "stuck", pin = "IN1", value = ⟨#0..1⟩, from_s = ⟨0.1..0.6⟩, until_s = ⟨0.7..1.2⟩
! kind = "bounce", pin = "IN2", bounces = ⟨#1..4⟩, for_ms = ⟨2.0..9.0⟩, every = ⟨#1..2⟩
* x.position ⟨>|<|>=⟩ ⟨5..40⟩
* abs(x.lost) > ⟨0..400⟩ or y.position % ⟨1000..3000⟩ > ⟨500..900⟩
""",
        MOVES
        + """
{ until = "x.position ⟨>|<⟩ ⟨5..40⟩", within = "⟨50..300⟩ ms" }
{ until = "not c.M1.moving", within = "⟨50..300⟩ ms" }
{ move = "c.M⟨#1..2⟩", ⟨to|by⟩ = ⟨5..20⟩, within = "⟨100..400⟩ ms" }
{ wait_for = "c.M⟨#1..2⟩", within = "⟨100..400⟩ ms" }
{ expect = "x.position ⟨>|<⟩ ⟨5..40⟩ and y.lost == 0" }
""",
    ),
    "motors": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
?travel = [⟨-12..-2⟩, ⟨35..58⟩]
?backlash = ⟨0.02..0.4⟩
?inverted = true
[axis.motor]
{MOTOR}
?resonance = [⟨100..300⟩, ⟨400..700⟩]

[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
[axis.motor]
{MOTOR}
resonance = [⟨100..300⟩, ⟨400..700⟩]
resonance_growth = ⟨20.0..60.0⟩
?resonance_fading = ⟨5.0..60.0⟩
?vibration = ⟨0.02..0.2⟩
?full_steps = ⟨200|400⟩

[[load]]
name = "m"
axis = "⟨x|y⟩"
mass = ⟨0.5..4.0⟩
?force = ⟨-60..60⟩
?when = "x.position > ⟨5..30⟩"

[[load]]
name = "n"
axis = "x"
friction_force = ⟨30..300⟩
?load = ⟨-0.1..0.1⟩
of = "⟨x.position|y.position|time⟩"
points = [[0, ⟨0.0..0.3⟩], [⟨5..30⟩, 1], [⟨40..60⟩, ⟨0.5..2.0⟩]]
?resolution = ⟨0.05..0.2⟩

! kind = "other-load", element = "⟨m|n⟩", factor = ⟨0..5⟩
! kind = "stall", axis = ⟨#1..2⟩, at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩
* n.share > ⟨0.2..0.8⟩ or m.acts
* ⟨x|y⟩.stalled
""",
        MOVES
        + """
{ write = { "c.M1_VMAX" = ⟨60..200⟩, "c.M1_ACC" = ⟨300..3000⟩ } }
{ write = { "c.M2_POS_ABS" = ⟨-60..60⟩ } }
{ until = "abs(y.lost) > ⟨0..100⟩", within = "⟨50..300⟩ ms" }
""",
    ),
    "falls": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
?travel = [⟨-12..-2⟩, ⟨35..58⟩]
?backlash = ⟨0.02..0.4⟩
[axis.motor]
{MOTOR}
when_off = "free"
?overruns = true
?detent = ⟨0.01..0.06⟩
?hold_current = ⟨0.0..0.6⟩
?full_steps = 200

[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
?inverted = true
[axis.motor]
{MOTOR}
overruns = true

[[brake]]
name = "b"
axis = "x"
torque = ⟨0.1..0.8⟩
?release = "c.OUT1"
?release_time = "⟨5..60⟩ ms"
?apply_time = "⟨5..60⟩ ms"

[[load]]
name = "m"
axis = "x"
mass = ⟨0.5..4.0⟩
force = ⟨-60..60⟩
when = "c.OUT2"

[[collision]]
name = "k"
when = "x.position ⟨>|<⟩ ⟨5..30⟩ and y.position > ⟨2..9⟩"
?effect = "jam"
?reset = "c.OUT3"

! kind = "worn-brake", element = "b", share = ⟨0.0..0.5⟩
! kind = "stuck-brake", element = "b"
! kind = "other-load", element = "m", factor = ⟨0..5⟩
! kind = "supply-drop", at_s = ⟨0.3..0.9⟩, for_s = ⟨0.02..0.3⟩
* x.position ⟨>|<⟩ ⟨-10..20⟩ and b.released
* k.hit
""",
        MOVES
        + OUTPUTS
        + """
+ { write = { "c.OUT1" = 1 } }
{ write = { "c.M1_EN" = ⟨#0..1⟩ } }
{ write = { "c.M1_EN" = 1 } }
{ write = { "c.M2_VEL_ABS" = ⟨-90..90⟩ } }
{ write = { "c.M2_STOP" = 1 } }
""",
    ),
    "encoders": Scene(
        f"""
{DRIVES}
enc_resol = ⟨#400..4000⟩
?enc_tolerance = ⟨#1..4⟩
?pos_ctrl_mode = "ENCODER"
?err_ctrl_mode = "⟨ERRMODE0|ERRMODE1⟩"
[mic488.M3]
enc_resol = 400
mot_resol = 3200
acc = 900.0
dec = 900.0
vel = 300.0
pos_ctrl_mode = "ENCFOLLOW"

[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
?backlash = ⟨0.02..0.4⟩
?travel = [⟨-12..-2⟩, ⟨35..58⟩]
[axis.encoder]
⟨counts_per_rev|counts_per_unit⟩ = ⟨#300..2000⟩
?mount = "load"

[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
?backlash = ⟨0.02..0.4⟩
[axis.encoder]
counts_per_rev = ⟨#-2000..-300⟩
?index = true; offset = ⟨0.0..5.0⟩
?mount = "load"

[[axis]]
name = "z"
drive = "c.M3"
kind = "rotary"
[axis.encoder]
follows = "⟨x|y⟩"
?slip = ⟨0.01..0.2⟩

! kind = "slip", axis = ⟨#1..2⟩, counts = ⟨#-40..40⟩, at_s = ⟨0.1..0.9⟩, period_s = ⟨0.1..0.3⟩, count = ⟨#1..3⟩
! kind = "lost-steps", axis = 1, at_s = ⟨0.1..0.9⟩, pulses = ⟨#-60..60⟩
! kind = "stall", axis = 2, at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩
* c.M⟨#1..3⟩.encoder ⟨>|<⟩ ⟨5..40⟩
* z.position > ⟨5..40⟩
""",
        MOVES
        + """
+ { write = { "c.M3_EN" = 1 } }
{ turn = "c.M4", counts = ⟨#-90..90⟩ }
{ couple = "c.M4", to = "⟨drive|free|blocked⟩" }
{ write = { "c.M4_EN" = 1, "c.M4_POS_REL" = ⟨-300..300⟩ } }
{ until = "c.M1.encoder > ⟨5..30⟩", within = "⟨50..300⟩ ms" }
""",
    ),
    "cams": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
?backlash = ⟨0.02..0.4⟩
?inverted = true

[[shaft]]
name = "s"
axis = "x"
ratio = ⟨-0.09..-0.03|0.03..0.09⟩
?offset = ⟨-50..400⟩
[[shaft.cam]]
from = ⟨0..180⟩
until = ⟨190..350⟩
to = "c.IN1"
?contact = "NC"
?bounce = "⟨1..5⟩ ms"
[[shaft.cam]]
from = ⟨270..350⟩
until = ⟨5..90⟩
to = "c.IN2"

[[follower]]
name = "f"
shaft = "s"
points = [[⟨0..40⟩, ⟨0..3⟩], [⟨90..120⟩, ⟨5..12⟩], [⟨150..180⟩, ⟨5..12⟩], [⟨200..350⟩, 0]]
?unit = "⟨cm|degree⟩"
[[follower.switch]]
above = ⟨3..8⟩
to = "c.IN3"
{SWITCH}
[[follower.switch]]
position = ⟨2..4⟩
width = ⟨0.2..1.0⟩
to = "c.IN4"
{SWITCH}

[[transducer]]
name = "v"
of = "⟨f.position|s.angle|x.position|c.M1.velocity⟩"
to = "c.AIN2"
points = [[0, ⟨0..2⟩], [⟨3..6⟩, ⟨5..9⟩], [⟨10..90⟩, ⟨0..9⟩]]
resolution = ⟨0.1..0.8⟩

! kind = "slipping-coupling", element = "s"
! kind = "stuck-follower", element = "f"
! kind = "worn-cam", element = "f", share = ⟨0.0..0.9⟩
! kind = "broken-wire", element = "v"
* f.position ⟨>|<|>=⟩ ⟨1..8⟩
* s.angle % 360 > ⟨10..300⟩ or v.volts == ⟨0..3⟩
""",
        MOVES
        + """
{ until = "f.position ⟨>|<⟩ ⟨1..8⟩", within = "⟨50..300⟩ ms" }
{ until = "s.angle ⟨>|<⟩ ⟨-90..90⟩ degree", within = "⟨50..300⟩ ms" }
""",
    ),
    "carriages": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
?backlash = ⟨0.02..0.4⟩
travel = [⟨-12..-2⟩, ⟨35..58⟩]

[[axis]]
name = "y"
drive = "c.M2"
?inverted = true

[[carriage]]
name = "t"
axis = "x"
frequency = ⟨8..30⟩
?damping = ⟨0.02..0.3⟩
[[carriage.switch]]
above = ⟨10..30⟩
to = "c.IN1"
{SWITCH}
[[carriage.switch]]
position = ⟨10..30⟩
width = ⟨1..5⟩
to = "c.IN2"

[[carriage]]
name = "u"
axis = "y"
frequency = ⟨8..30⟩

[[tool]]
name = "h"
axis = "x"
other = "y"
?x = [⟨0.3..0.7⟩, ⟨0.3..0.7⟩]
?y = [⟨0.3..0.7⟩, ⟨-0.7..-0.3⟩]
?x_travel = [⟨-9..-1⟩, ⟨30..60⟩]
?y_travel = [⟨-9..-1⟩, ⟨30..60⟩]
[[tool.x_switch]]
above = ⟨3..20⟩
to = "c.IN3"
{SWITCH}
[[tool.y_switch]]
below = ⟨-3..9⟩
to = "c.IN4"
{SWITCH}

! kind = "slack-belt", element = "t", share = ⟨0.2..0.9⟩
! kind = "slipping-belt", element = "h", belt = "⟨axis|other⟩"
* t.position ⟨>|<⟩ ⟨5..30⟩
* h.x > ⟨3..20⟩ and h.y < ⟨3..20⟩
""",
        MOVES
        + """
{ until = "⟨t|u⟩.position ⟨>|<⟩ ⟨1..40⟩", within = "⟨50..300⟩ ms" }
{ until = "h.⟨x|y⟩ ⟨>|<⟩ ⟨1..20⟩", within = "⟨50..300⟩ ms" }
""",
    ),
    "gantries": Scene(
        f"""
{DRIVES}
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
?inverted = true
[axis.motor]
{MOTOR}

[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
?start = ⟨0.5..2.0⟩
[axis.motor]
{MOTOR}

[[gantry]]
name = "g"
axis = "x"
other = "y"
limit = ⟨2..9⟩
?mass = ⟨0.5..9.0⟩
?friction_force = ⟨5..60⟩
?effect = "⟨report|jam⟩"
?reset = "c.OUT1"

[[wire]]
from = "g.skewed"
to = "c.IN1"

! kind = "stiff-guides", element = "g", factor = ⟨1..9⟩
! kind = "lost-steps", axis = 1, at_s = ⟨0.1..0.9⟩, pulses = ⟨#-600..600⟩
! kind = "stuck-output", element = "g", output = "skewed", level = ⟨#0..1⟩
* g.skew ⟨>|<⟩ ⟨-3..3⟩
* abs(g.position) > ⟨2..30⟩
""",
        MOVES
        + """
{ write = { "c.M1_POS_ABS" = ⟨10..30⟩, "c.M2_POS_ABS" = ⟨10..30⟩ } }
{ write = { "c.M1_POS_ABS" = ⟨10..30⟩, "c.M2_POS_ABS" = ⟨10..30⟩ } }
{ write = { "c.OUT1" = ⟨#0..1⟩ } }
""",
    ),
}
