"""The registers a WBC program sees, as a table. Checker, controller, image, hover texts and reference are projections of it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import reduce

from steptwin.messages import Message
from steptwin.wbc.dialect import Dialect

OR = Message("wbc.or", "{one} or {other}")
GREATER_THAN_0 = Message("wbc.greater-than-0", "greater than 0")

REAL_MAX = 3.4028234663852886e38
"""Largest REAL (IEEE-754 single)."""


@dataclass(frozen=True, slots=True)
class Domain:
    """The numbers a register can hold. ``choices`` are its only values when they do not fill ``low``…``high``."""

    low: float
    high: float
    whole: bool = False
    positive: bool = False
    choices: tuple[float, ...] = ()

    def has(self, value: float) -> bool:
        if self.choices:
            return value in self.choices
        return self.low <= value <= self.high and (value > 0 or not self.positive)

    @property
    def text(self) -> str:
        if self.choices:
            return reduce(lambda one, other: OR(one=one, other=other), (f"{choice:g}" for choice in self.choices))
        return GREATER_THAN_0() if self.positive else f"{self.low:.10g}…{self.high:.10g}"

    def __str__(self) -> str:
        return self.text


REAL = Domain(-REAL_MAX, REAL_MAX)
POSITIVE = Domain(0, REAL_MAX, positive=True)
BIT = Domain(0, 1, whole=True)
ON_OFF = Domain(0, 1, whole=True, choices=(0, 1))
INT = Domain(-32768, 32767, whole=True)
DINT = Domain(-(2**31), 2**31 - 1, whole=True)
BITS16 = Domain(0, 65535, whole=True)
TIMER = Domain(0, 999_999, whole=True)
STATUS = Domain(0, 10, whole=True)
EDGE = Domain(0, 3, whole=True, choices=(0, 1, 2, 3))
SWITCH = Domain(0, 4, whole=True, choices=(0, 4))


@dataclass(frozen=True, slots=True)
class RegisterRow:
    """One register or family of registers.

    ``last`` is the highest number of a family that counts from 1, 0 for a single register. ``reads`` and ``writes`` are the
    values it gives and takes; ``writes`` None means read-only. ``saturates``: a number outside ``writes`` becomes the nearest
    inside (WBC-14). ``words`` is the size of a user register, which counts from 0 to the end of the user memory.
    """

    name: str
    last: int
    reads: Domain
    writes: Domain | None
    meaning: str
    unit: str = ""
    since: str | None = None
    saturates: bool = False
    words: int = 0

    @property
    def key(self) -> str:
        return self.name.upper()

    @property
    def access(self) -> str:
        return "R" if self.writes is None else "RW"

    def numbers(self, dialect: Dialect) -> range:
        """The permitted numbers; empty for a single register."""
        if self.words:
            return range(0, dialect.user_registers - self.words + 1, self.words)
        return range(1, self.last + 1)

    def spelling(self, dialect: Dialect) -> str:
        """All its names: ``OUT1…OUT8``."""
        numbers = self.numbers(dialect)
        return f"{self.name}{numbers[0]}…{self.name}{numbers[-1]}" if numbers else self.name


def _axis_parameter(name: str, meaning: str, unit: str, writes: Domain = REAL) -> RegisterRow:
    return RegisterRow(name, 4, REAL, writes, meaning, unit)


REGISTERS = (
    RegisterRow("OUT", 8, BIT, REAL, "output; any number above 0 switches it on"),
    RegisterRow("OUTPUTS", 0, BITS16, BITS16, "all outputs as bits, OUT1 is bit 0", saturates=True),
    RegisterRow("IN", 20, BIT, None, "input, 1 when active"),
    RegisterRow("INPUTS", 0, BITS16, None, "the first 16 inputs as bits, IN1 is bit 0"),
    RegisterRow("AIN", 2, REAL, None, "analog input, scaled by LoVal…HiVal of the configuration"),
    RegisterRow("M", 4, BIT, ON_OFF, "written: enables (1) or disables (0) the drive; read: 1 in motion, 0 at rest"),
    RegisterRow("StatM", 4, STATUS, None, "status of the drive, as Mx_STATUS"),
    RegisterRow("VactM", 4, REAL, None, "actual velocity", "u/s"),
    _axis_parameter("PosM", "actual position; writing changes the counter, nothing moves", "u"),
    _axis_parameter("AccM", "acceleration", "u/s²", POSITIVE),
    _axis_parameter("DecM", "deceleration of position moves", "u/s²", POSITIVE),
    _axis_parameter("VmaxM", "velocity of position moves", "u/s", POSITIVE),
    _axis_parameter("LimLM", "soft limit towards negative positions", "u"),
    _axis_parameter("LimRM", "soft limit towards positive positions", "u"),
    RegisterRow("ENC", 4, DINT, DINT, "encoder counter", "pulses", saturates=True),
    RegisterRow("XENC", 4, REAL, None, "encoder counter converted into drive position", "u"),
    RegisterRow("TIMA", 16, TIMER, TIMER, "timer counting up every 10 ms, stops at 999999", "10 ms"),
    RegisterRow("TIMB", 16, TIMER, TIMER, "timer counting up every second, stops at 999999", "s"),
    RegisterRow("CFGINT_IN", 8, EDGE, EDGE, "interrupt of an input: 0 off, 1 rising, 2 falling, 3 both edges"),
    RegisterRow("CFGINT_MODBUS", 0, SWITCH, SWITCH, "interrupt on a write to a user register over Modbus: 0 off, 4 on"),
    RegisterRow("CFGINT_TICK", 0, SWITCH, SWITCH, "interrupt every 10 ms: 0 off, 4 on"),
    RegisterRow("CFGINT_TICK100", 0, SWITCH, SWITCH, "interrupt every 100 ms: 0 off, 4 on", since="1.70"),
    RegisterRow("CFGINT_TICK1000", 0, SWITCH, SWITCH, "interrupt every 1000 ms: 0 off, 4 on", since="1.70"),
    RegisterRow("CFGINT_M", 4, SWITCH, SWITCH, "interrupt on a change of the drive's state: 0 off, 4 on", since="1.70"),
    RegisterRow("PTPM", 4, REAL, REAL, "parameter p1…p4 of row 0 of the position table", "u"),
    RegisterRow("CircX", 0, REAL, REAL, "p1 of row 0 of the position table: centre of a circle, X", "u"),
    RegisterRow("CircY", 0, REAL, REAL, "p2 of row 0 of the position table: centre of a circle, Y", "u"),
    RegisterRow("CircR", 0, REAL, REAL, "p3 of row 0 of the position table: radius of a circle", "u"),
    RegisterRow("CircA", 0, REAL, REAL, "p4 of row 0 of the position table: angle of a circle, positive clockwise", "°"),
    RegisterRow("LinX", 0, REAL, REAL, "p1 of row 0 of the position table: end of a line, X", "u"),
    RegisterRow("LinY", 0, REAL, REAL, "p2 of row 0 of the position table: end of a line, Y", "u"),
    RegisterRow("LinVel", 0, REAL, REAL, "p3 of row 0 of the position table: path velocity of a line", "u/s"),
    RegisterRow("LinAcc", 0, REAL, POSITIVE, "path acceleration of lines; as long as it is not set, that of M1", "u/s²"),
    RegisterRow("VisionNew", 0, REAL, REAL, "1 when a new record of the vision system has come; the program sets it to 0"),
    RegisterRow("VisionNo", 0, REAL, REAL, "N of the last record of the vision system"),
    RegisterRow("VisionX", 0, REAL, REAL, "X of the last record of the vision system"),
    RegisterRow("VisionY", 0, REAL, REAL, "Y of the last record of the vision system"),
    RegisterRow("VisionA", 0, REAL, REAL, "A of the last record of the vision system"),
    RegisterRow("STATUS", 0, Domain(0, 3, whole=True), None, "M_STATUS of the controller; 0 before firmware 1.70"),
    RegisterRow("$I", 0, INT, INT, "user register as a signed 16-bit number", saturates=True, words=1),
    RegisterRow("$D", 0, DINT, DINT, "two user registers as a signed 32-bit number, even address", saturates=True, words=2),
    RegisterRow("$R", 0, REAL, REAL, "two user registers as a REAL number, even address", words=2),
)

ROWS = {row.key: row for row in REGISTERS}
if len(ROWS) != len(REGISTERS):
    raise ValueError("a register is listed twice")

ROW_0 = frozenset({"PTPM", "CIRCX", "CIRCY", "CIRCR", "CIRCA", "LINX", "LINY", "LINVEL"})
"""Families that are the parameters of row 0 of the position table."""

_NUMBERED = re.compile(r"(\$?[A-Z_]+?)([0-9]{1,9})$")


def parts(key: str) -> tuple[RegisterRow, int] | None:
    """Family and number of a register name in upper case, whether or not a register of that number exists."""
    row = ROWS.get(key)
    if row is not None and not row.last and not row.words:
        return row, 0
    match = _NUMBERED.match(key)
    if match is None or len(match[2]) > 9:
        return None
    row = ROWS.get(match[1])
    if row is None or not (row.last or row.words):
        return None
    return row, int(match[2])


PREDEFINED: dict[str, float] = {
    "ON": 1,
    "OFF": 0,
    "OPEN": 1,
    "CLOSE": 0,
    "RIS": 1,
    "FALL": 2,
    "RIS_FALL": 3,
    "RISFALL": 3,
    "HIGH": 4,
    "INT_HIGH": 4,
    "INT_OFF": 0,
    "M_OFF": 0,
    "M_ON": 1,
    "M_SPEED": 2,
    "M_POS_SEARCH": 3,
    "M_POS_OK": 4,
    "M_POS_ERROR": 5,
    "M_HOMING": 6,
    "M_POS_HOMING": 6,
    "M_FAULT": 7,
    "M_POS_CORRECTION": 8,
    "M_POS_LIML": 9,
    "M_POS_LIMR": 10,
}
"""Names that stand for numbers everywhere."""

VALUE_NAMES: dict[Domain, tuple[str, ...]] = {
    BIT: ("ON", "OFF"),
    ON_OFF: ("ON", "OFF"),
    STATUS: tuple(name for name in PREDEFINED if name.startswith("M_") and name != "M_POS_HOMING"),
    EDGE: ("INT_OFF", "RIS", "FALL", "RIS_FALL"),
    SWITCH: ("INT_OFF", "INT_HIGH"),
}
"""The predefined names for the values of registers, by what they hold."""
