"""Scenes of axes, and of what they move."""

from __future__ import annotations

from scenes import (
    BACKLASH,
    DRIVES,
    IN_MM,
    INVERTED,
    MOTOR,
    MOVES,
    OUTPUTS,
    PITCH,
    SOME_PITCH,
    STALL,
    SWITCH,
    TRAVEL,
    Scene,
    axis,
    controller,
    switch,
    table,
    wire,
)

CLOSED = f"""{IN_MM}
enc_resol = ⟨#400..4000⟩
?enc_tolerance = ⟨#1..4⟩
?pos_ctrl_mode = "ENCODER"
?err_ctrl_mode = "⟨ERRMODE0|ERRMODE1⟩\""""
FOLLOWING = """enc_resol = 400
mot_resol = 3200
acc = 900.0
dec = 900.0
vel = 300.0
pos_ctrl_mode = "ENCFOLLOW\""""

AXIS_SCENES: dict[str, Scene] = {
    "axes": Scene(
        f"""
{DRIVES}
{axis("x", "c.M1", SOME_PITCH, INVERTED, TRAVEL, "?start = ⟨0..20⟩", BACKLASH)}
{switch("axis", "c.IN1", "above = ⟨20..40⟩", SWITCH)}
{switch("axis", "c.IN2", "below = ⟨0..10⟩", SWITCH)}
{switch("axis", "c.IN3", "position = ⟨1..9⟩", "width = ⟨0.5..3.0⟩", "period = ⟨7.0..11.0⟩")}

{axis("y", "c.M2", 'kind = "rotary"', "pulses_per_rev = ⟨#2000..4000⟩", '?unit = "⟨rev|degree⟩"', INVERTED)}
{switch("axis", "c.IN4", "position = ⟨0.1..0.9⟩", "width = ⟨0.1..0.2⟩", SWITCH)}

! {STALL}
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
{ power_cycle = "c" }, { write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = ⟨-10..60⟩ } }
""",
    ),
    "motors": Scene(
        f"""
{DRIVES}
{axis("x", "c.M1", PITCH, f"?{TRAVEL}", BACKLASH, INVERTED, MOTOR)}
?resonance = [⟨100..300⟩, ⟨400..700⟩]

{axis("y", "c.M2", PITCH, MOTOR)}
resonance = [⟨100..300⟩, ⟨400..700⟩]
resonance_growth = ⟨20.0..60.0⟩
?resonance_fading = ⟨5.0..60.0⟩
?vibration = ⟨0.02..0.2⟩
?full_steps = ⟨200|400⟩

{table("load", "m", axis="⟨x|y⟩")}
mass = ⟨0.5..4.0⟩
?force = ⟨-60..60⟩
?when = "x.position > ⟨5..30⟩"

{table("load", "n", axis="x")}
friction_force = ⟨30..300⟩
?load = ⟨-0.1..0.1⟩
of = "⟨x.position|y.position|time⟩"
points = [[0, ⟨0.0..0.3⟩], [⟨5..30⟩, 1], [⟨40..60⟩, ⟨0.5..2.0⟩]]
?resolution = ⟨0.05..0.2⟩

! kind = "other-load", element = "⟨m|n⟩", factor = ⟨0..5⟩
! {STALL}
* n.share > ⟨0.2..0.8⟩ or m.acts
* ⟨x|y⟩.stalled
""",
        MOVES
        + """
{ write = { "c.M1_VMAX" = ⟨60..200⟩, "c.M1_ACC" = ⟨300..3000⟩ } }
{ write = { "c.M2_POS_ABS" = ⟨-60..60⟩ } }
{ until = "abs(y.lost) > ⟨0..100⟩", within = "⟨50..300⟩ ms" }
{ power_cycle = "c" }, { write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = ⟨-10..60⟩ } }
""",
    ),
    "falls": Scene(
        f"""
{DRIVES}
{axis("x", "c.M1", PITCH, f"?{TRAVEL}", BACKLASH, MOTOR)}
when_off = "free"
?overruns = true
?detent = ⟨0.01..0.06⟩
?hold_current = ⟨0.0..0.6⟩
?full_steps = 200

{axis("y", "c.M2", PITCH, INVERTED, MOTOR)}
overruns = true
?when_off = "free"; detent = ⟨0.05..0.4⟩; full_steps = 200

{table("brake", "b", axis="x")}
torque = ⟨0.1..0.8⟩
?release = "c.OUT1"
?release_time = "⟨5..60⟩ ms"
?apply_time = "⟨5..60⟩ ms"

{table("load", "m", axis="x")}
mass = ⟨0.5..4.0⟩
force = ⟨-60..60⟩
when = "c.OUT2"

{table("collision", "k", when="x.position ⟨>|<⟩ ⟨5..30⟩ and y.position > ⟨2..9⟩")}
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
{ write = { "c.M2_EN" = 1, "c.M2_VEL_ABS" = ⟨-90..90⟩ } }, { wait = "⟨50..150⟩ ms" }, { write = { "c.M2_EN" = 0 } }
{ write = { "c.M2_STOP" = 1 } }
""",
    ),
    "encoders": Scene(
        f"""
{controller("c", M1=IN_MM, M2=CLOSED, M3=FOLLOWING)}

{axis("x", "c.M1", PITCH, BACKLASH, f"?{TRAVEL}")}
[axis.encoder]
⟨counts_per_rev|counts_per_unit⟩ = ⟨#300..2000⟩
?mount = "load"

{axis("y", "c.M2", PITCH, BACKLASH)}
[axis.encoder]
counts_per_rev = ⟨#-2000..-300⟩
?index = true; offset = ⟨0.0..5.0⟩
?mount = "load"

{axis("z", "c.M3", 'kind = "rotary"')}
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
{axis("x", "c.M1", BACKLASH, INVERTED)}

{table("shaft", "s", axis="x")}
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

{table("follower", "f", shaft="s")}
points = [[⟨0..40⟩, ⟨0..3⟩], [⟨90..120⟩, ⟨5..12⟩], [⟨150..180⟩, ⟨5..12⟩], [⟨200..350⟩, 0]]
?unit = "⟨cm|degree⟩"
{switch("follower", "c.IN3", "above = ⟨3..8⟩", SWITCH)}
{switch("follower", "c.IN4", "position = ⟨2..4⟩", "width = ⟨0.2..1.0⟩", SWITCH)}

{table("transducer", "v", of="⟨f.position|s.angle|x.position|c.M1.velocity⟩", to="c.AIN2")}
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
{axis("x", "c.M1", BACKLASH, TRAVEL)}

{axis("y", "c.M2", INVERTED)}

{table("carriage", "t", axis="x")}
frequency = ⟨8..30⟩
?damping = ⟨0.02..0.3⟩
{switch("carriage", "c.IN1", "above = ⟨10..30⟩", SWITCH)}
{switch("carriage", "c.IN2", "position = ⟨10..30⟩", "width = ⟨1..5⟩")}

{table("carriage", "u", axis="y")}
frequency = ⟨8..30⟩

{table("tool", "h", axis="x", other="y")}
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
{axis("x", "c.M1", PITCH, INVERTED, MOTOR)}

{axis("y", "c.M2", PITCH, "?start = ⟨0.5..2.0⟩", MOTOR)}

{table("gantry", "g", axis="x", other="y")}
limit = ⟨2..9⟩
?mass = ⟨0.5..9.0⟩
?friction_force = ⟨5..60⟩
?effect = "⟨report|jam⟩"
?reset = "c.OUT1"

{wire("g.skewed", "c.IN1")}

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
    "ways": Scene(
        f"""
{controller("c", 'program = "p.prg"', 'positions = "p.csv"', "start = true", M1=IN_MM, M2=IN_MM)}
{table("line", "chips", kind="m1486")}
{table("m1486", "k", line="chips")}
address = 1
{table("m1486", "l", line="chips")}
address = 2

{axis("x", "c.M1", PITCH, BACKLASH)}

{axis("y", "c.M2", PITCH, INVERTED, MOTOR)}

{axis("u", "k.M1", PITCH, "pulses_per_rev = 12800", BACKLASH)}
[axis.motor]
torque = [[0, ⟨0.4..1.2⟩], [⟨400..900⟩, ⟨0.2..0.6⟩], [⟨1200..3000⟩, ⟨0.1..0.3⟩]]
inertia = ⟨0.00001..0.00008⟩
?friction = ⟨0.01..0.08⟩
?load = ⟨-0.15..0.15⟩
?start_speed = ⟨180..500⟩
?resonance = [⟨220..300⟩, ⟨400..600⟩]

{axis("v", "l.M1", PITCH, "pulses_per_rev = 12800", INVERTED)}

{table("tool", "h", axis="x", other="y")}
?x = [⟨0.3..0.7⟩, ⟨-0.7..0.7⟩]
[[tool.x_switch]]
above = ⟨2..12⟩
to = "c.IN1"
{SWITCH}

{table("tool", "i", axis="u", other="v")}
?y_travel = [⟨-90..-20⟩, ⟨20..90⟩]
[[tool.x_switch]]
above = ⟨1..9⟩
to = "k.B2"
[[tool.y_switch]]
position = ⟨-3..3⟩
width = ⟨0.5..2.0⟩
period = ⟨4..9⟩
to = "l.B3"

{table("carriage", "t", axis="x")}
frequency = ⟨8..30⟩
[[carriage.switch]]
above = ⟨2..12⟩
to = "c.IN3"

{table("carriage", "s", axis="u")}
frequency = ⟨8..30⟩
?damping = ⟨0.02..0.3⟩
[[carriage.switch]]
above = ⟨1..9⟩
to = "k.B4"

! kind = "slipping-belt", element = "⟨h|i⟩", belt = "⟨axis|other⟩"
! kind = "slack-belt", element = "⟨t|s⟩", share = ⟨0.2..0.9⟩
* i.x > ⟨1..9⟩ or s.position - u.position > ⟨0.1..0.6⟩
""",
        """
+ { send = "chips", text = "x1\\ra⟨#2000..9000⟩\\rv⟨#400..2000⟩\\rf⟨#6400..32000⟩\\rr\\r" }
+ { send = "chips", text = "x2\\ra⟨#2000..9000⟩\\rv⟨#400..2000⟩\\rf⟨#6400..32000⟩\\rr\\r" }
{ send = "chips", text = "x⟨1|2⟩\\r⟨f|b⟩⟨#640..32000⟩\\rr\\r" }
{ send = "chips", text = "x⟨1|2⟩\\rg⟨+|-⟩\\rr\\r" }
{ send = "chips", text = "x⟨1|2⟩\\rk\\r" }
{ until = "i.⟨x|y⟩ ⟨>|<⟩ ⟨1..9⟩", within = "⟨20..90⟩ ms" }
{ until = "s.position ⟨>|<⟩ ⟨1..9⟩", within = "⟨20..90⟩ ms" }
""",
        {
            "p.prg": (
                "M1 = ON\nM2 = ON\nA:\nMOVETOCIRC @C\nWAITPOS\nDOCIRC @C\nWAITPOS\nMOVELIN @E\nWAITPOS\nDOARC @D\nWAITPOS\n"
                "MOVEPTP @E\nWAITPOS\nJUMP A\n"
            ),
            "p.csv": "C;⟨6..9⟩;⟨-3..3⟩;⟨2..4⟩;⟨-360..360⟩\nD;⟨2..9⟩;⟨-4..4⟩;⟨12..20⟩;⟨#0..1⟩\nE;⟨-2..6⟩;⟨-4..4⟩;⟨30..90⟩;0\n",
        },
    ),
}
