"""The fields of a motor record that are served, with the types and states of the record of epics-modules/motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from steptwin.gateways.epics.records import AlarmSeverity, FieldQuantity, FieldRow, FieldType, FieldValue

STOP, PAUSE, MOVE, GO = range(4)
"""States of SPMG."""
STATUS_ON = 1
"""A state of STUP."""
USE, SET = range(2)
VARIABLE, FROZEN = range(2)


def _double(name: str, meaning: str, quantity: FieldQuantity, *, put: bool = False) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.DOUBLE, is_writable=put, quantity=quantity)


def _short(name: str, meaning: str, *, put: bool = False) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.SHORT, is_writable=put)


def _long(name: str, meaning: str, *, put: bool = False) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.LONG, is_writable=put)


def _text(name: str, meaning: str) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.STRING)


def _states(name: str, meaning: str, *states: str, put: bool = False) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.STATES, is_writable=put, states=states)


def _rows() -> Iterator[FieldRow]:
    yield _double("VAL", "Wanted position; a put moves.", FieldQuantity.USER, put=True)
    yield _double("DVAL", "The same in dial coordinates, which are those of the controller.", FieldQuantity.DIAL, put=True)
    yield _long("RVAL", "The same in steps.", put=True)
    yield _double("RLV", "Wanted distance; a put moves.", FieldQuantity.LENGTH, put=True)
    yield _double("RBV", "Position.", FieldQuantity.USER)
    yield _double("DRBV", "Position, dial.", FieldQuantity.DIAL)
    yield _long("RRBV", "Position in steps.")
    yield _double("DIFF", "DVAL - DRBV.", FieldQuantity.LENGTH)
    yield _short("DMOV", "1 when the whole motion is over.")
    yield _short("MOVN", "1 while the motor moves.")
    yield _long("MIP", "What the record does, as bits of motorRecord.cc; 0: nothing.")
    yield _short("TDIR", "1 where the last motion went in the positive direction of the controller.")
    yield _short("STOP", "1 stops; it is 0 again then.", put=True)
    yield _states("SPMG", "Whether motions may be made.", "Stop", "Pause", "Move", "Go", put=True)
    yield _double("TWV", "Distance of a tweak.", FieldQuantity.LENGTH, put=True)
    yield _short("TWF", "1 moves by TWV.", put=True)
    yield _short("TWR", "1 moves by -TWV.", put=True)
    yield _short("JOGF", "1 jogs in the positive direction until 0.", put=True)
    yield _short("JOGR", "1 jogs in the negative direction until 0.", put=True)
    yield _short("HOMF", "1 homes in the positive direction.", put=True)
    yield _short("HOMR", "1 homes in the negative direction.", put=True)
    yield _short("ATHM", "1 where it was homed, until it moves.")
    yield _double("HLM", "Highest position.", FieldQuantity.USER, put=True)
    yield _double("LLM", "Lowest position.", FieldQuantity.USER, put=True)
    yield _double("DHLM", "Highest position, dial; with DLLM 0 there are no limits.", FieldQuantity.DIAL, put=True)
    yield _double("DLLM", "Lowest position, dial.", FieldQuantity.DIAL, put=True)
    yield _short("LVIO", "1 after a motion was refused because of limits.")
    yield _short("HLS", "1 at the limit switch of the positive direction.")
    yield _short("LLS", "1 at that of the negative direction.")
    yield _short("RHLS", "The same of the controller.")
    yield _short("RLLS", "The same of the controller.")
    yield _double("VELO", "Velocity of moves; 0 where the controller does not tell.", FieldQuantity.VELOCITY, put=True)
    yield _double("VMAX", "Highest velocity; 0 where it is not known.", FieldQuantity.VELOCITY)
    yield _double("VBAS", "Base velocity.", FieldQuantity.VELOCITY)
    yield _double("ACCL", "Time until VELO is reached, s.", FieldQuantity.TIME, put=True)
    yield _double("JVEL", "Velocity of jogs.", FieldQuantity.VELOCITY, put=True)
    yield _double("JAR", "Acceleration of jogs, that of moves; 0 where the controller does not tell.", FieldQuantity.ACCELERATION)
    yield _double("HVEL", "Velocity of homing.", FieldQuantity.VELOCITY, put=True)
    yield _double("OFF", "RBV - DRBV in the direction of DIR.", FieldQuantity.LENGTH, put=True)
    yield _states("DIR", "Whether positions go as those of the controller.", "Pos", "Neg", put=True)
    yield _states("SET", "Whether puts to VAL change OFF instead of moving.", "Use", "Set", put=True)
    yield _states("FOFF", "Whether they may: Frozen refuses them.", "Variable", "Frozen", put=True)
    yield _long("MSTA", "Status bits.")
    yield _short("MISS", "1 after a move that did not arrive.")
    yield _states("CNEN", "Whether the drive is on.", "Disable", "Enable", put=True)
    yield _double("MRES", "A step.", FieldQuantity.LENGTH)
    yield _double("ERES", "As MRES.", FieldQuantity.LENGTH)
    yield _double("UREV", "A revolution of 200 steps; no controller tells another one.", FieldQuantity.LENGTH)
    yield _long("SREV", "Steps of this revolution.")
    yield _double("RDBD", "How far from VAL a move may end.", FieldQuantity.LENGTH, put=True)
    yield _short("PREC", "Decimals that are shown.", put=True)
    yield _text("EGU", "Unit.")
    yield _text("DESC", "Controller and axis.")
    yield _text("NAME", "Name of the record.")
    yield _text("RTYP", "motor")
    yield _text("DTYP", "steptwin")
    yield _text("OUT", "Controller and axis.")
    yield _short("UDF", "1 until a position is known.")
    yield _states("STAT", "Kind of alarm.", "NO_ALARM", "STATE", "COMM", "UDF", "HIGH", "LOW")
    yield _states("SEVR", "AlarmSeverity of the alarm.", *(one.name for one in AlarmSeverity))


def _requests() -> Iterator[FieldRow]:
    """Puts that move nothing."""
    yield _states("STUP", "ON reads the controller; it is OFF again then.", "OFF", "ON", "BUSY", put=True)
    yield _short("PROC", "Any value reads the controller.", put=True)
    yield _short("SYNC", "1 sets VAL to RBV; it is 0 again then.", put=True)


def _constants() -> Iterator[FieldRow]:
    """How the record works, for clients that ask."""
    yield _states("NTM", "Whether a put during a motion gives it a new target.", "NO", "YES")
    yield _short("RTRY", "Retries: none.")
    yield _short("RCNT", "The number of this retry.")
    yield _double("BDST", "Backlash that is taken out: none.", FieldQuantity.LENGTH)
    yield _double("FRAC", "Part of the way that a move is sent to the controller for.", FieldQuantity.PURE)
    yield _double("DLY", "Pause between the end of a motion and DMOV, s.", FieldQuantity.TIME)
    yield _states("UEIP", "Whether RBV is that of an encoder: it is what the controller counts.", "No", "Yes")
    yield _short("DISP", "1 refuses puts of all clients: never.")
    yield _states("SCAN", "When it is processed: by puts and by what the controller does.", "Passive")


MOTOR_FIELDS: Mapping[str, FieldRow] = {row.name: row for row in (*_rows(), *_requests(), *_constants())}


def first_values() -> dict[str, FieldValue]:
    found: dict[str, FieldValue] = {
        row.name: "" if row.type is FieldType.STRING else 0.0 if row.type is FieldType.DOUBLE else 0
        for row in MOTOR_FIELDS.values()
    }
    return found | {
        "DMOV": 1,
        "SPMG": GO,
        "RTYP": "motor",
        "DTYP": "steptwin",
        "SREV": 200,
        "TWV": 1.0,
        "PREC": 3,
        "NTM": 1,
        "FRAC": 1.0,
        "UDF": 1,
    }


class StatusBit:
    """Bits of MSTA."""

    DIRECTION = 1 << 0
    DONE = 1 << 1
    PLUS_LIMIT = 1 << 2
    POSITION = 1 << 5
    """The drive is on (EA_POSITION), which CNEN shows."""
    PRESENT = 1 << 8
    """An encoder."""
    PROBLEM = 1 << 9
    MOVING = 1 << 10
    GAIN_SUPPORT = 1 << 11
    """CNEN switches the drive."""
    COMM_ERROR = 1 << 12
    MINUS_LIMIT = 1 << 13
    HOMED = 1 << 14


class ProgressBit:
    """Bits of MIP."""

    JOG_FORWARD = 0x0001
    JOG_REVERSE = 0x0002
    HOME_FORWARD = 0x0008
    HOME_REVERSE = 0x0010
    MOVE = 0x0020
    STOP = 0x0200
    EXTERNAL = 0x8000
    """Somebody else has begun the motion."""


BUTTON_BITS = {
    "JOGF": ProgressBit.JOG_FORWARD,
    "JOGR": ProgressBit.JOG_REVERSE,
    "HOMF": ProgressBit.HOME_FORWARD,
    "HOMR": ProgressBit.HOME_REVERSE,
}
