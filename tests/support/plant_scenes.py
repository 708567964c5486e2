"""Scenes of lines with controllers on them, and of what a description has for other programs."""

from __future__ import annotations

from scenes import INVERTED, QUICK, SOME_PITCH, Scene, axis, controller, switch, table, wire

CHIP = "[\n@1\nF⟨640|1280|6400⟩\nR\nW⟨#1..90⟩\nB⟨128|640|3200⟩\nR\n+2\nJ1\n.\n]\n"

PLANT_SCENES: dict[str, Scene] = {
    "lines": Scene(
        f"""
{table("line", "bus")}
?baud = ⟨9600|19200|115200⟩
?timing = "⟨real|strict⟩"
?gap = "⟨2..9⟩ ms"
{table("line", "two", timing="⟨real|strict⟩")}
{controller("c", 'line = "bus"', "unit = ⟨#2..9⟩", '?firmware = "⟨1.40|1.23⟩"', M1=QUICK)}
{controller("d", 'line = "⟨bus|two⟩"', "unit = ⟨#10..19⟩")}
{controller("e", 'line = "two"', "unit = ⟨#20..29⟩")}

{wire("c.OUT1", "d.IN1")}

! kind = "⟨crc|late|wrong-unit|echo⟩", line = "bus", link = "script", every = ⟨#2..4⟩
! kind = "⟨delay|no-answer⟩", line = "two", link = "script", nth = ⟨#1..6⟩
! kind = "no-answer", line = "bus", lost = "request", link = "script", nth = ⟨#1..6⟩
! kind = "⟨flip|drop|insert|gap⟩", line = "bus", link = "script", direction = "⟨in|out⟩", probability = 0.02
! kind = "⟨split|noise⟩", line = "two", link = "script", length = ⟨#1..3⟩, every = ⟨#2..3⟩
! kind = "exception", link = "script", line = "bus", function = ⟨3|5|6|16⟩, code = ⟨#1..9⟩, count = ⟨#1..3⟩
! kind = "busy", link = "script", line = "two", address = "⟨6000|100-12000⟩", probability = 0.4
* c.M1_ACC > ⟨3000..9000⟩ or c.USER_REGISTER[6]:real ⟨>|!=⟩ ⟨1..9⟩
* bus.idle and two.idle
""",
        """
{ write = { "⟨c|d|e⟩.OUT⟨#1..3⟩" = ⟨#0..1⟩ } }
{ write = { "⟨c|d|e⟩.OUT⟨#1..3⟩" = ⟨#0..1⟩, "⟨c|d|e⟩.M1_EN" = 1 } }
{ write = { "c.M1_ACC" = ⟨3000..9000⟩, "c.USER_REGISTER[5]" = ⟨#1..99⟩ } }
{ write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = ⟨100..900⟩ } }
{ move = "⟨c|d⟩.M1", to = ⟨100..900⟩, within = "⟨100..300⟩ ms" }
{ until = "idle", within = "⟨20..200⟩ ms" }
{ power_cycle = "⟨d|e⟩" }
@ bus 0⟨#2..9⟩03272400⟨#10..40⟩
@ two ⟨14|15|16⟩0300640002
@ ⟨bus|two⟩ ff000102
@ ⟨bus|two⟩ leave
@ ⟨bus|two⟩ tcp 0⟨#2..9⟩03272400⟨#10..40⟩
@ bus tcp ⟨00|02|04|14⟩06c35500⟨#10..40⟩
""",
    ),
    "chips": Scene(
        f"""
{table("line", "chips", kind="m1486")}
?baud = ⟨1200|4800⟩
?timing = "real"
{table("m1486", "c", line="chips")}
address = 3
?variant = "⟨A|C|E1⟩"
?interface = "⟨dual|two⟩"
?statement_time = "⟨0.5..3.0⟩ ms"
{table("m1486", "d", line="chips", address="A")}
?program = "p.m1486"

{axis("x", "c.M1", SOME_PITCH, "?pulses_per_rev = 12800", INVERTED)}
{switch("axis", "d.B2", "above = ⟨1..5⟩", '?bounce = "⟨1..5⟩ ms"')}
{switch("axis", "c.B4", "below = ⟨-9..-1⟩")}

{axis("y", "d.M1", 'kind = "rotary"')}
{switch("axis", "d.B5", "position = ⟨20..90⟩", "width = ⟨5..20⟩")}

{wire("d.B3", "c.B3")}
?delay = "⟨1..9⟩ ms"

! kind = "stall", machine = "c", at_s = ⟨0.1..0.9⟩, for_s = ⟨0.02..0.3⟩
! kind = "⟨flip|drop|insert⟩", line = "chips", link = "script", direction = "⟨in|out⟩", probability = 0.02
! kind = "stuck", machine = "d", pin = "B2", value = ⟨#0..1⟩, from_s = ⟨0.1..0.6⟩, until_s = ⟨0.7..1.2⟩
! kind = "bounce", machine = "d", pin = "B5", bounces = ⟨#1..4⟩, for_ms = ⟨2.0..9.0⟩
! kind = "supply-drop", machine = "⟨c|d⟩", at_s = ⟨0.3..0.9⟩, for_s = ⟨0.02..0.3⟩
* c.position ⟨>|<⟩ ⟨#-3000..9000⟩ and not d.busy
* x.position > ⟨0..9⟩ or c.counter > ⟨#0..300⟩
""",
        """
+ { send = "chips", text = "x3\\ra⟨#2000..9000⟩\\rv⟨#2000..9000⟩\\rf⟨#3000..12800⟩\\rr\\r" }
{ send = "chips", text = "x3\\r⟨f|b⟩⟨#300..12800⟩\\rr\\r" }
{ send = "chips", text = "x⟨3|a|g⟩\\ru⟨#14..21⟩\\r" }
{ send = "chips", text = "xa\\rf⟨#300..9000⟩\\rr\\r" }
{ send = "chips", text = "xa\\r⟨+|-⟩3\\r" }
{ move = "⟨c|d⟩.M1", by = ⟨#-3000..3000⟩, within = "⟨100..300⟩ ms" }
{ home = "c.M1", seek = "⟨-|+⟩B4", within = "⟨100..300⟩ ms" }
{ wait_for = "⟨c|d⟩.M1", within = "⟨100..300⟩ ms" }
{ set = { "c.B1" = ⟨#0..1⟩ } }
@ chips ⟨78330d|78610d|7533320d⟩7531⟨34|38⟩0d
@ chips ⟨78330d|78670d⟩
@ chips leave
{ until = "not c.moving", within = "⟨20..200⟩ ms" }
{ power_cycle = "d" }
""",
        {"p.m1486": CHIP},
    ),
    "plants": Scene(
        f"""
{table("line", "bus")}
?tcp = "127.0.0.1:⟨#5000..5099⟩"
?rtu_tcp = "127.0.0.1:⟨#5100..5199⟩"
?pty = "/tmp/⟨one|two⟩"
?tls_tcp = "127.0.0.1:8802"; certificate = "c.pem"; key = "k.pem"; trusted = "t"
{table("line", "chips", kind="m1486")}
?tcp = "127.0.0.1:⟨#5200..5299⟩"
?rfc2217 = "127.0.0.1:⟨#5300..5399⟩"
{controller("c", 'line = "bus"', "unit = 3", "?lenient = true", '?vision = "127.0.0.1:⟨#5400..5499⟩"', "?trigger_keeps = true")}
{table("m1486", "k", line="chips")}
?address = ⟨#1..9⟩

{axis("x", "c.M1")}

?[gateway.opcua]
listen = "127.0.0.1:⟨#4840..4849⟩"
?interval = "⟨20..90⟩ ms"
?registers = ["c.USER_REGISTER[⟨#1..9⟩]", "c.hr:⟨#1..9⟩"]
?security = "⟨sign|encrypt⟩"; certificate = "c.pem"; key = "k.pem"
?trusted = "t"

?[gateway.mqtt]
?broker = "127.0.0.1:⟨#1883..1889⟩"
?⟨topic = "a/b"|topic = "hall"|sparkplug = {{ group = "g", node = "n" }}; store = 90⟩
?interval = "⟨20..90⟩ ms"
?keep_alive = "⟨#5..60⟩ s"
?user = "me"; password_variable = "SECRET"
?tls = true; ca = "ca.pem"
?role = "⟨viewer|operator⟩"
?registers = ["c.USER_REGISTER[⟨#1..9⟩]"]

?[gateway.epics]
listen = "127.0.0.1:⟨#5064..5069⟩"
?prefix = "⟨A:|b_⟩"
?beacons = "127.0.0.1:⟨#5070..5079⟩"
?pva = "127.0.0.1:⟨#5080..5089⟩"
?interval = "⟨20..90⟩ ms"
?role = "⟨viewer|operator⟩"

?[gateway.modbus]
listen = "127.0.0.1:⟨#5500..5599⟩"
?units = {{ c = ⟨#20..29⟩ }}
?role = "⟨viewer|operator⟩"

?[history]
database = "sqlite:///h.db"
?interval = "⟨20..90⟩ ms"
?registers = ["c.USER_REGISTER[⟨#1..9⟩]"]
?dead_band = ⟨0.1..2.0⟩
?keep_days = ⟨#1..90⟩
?spool = "s"

[[drawing]]
of = "⟨x|tool path⟩"
at = [⟨#1..900⟩, ⟨#1..900⟩]

! kind = "⟨crc|echo|late|drop|split⟩", line = "bus", every = ⟨#2..3⟩
! kind = "⟨no-answer|busy⟩", line = "bus", unit = 3
! kind = "noise", line = "chips", link = "⟨tcp|tcp-1⟩", every = ⟨#2..3⟩
* bus.idle and not chips.idle
""",
        """
{ write = { "c.OUT⟨#1..3⟩" = ⟨#0..1⟩ } }
{ write = { "c.M1_EN" = 1, "c.M1_POS_ABS" = ⟨100..900⟩ } }
{ until = "idle", within = "⟨20..200⟩ ms" }
@ bus ff000102
@ see c ⟨#1..3⟩ ⟨1..9⟩ ⟨1..9⟩ ⟨1..9⟩
""",
    ),
}
