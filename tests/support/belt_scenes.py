"""Scenes of logic, pneumatics and belts."""

from __future__ import annotations

from scenes import DRIVES, INVERTED, OUTPUTS, SOME_PITCH, SWITCH, Scene, axis, controller, sensor, stop, switch, table, wire

BELT_SCENES: dict[str, Scene] = {
    "logic": Scene(
        f"""
{controller("c")}

{table("button", "a", to="g1.in1")}
?contact = "NC"
?bounce = "⟨1..6⟩ ms"; bounces = ⟨#1..5⟩

{table("button", "b", to="g1.in2")}

{table("button", "d", to="c.IN1", join="series")}
?contact = "NC"

{table("button", "e", to="c.IN1", join="series", bounce="⟨1..6⟩ ms")}

{table("gate", "g1", kind="⟨and|or|nand|nor|xor⟩")}
inputs = ⟨#2..4⟩

{table("gate", "g2", kind="⟨and|or|nand|nor|xor⟩")}
inputs = ["c.OUT1", "t1.out", "l1.out"]

{table("gate", "g3", kind="not")}
inputs = ["⟨g1.out|c.OUT2⟩"]

{table("latch", "l1", set="⟨g1.out|c.OUT1⟩", reset="⟨c.OUT2|n1.out⟩")}
?priority = "⟨set|reset⟩"

{table("timer", "t1", kind="⟨on-delay|off-delay|pulse⟩", time="⟨10..90⟩ ms", input="⟨c.OUT1|g1.out⟩")}

{table("timer", "t2", kind="⟨on-delay|off-delay|pulse⟩", time="⟨10..90⟩ ms", input="⟨l1.out|g3.out⟩")}

{table("counter", "n1")}
preset = ⟨#1..4⟩
up = "⟨c.OUT1|g1.out|t1.out⟩"
?down = "c.OUT2"
?reset = "c.OUT3"

{table("relay", "k1", coil="⟨c.OUT1|g2.out⟩")}
?pull_in = "⟨5..30⟩ ms"
?drop_out = "⟨5..30⟩ ms"

{wire("k1.⟨no|nc⟩", "c.IN2")}
?delay = "⟨1..20⟩ ms"
?inverted = true

{wire("n1.out", "c.IN3")}
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
{controller("c")}

{table("cylinder", "z", extend="c.OUT1")}
?stroke = ⟨40..160⟩
?extend_time = "⟨50..200⟩ ms"
?retract_time = "⟨50..200⟩ ms"
?switching = "⟨5..40⟩ ms"
{switch("cylinder", "c.IN1", "above = ⟨20..40⟩", SWITCH)}
{switch("cylinder", "c.IN2", "position = ⟨10..30⟩", "width = ⟨1..6⟩", SWITCH)}

{table("cylinder", "y", valve="double", extend="c.OUT2", retract="⟨c.OUT3|z.extended⟩")}
?extend_time = "⟨50..200⟩ ms"
?retract_time = "⟨50..200⟩ ms"
?switching = "⟨5..40⟩ ms"
?start = "extended"

{wire("⟨z|y⟩.⟨extended|retracted⟩", "c.IN3")}

{table("transducer", "way", of="⟨z|y⟩.position", to="c.AIN1")}
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
        f"""
{controller("c")}

{table("conveyor", "p")}
length = ⟨150..250⟩
speed = ⟨200..500⟩
?run = "c.OUT1"
feed = "c.OUT2"
?feed_every = "⟨150..400⟩ ms"
?workpiece = ⟨20..60⟩
?mass = ⟨0.1..2.0⟩
?marks = [⟨3..6⟩, ⟨10..15⟩]; mark_width = ⟨1.0..3.0⟩
next = "q"
{sensor("⟨40..120⟩", "c.IN1")}
?contact = "NC"
?bounce = "⟨1..5⟩ ms"
{sensor("⟨40..140⟩", "⟨c.IN2|t.in⟩")}
sees = "⟨mark|workpiece⟩"
{stop("⟨60..140⟩", "c.OUT3")}
{stop("⟨60..140⟩", "⟨c.OUT4|t.out⟩")}

{table("timer", "t", kind="off-delay", time="⟨30..120⟩ ms")}

{wire("t.out", "c.IN5")}

{table("conveyor", "q")}
length = ⟨120..200⟩
speed = ⟨100..500⟩
?run = "c.OUT⟨#4..5⟩"
{sensor("⟨5..90⟩", "c.IN4")}
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
    "driven": Scene(
        f"""
{DRIVES}
{axis("x", "c.M1", SOME_PITCH, INVERTED, "?start = ⟨0..20⟩")}

{table("conveyor", "p")}
length = ⟨60..120⟩
axis = "x"
?mm_per_unit = ⟨0.5..3.0⟩
feed = "c.OUT1"
?feed_every = "⟨90..300⟩ ms"
workpiece = ⟨10..25⟩
marks = [⟨1..2⟩, ⟨3..4⟩]
next = "q"
{sensor("⟨10..40⟩", "c.IN1")}
sees = "⟨mark|workpiece⟩"
?bounce = "⟨1..5⟩ ms"
{sensor("⟨15..60⟩", "c.IN2")}
{stop("⟨20..60⟩", "c.OUT2")}

{table("conveyor", "q")}
length = ⟨30..90⟩
?mass = ⟨0.1..2.0⟩
axis = "x"
mm_per_unit = ⟨0.5..3.0⟩
{sensor("⟨5..20⟩", "c.IN3")}
?contact = "NC"

{table("gripper", "jaws", close="c.OUT3", pick="c.OUT2")}
from = "⟨p|q⟩"
pick_at = ⟨10..30⟩
onto = "⟨p|q⟩"
place = "c.OUT4"

! kind = "empty-feeder", element = "p"
* p.count > ⟨#0..2⟩ and q.count >= ⟨#0..2⟩
* c.IN1 != c.IN2 or jaws.held
""",
        OUTPUTS
        + """
+ { write = { "c.M1_EN" = 1, "c.OUT1" = 1 } }
{ write = { "c.M1_VEL_ABS" = ⟨20..90⟩ } }
{ write = { "c.M1_VEL_ABS" = ⟨-50..90⟩, "c.OUT1" = ⟨#0..1⟩ } }
{ write = { "c.M1_POS_REL" = ⟨5..60⟩, "c.OUT1" = ⟨#0..1⟩ } }
{ write = { "c.M1_STOP" = 1 } }
""",
    ),
    "hands": Scene(
        f"""
{controller("c")}

{table("conveyor", "p")}
length = ⟨150..250⟩
speed = ⟨200..500⟩
?run = "cup.held"
feed_every = "⟨90..250⟩ ms"
workpiece = ⟨20..60⟩
?mass = ⟨0.1..2.0⟩
{stop("⟨100..140⟩", "c.OUT5")}

{table("conveyor", "q")}
length = ⟨150..250⟩
speed = ⟨50..500⟩
?next = "p"

{table("vacuum", "cup", ejector="c.OUT1", pick="c.OUT2", place="c.OUT3")}
?from = "p"
?onto = "q"; place_at = ⟨10..90⟩
?vacuum = ⟨60..90⟩
?threshold = ⟨20..55⟩
?build_up = "⟨10..90⟩ ms"
?release = "⟨10..90⟩ ms"

{table("gripper", "jaws", close="c.OUT4", pick="⟨c.OUT2|cup.held⟩", place="c.OUT3")}
from = "⟨p|q⟩"
pick_at = ⟨60..120⟩
?onto = "q"; place_at = ⟨60..120⟩
?stroke = ⟨15..30⟩
?width = ⟨5..12⟩
?close_time = "⟨20..120⟩ ms"
?open_time = "⟨20..120⟩ ms"

{wire("jaws.⟨opened|closed|held⟩", "c.IN1")}

{table("transducer", "air", of="cup.pressure", to="c.AIN1")}
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
}
