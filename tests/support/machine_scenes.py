"""Scenes of supplies, voltages, controllers, programs, conditions and tables from other files."""

from __future__ import annotations

from plant_scenes import CHIP
from scenes import DRIVES, IN_MM, MOVES, OUTPUTS, QUICK, Scene, axis, controller, switch, table, wire

PROGRAM = """
COUNT = 0
IF IN1 = 1
  COUNT = 5
ENDIF
M1 = ON
M2 = ON
CFGINT_IN3 = RIS
MAIN:
COUNT = COUNT + 1
$D2 = COUNT
OUT⟨#1..3⟩ = ON
PABS M1 ⟨5..30⟩
WAITPOS
OUT1 = OFF
WAIT IN2 = ⟨ON|OFF⟩
DELAY ⟨0.01..0.09⟩
N = 0
WHILE N < ⟨#1..3⟩
  N = N + 1
  OUT6 = ON
  IF COUNT > ⟨#1..6⟩
    OUT7 = ON
  ELSE
    OUT7 = OFF
  ENDIF
  OUT6 = OFF
ENDWHILE
PABS M2 ⟨5..30⟩
VABS M1 -30
DELAY 0.02
VABS M1 0
PABS M1 0
WAITPOS
OUT⟨#1..3⟩ = OFF
JUMP MAIN
INT_IN3:
OUT4 = ON
DELAY 0.02
OUT4 = OFF
RETURN
"""

PROGRAMMED = controller("c", 'program = "p.prg"', "start = true", '?statement_time = "⟨1..3⟩ ms"', M1=IN_MM, M2=IN_MM)
HOMED = f"""{IN_MM}
pos_ctrl_mode = "⟨ENCODER|OFF⟩"
enc_resol = 400
home_mode = "⟨HOME1|HOME2⟩"
limit_mode = "⟨KL|KR|KL+KR⟩"
in_kl = "IN1"
in_kr = "IN2"
[mic488.IN5]
?filter = ⟨#1..2⟩
?level = 1"""
HELD = "\n" + "\n".join(
    f'{{ fault = {{ {fault}, machine = "c", pin = "IN4", name = "held" }} }}, '
    '{ set = { "c.IN4" = ⟨#0..1⟩ } }, { wait = "⟨1..30⟩ ms" }, { clear_fault = "held" }'
    for fault in ('kind = "bounce", for_ms = ⟨20..90⟩, bounces = 3', 'kind = "stuck", value = ⟨#0..1⟩', 'kind = "stuck"')
)

