"""Texts of every language: right, wrong and half typed."""

from __future__ import annotations

from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"

PROGRAM = """\
// żółw 😀
#speed -40
#gripper OUT1
#ready IN5

M1 = ON
M2 = ON
MAIN:
WAIT ready = ON
JUMP PICK
count = count + 1
$I10 = count
JUMP MAIN

PICK:
HOME M1 speed
WAITPOS
MOVEPTP @above
IF ready = ON
    gripper = ON
ENDIF
PREL M1 12,5
DELAY 0.2
SET x = sin(count)
$R2 = x
RETURN

INT_IN1:
CFGINT_IN1 = INT_OFF
RETURN
"""
TABLE = "above;40,5;60;x;x\nunused;1;2;x;x\n"
CONFIG = "[Axis0]\nUnit=3\nGear=100\nAcc=500\nDec=500\nVel=50\nHomeMode=1\nInKL=0\n[IN0]\nInt=1\n"
BROKEN = "#speed\nMAIN\nIF ready = ON\nMOVEPTP @\nHOME M1\nJUMP \nSET \nx == 3\nPABS M1 speed speed\nELSE\nsin(\n@above\n$\n"
CHIP = "[           ; store\nS200\nV1000\nA5000\nF12800\n@5\nI2H7\nT3\nR\n'6\nJ5\n@6\nT4\n.\n@7\nW250\n]\n"
BROKEN_CHIP = "[\n@\nJ\nI2\nF1 28\nF1.5\nFR\nT99\nC88\n120\nX\nkomm\n? \n'9\n.\n"
WORLD = """\
[world]
name = "cell"

[[line]]
name = "bus"

[[mic488]]
name = "table"
line = "bus"

[mic488.M1]
unit = "mm"

[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0

[[axis.switch]]
below = 0.0
to = "table.IN1"

[[script]]
name = "operator"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { until = "x.position > 10", within = "1 s" },
]
"""
