"""Worlds in which things have causes of each kind."""

PROGRAM = """\
#lamp OUT1
#start IN1
WAIT start = ON
lamp = ON
WAIT IN2 = ON
PULSE(OUT2, 0,5)
WAIT IN3 = ON
"""

WAITS = """
[world]
name = "waits"
[[mic488]]
name = "cell"
program = "p.prg"
start = true
[[button]]
name = "go"
to = "cell.IN1"
[[relay]]
name = "guard"
coil = "cell.OUT1"
pull_in = "10 ms"
[[gate]]
name = "both"
kind = "and"
inputs = ["guard.no", "cell.OUT3"]
[[wire]]
from = "both.out"
to = "cell.IN2"
[[script]]
name = "operator"
steps = [{ wait = "1 s" }, { press = "go" }]
"""

LINE = """
[world]
name = "line"
[[line]]
name = "bus"
kind = "modbus"
TIMING
[[mic488]]
name = "table"
line = "bus"
unit = 1
[[mic488]]
name = "other"
line = "bus"
unit = 2
[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0
travel = [0.0, 100.0]
[[axis.switch]]
to = "other.IN3"
above = 20.0
"""

CHIP = """
[world]
name = "chip"
[[m1486]]
name = "chip"
program = "p.m1486"
"""

CHIP_PROGRAM = "[\nT1\nW100\nZ2\nF6400\nR\nC1\n]\n"