MACHINE_SCENES: dict[str, Scene] = {
    "quantities": Scene(
        f"""
{controller("c")}
{table("cylinder", "valve", 'extend = "c.OUT1"', 'extend_time = "⟨60..200⟩ ms"', 'retract_time = "⟨20..90⟩ ms"', "stroke = 10")}
{table("dcmotor", "pump", 'run = "c.OUT2"', "speed = ⟨30..300⟩", '?run_up = "⟨20..300⟩ ms"', '?coast = "⟨20..300⟩ ms"')}
{table("integrator", "tank", 'unit = "l"', "start = 2.0", "low = 0.0", "high = ⟨3..6⟩")}
rate = "⟨0.01..0.05⟩ * pump.speed - ⟨0.1..0.9⟩ * valve.position"
?reset = "c.OUT3"
{switch("integrator", "c.IN1", "above = ⟨2..3⟩", "?hysteresis = 0.2")}
{switch("integrator", "c.IN2", "below = ⟨0.2..2.0⟩", '?contact = "NC"', '?bounce = "⟨1..5⟩ ms"')}
{table("integrator", "used", 'unit = "l"', '?reset = "c.OUT4"')}
rate = "0.5 * valve.position * (1 - tank.at_low) + 0.1 * tank.rate"

! kind = "other-rate", element = "⟨tank|used⟩", factor = ⟨0.2..3.0⟩
! kind = "dead-motor", element = "pump"
* tank.value ⟨>|<⟩ ⟨1..4⟩ or used.value > ⟨0.1..2.0⟩
* pump.speed > ⟨20..90⟩ and not tank.at_high
""",
        OUTPUTS,
    ),
    "supplies": Scene(
        f"""
{controller("c", 'program = "p.prg"', "start = true")}
{controller("d")}
{controller("e")}

{table("supply", "s")}
feeds = ["c", "e"]
?on = "d.OUT1"; switched = true
?volts = ⟨20..40⟩; enough = ⟨5..19⟩
?delay = "⟨10..60⟩ ms"
?rise = "⟨0..90⟩ ms"
?hold_up = "⟨0..60⟩ ms"
?fall = "⟨0..90⟩ ms"

{table("supply", "t", feeds="d", rise="⟨5..60⟩ ms", fall="⟨5..60⟩ ms")}

{wire("s.good", "d.IN1")}

{wire("c.OUT1", "d.IN2")}
?delay = "⟨1..20⟩ ms"
?inverted = true

{table("transducer", "v", of="d.M1.position", to="d.AIN1")}
points = [[0, 0], [⟨10..30⟩, ⟨5..9⟩]]
?resolution = ⟨0.1..0.8⟩

! kind = "brown-out", element = "⟨s|t⟩", volts = ⟨2..22⟩
! kind = "brown-out", element = "s"
! kind = "stuck-output", element = "s", output = "good", level = ⟨#0..1⟩
* s.volts ⟨>|<|>=⟩ ⟨4..20⟩ V
* s.good and t.good or d.AIN1 > ⟨2..5⟩
""",
        """
{ write = { "d.OUT1" = ⟨#0..1⟩ } }
{ write = { "d.OUT1" = 1 } }
{ set = { "d.IN3" = ⟨#0..1⟩, "d.AIN2" = ⟨1..9⟩ } }
{ until = "s.volts ⟨>|<⟩ ⟨4..20⟩", within = "⟨20..200⟩ ms" }
""",
        {"p.prg": "A:\nOUT1 = ON\nDELAY ⟨0.02..0.09⟩\nOUT1 = OFF\nDELAY ⟨0.02..0.09⟩\nJUMP A\n"},
    ),
    "voltages": Scene(
        f"""
{controller("c", M1=QUICK)}
{controller("d")}

[[source]]
?name = "one"
to = "c.AIN1"
kind = "sine"
value = ⟨4..6⟩
amplitude = ⟨1..4⟩
?frequency = ⟨0.5..9.0⟩
?phase = ⟨-90..200⟩
?period = "⟨5..30⟩ ms"

{table("source", "two", to="c.AIN2", kind="ramp")}
begin = ⟨0..9⟩
end = ⟨0..9⟩
over = "⟨90..600⟩ ms"
?repeat = "⟨100..700⟩ ms"
?period = "⟨5..30⟩ ms"

{table("source", "three", to="d.AIN1", kind="table")}
points = [[0, ⟨0..9⟩], [⟨0.1..0.3⟩, ⟨0..9⟩], [⟨0.4..0.7⟩, ⟨0..9⟩]]
?repeat = "⟨700..900⟩ ms"
?period = "⟨5..30⟩ ms"

[[source]]
to = "d.AIN2"
value = ⟨0..10⟩

! kind = "⟨broken-wire|drift⟩", element = "two"
! kind = "drift", element = "three", volts = ⟨-6..6⟩
! kind = "stuck", pin = "AIN1", machine = "c", value = ⟨1..9⟩, from_s = ⟨0.1..0.6⟩, until_s = ⟨0.7..1.2⟩
* two.volts ⟨>|<|>=⟩ ⟨1..8⟩
* d.AIN1 > three.volts + ⟨0..2⟩ or c.AIN1 < ⟨3..6⟩ and not c.AIN2 == d.AIN2
* (time - ⟨0.2..0.9⟩) * 2 > abs(⟨0..1⟩ - time) / 3
""",
        """
+ { write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = 900 } }
{ set = { "c.IN1" = ⟨#0..1⟩ } }
{ until = "c.AIN1 ⟨>|<⟩ ⟨4000..6000⟩ mV", within = "⟨20..200⟩ ms" }
{ until = "c.M1.position + c.AIN2 > ⟨100..700⟩", within = "⟨20..200⟩ ms" }
{ expect = "two.volts < ⟨1..8⟩ and c.AIN1 - 1 > d.AIN2 * 0.5" }
""",
    ),
    "controllers": Scene(
        f"""
{controller("c", M1=IN_MM, M2=HOMED)}
{controller("e")}

{axis("x", "c.M2", "start = ⟨5..20⟩")}
{switch("axis", "c.IN1", "below = ⟨0..4⟩")}
{switch("axis", "c.IN2", "above = ⟨30..50⟩", '?join = "parallel"')}
{switch("axis", "c.IN5", "position = ⟨22..29⟩", "width = ⟨0.2..1.0⟩")}

! kind = "stall", machine = "c", axis = ⟨#1..2⟩, at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩, period_s = ⟨0.3..0.5⟩, count = 2
! kind = "slip", machine = "c", axis = ⟨#1..2⟩, counts = ⟨#-40..40⟩, at_s = ⟨0.1..0.9⟩, probability = 0.8
! kind = "bounce", machine = "c", pin = "IN⟨#4..5⟩", bounces = ⟨#1..4⟩, for_ms = ⟨2.0..9.0⟩, nth = ⟨#1..2⟩
! kind = "stuck", machine = "c", pin = "IN⟨#4..5⟩", from_s = ⟨0.1..0.6⟩, until_s = ⟨0.7..1.2⟩
! kind = "supply-drop", machine = "⟨c|e⟩", at_s = ⟨0.2..0.9⟩, for_s = ⟨0.02..0.3⟩, period_s = ⟨0.3..0.5⟩, until_s = 1.3
! kind = "power-cut", machine = "e", for_s = ⟨0.02..0.3⟩, written = ⟨#20..3000⟩, nth = ⟨#1..2⟩
! kind = "wear", machine = "e", writes = ⟨#0..2⟩
! kind = "master-error", machine = "c", from_s = ⟨0.1..0.6⟩, until_s = ⟨0.7..1.2⟩
* x.position ⟨>|<⟩ ⟨5..40⟩ or c.M2.status == ⟨#1..5⟩
""",
        MOVES
        + HELD
        + """
{ home = "c.M2", velocity = ⟨-50|50⟩, within = "⟨100..400⟩ ms" }
{ write = { "c.M2_HOME" = ⟨-50..-20⟩ } }
{ write = { "e.USER_REGISTER[1500]" = ⟨#1..99⟩, "e.USER_REG_SAVE" = 1 } }
{ set = { "c.IN⟨#4..6⟩" = ⟨#0..1⟩ } }
{ set = { "c.IN4" = 1, "c.IN6" = 1 } }
{ turn = "c.M⟨#3..4⟩", counts = ⟨#-90..90⟩ }
{ couple = "c.M3", to = "⟨drive|free|blocked⟩" }
{ write = { "c.M3_EN" = 1, "c.M3_POS_REL" = ⟨#-300..900⟩ } }
""",
    ),
    "programs": Scene(
        f"""
{PROGRAMMED}
{table("line", "chips", kind="m1486")}
{table("m1486", "k", line="chips", program="p.m1486")}

{wire("c.OUT1", "c.IN2")}
delay = "⟨1..90⟩ ms"
?inverted = true

{table("button", "b", to="c.IN3")}
?bounce = "⟨1..6⟩ ms"

{wire("c.OUT2", "k.B1")}

* c.M1.position > ⟨3..20⟩ and c.OUT4
* k.position > ⟨#500..3000⟩ or c.program == 1
""",
        """
{ press = "b", for = "⟨5..60⟩ ms" }
{ set = { "c.IN1" = ⟨#0..1⟩ } }
{ until = "c.OUT⟨#1..3⟩ == ⟨#0..1⟩", within = "⟨20..200⟩ ms" }
{ power_cycle = "⟨c|k⟩" }
@ variable c COUNT ⟨#1..9⟩
@ download c program_0 q.prg
@ download k program p.m1486
{ repeat = ⟨#2..3⟩, steps = [{ press = "b" }, { wait = "⟨2..20⟩ ms" }, { release = "b" }, { wait = "⟨2..20⟩ ms" }] }
{ until = "idle", within = "⟨20..200⟩ ms" }
""",
        {"p.prg": PROGRAM, "p.m1486": CHIP, "q.prg": "OUT5 = ON\nDELAY 0.1\nOUT5 = OFF\n"},
    ),
    "scripts": Scene(
        f"""
{DRIVES}
{table("use", "left", file="part.toml")}
[use.with]
drive = "c.M1"
?length = ⟨20..40⟩

{table("use", "right", file="part.toml")}
[use.with]
drive = "c.M2"
input = "IN5"

[[event]]
every = "⟨40..300⟩ ms"
steps = [{{ note = "tick" }}, {{ wait = "⟨0..30⟩ ms" }}, {{ set = {{ "c.IN1" = ⟨#0..1⟩ }} }}]

[[event]]
at = "⟨40..900⟩ ms"
steps = [{{ expect = "left_x.position < ⟨5..20⟩ and abs(right_x.position - left_x.position) <= ⟨1..9⟩" }}]

[[event]]
?name = "far"
when = "left_x.position - right_x.position ⟨>|<|>=⟩ ⟨-9..9⟩"
steps = [{{ repeat = ⟨#1..3⟩, steps = [{{ note = "far" }}, {{ press = "left_b", for = "⟨5..60⟩ ms" }}, {{ wait = "9 ms" }}] }}]

{table("script", "more")}
?at = "⟨30..200⟩ ms"
?repeat = ⟨#2..4⟩
steps = [{{ at = "⟨100..400⟩ ms" }}, {{ until = "c.IN5 or time > ⟨0.3..0.9⟩" }}, {{ set = {{ "c.IN2" = 1 }} }}]

{table("script", "end", at="⟨700..1400⟩ ms")}
steps = [{{ stop = "it is enough" }}, {{ note = "after the end" }}]
""",
        MOVES
        + """
{ press = "⟨left|right⟩_b", for = "⟨5..120⟩ ms" }
{ press = "⟨left|right⟩_b" }
{ release = "⟨left|right⟩_b" }
{ move = "c.M⟨#1..2⟩", ⟨to|by⟩ = ⟨-20..20⟩, within = "⟨50..400⟩ ms" }
{ wait_for = "c.M⟨#1..2⟩" }
{ until = "left_x.position % ⟨3..9⟩ < ⟨1..3⟩", within = "⟨50..300⟩ ms" }
{ expect = "left_x.position == right_x.position" }
""",
        {
            "part.toml": """
[parameters]
drive = {}
length = 30.0
input = "IN4"

[[axis]]
name = "x"
drive = "{drive}"
travel = [-10, "{length}"]
[[axis.switch]]
above = 5
to = "c.{input}"
join = "parallel"

[[button]]
name = "b"
to = "c.{input}"
join = "parallel"
"""
        },
    ),
}
