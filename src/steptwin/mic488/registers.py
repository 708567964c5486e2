"""The register table of the MIC488: coils, inputs and holding registers of firmware 1.23, 1.40 and 1.70.

Source: tables 3.1 and 3.2 of the register manuals 1.23 and 1.70. Everything that talks about registers — decoding, drivers,
panels, reference pages — is a projection of `ROWS`. A new register is a new row here and its entry in
`steptwin.mic488.behaviour`.
Control registers are given relative to the firmware's control base, everything else by its absolute address.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from types import MappingProxyType

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488.ranges import POSITIVE, ValueRange
from steptwin.mic488.registermap import (
    DataType,
    Firmware,
    MapRow,
    Per,
    QuantityKind,
    RegisterMap,
    Space,
    Type,
    WriteEffect,
)
from steptwin.mic488.status import AxisStatus, ControllerStatus

AXES = 4
OUTPUTS = 8
INPUTS = 20

MOTION_REGISTERS = ("VEL_ABS", "VEL_REL", "POS_ABS", "POS_REL")
"""Registers that move an axis; each of an axis, with a trigger register of the controller (MIC-16)."""

# MIC-28: 1.40 has the banks of 1.23 (the manual of 1.70 narrows them to 0…5); position banks number as program banks.
FIRMWARES: Mapping[str, Firmware] = MappingProxyType(
    {
        firmware.name: firmware
        for firmware in (
            Firmware("1.23", "1.23", control_base=1000, user_registers=500, stored_user_registers=None, banks=8),
            Firmware("1.40", "1.70", control_base=10000, user_registers=2000, stored_user_registers=None, banks=8),
            Firmware("1.70", "1.70", control_base=10000, user_registers=2000, stored_user_registers=range(1000, 2000), banks=6),
        )
    }
)
DEFAULT_FIRMWARE = "1.70"

AXIS_MASK = 0x000F
"""Bits of a mask register that mean something: bit 0 = M1 … bit 3 = M4."""


AXIS_STATUS_TEXTS: Mapping[int, str] = MappingProxyType(
    {
        AxisStatus.OFF: "off",
        AxisStatus.ON: "on at rest",
        AxisStatus.VELOCITY: "velocity mode",
        AxisStatus.POSITION: "moving to position",
        AxisStatus.REACHED: "position reached",
        AxisStatus.ERROR: "position error",
        AxisStatus.HOMING: "homing",
        AxisStatus.CORRECTION: "position correction",
        AxisStatus.LIMIT_L: "stopped at limit L",
        AxisStatus.LIMIT_R: "stopped at limit R",
    }
)
CONTROLLER_STATUS_TEXTS: Mapping[int, str] = MappingProxyType(
    {
        ControllerStatus.OK: "ok",
        ControllerStatus.POSITION_ERROR: "drive position error",
        ControllerStatus.PROGRAM_ERROR: "program error",
        ControllerStatus.MASTER_ERROR: "Modbus master communication error",
    }
)


def axes_of_mask(mask: int) -> tuple[int, ...]:
    """Axes 1–4 chosen by a mask register; bits above 3 are ignored (MIC-25)."""
    return tuple(axis for axis in range(1, AXES + 1) if mask & AXIS_MASK & 1 << axis - 1)


def _sections(table: str, manual_1_23: str = "", manual_1_70: str = "") -> Mapping[str, str]:
    """Where the manuals speak of a row: the table and the text (chapter 4 of 1.70 has one section more)."""
    later = manual_1_70 or manual_1_23
    return {"1.23": f"{table}, {manual_1_23}" if manual_1_23 else table, "1.70": f"{table}, {later}" if later else table}


# All banks of the generation.
_BANKS = {name: ValueRange(0, firmware.banks - 1) for name, firmware in FIRMWARES.items()}

_bit = partial(MapRow, space=Space.COIL, type=Type.BIT, kind=QuantityKind.SWITCH)
_axis_coil = partial(_bit, reads=(), writes=(5,), per=Per.AXIS, copies=AXES)
_word = partial(MapRow, space=Space.HOLDING, type=Type.WORD, control=True)
_setting = partial(_word, reads=(3,), writes=(6,), effect=WriteEffect.STORE)
_trigger = partial(
    _word, reads=(3,), writes=(6,), kind=QuantityKind.MASK, effect=WriteEffect.ADD, sections=_sections("3.2", "4.2, 4.5")
)  # MIC-16: reads back as written
_drives = partial(_word, reads=(), writes=(6,), kind=QuantityKind.MASK, effect=WriteEffect.ACT, sections=_sections("3.2", "4.2"))
_value = partial(MapRow, space=Space.HOLDING, type=Type.VALUE, control=True, per=Per.AXIS, copies=AXES, step=2)
_kept = partial(_value, reads=(3,), writes=(16,), effect=WriteEffect.STORE)
_motion = partial(_value, reads=(), writes=(16,), effect=WriteEffect.MOVE)

ROWS: tuple[MapRow, ...] = (
    # Bits (table 3.1)
    _axis_coil(
        name="M{n}_EN",
        address=2000,
        effect=WriteEffect.STORE,
        sections=_sections("3.1", "4.2"),
        meaning="Enable output of axis M{n}: ON switches the drive on, OFF switches it off.",
    ),
    _axis_coil(
        name="M{n}_STOP",
        address=2004,
        effect=WriteEffect.ACT,
        sections=_sections("3.1", "4.2"),
        meaning="Writing ON stops axis M{n} at once, without ramp.",
    ),
    _axis_coil(
        name="M{n}_JOG_PLUS",
        address=2008,
        step=2,
        effect=WriteEffect.MOVE,
        sections=_sections("3.1", "4.8", "4.9"),
        meaning="While ON, axis M{n} moves in the positive direction at JOG_SPEED.",
    ),
    _axis_coil(
        name="M{n}_JOG_MINUS",
        address=2009,
        step=2,
        effect=WriteEffect.MOVE,
        sections=_sections("3.1", "4.8", "4.9"),
        meaning="While ON, axis M{n} moves in the negative direction at JOG_SPEED.",
    ),
    _bit(
        name="USER_REG_READ",
        address=2100,
        reads=(),
        writes=(5,),
        effect=WriteEffect.ACT,
        firmwares=("1.70",),
        sections=_sections("3.1", "", "4.11"),
        meaning="Writing ON reads user registers 1000–1999 from non-volatile memory.",
    ),
    _bit(
        name="USER_REG_SAVE",
        address=2101,
        reads=(),
        writes=(5,),
        effect=WriteEffect.ACT,
        firmwares=("1.70",),
        sections=_sections("3.1", "", "4.11"),
        meaning="Writing ON saves user registers 1000–1999 to non-volatile memory.",
    ),
    _bit(
        name="USER_REG_ZERO",
        aliases=("USER_REG_RESET",),
        address=2102,
        reads=(),
        writes=(5,),
        effect=WriteEffect.ACT,
        firmwares=("1.70",),
        sections=_sections("3.1", "", "4.11"),
        meaning="Writing ON sets user registers 1000–1999 to 0.",
    ),
    _bit(
        name="OUT{n}",
        address=6000,
        reads=(1,),
        writes=(5,),
        effect=WriteEffect.STORE,
        per=Per.CHANNEL,
        copies=OUTPUTS,
        sections=_sections("3.1"),
        meaning="Output OUT{n}.",
    ),
    _bit(
        name="IN{n}",
        space=Space.INPUT,
        address=5000,
        reads=(2,),
        writes=(),
        effect=WriteEffect.NONE,
        per=Per.CHANNEL,
        copies=INPUTS,
        sections=_sections("3.1"),
        meaning="Input IN{n}.",
    ),
    # User registers (table 3.2)
    MapRow(
        name="USER_REGISTER",
        space=Space.HOLDING,
        address=0,
        type=Type.MEMORY,
        cells=lambda firmware: firmware.user_registers,
        reads=(3,),
        writes=(6, 16),
        kind=QuantityKind.NUMBER,
        effect=WriteEffect.STORE,
        sections=_sections("3.2", "4.10", "4.11"),
        meaning="Memory for the master and the program; DINT and REAL take two registers from an even address.",
    ),
    # Control registers of type WORD (table 3.2)
    _setting(
        name="DATA_TYPE",
        address=0,
        kind=QuantityKind.ENUMERATION,
        permitted=ValueRange(0, 1),
        values={DataType.REAL: "REAL", DataType.DINT: "DINT"},
        sections=_sections("3.2", "4.9", "4.10"),
        meaning="How REAL/DINT registers travel, as REAL in configured units or as DINT in pulses.",
    ),
    _setting(
        name="PROG_BANK_SEL",
        address=1,
        kind=QuantityKind.NUMBER,
        permitted=_BANKS,
        sections=_sections("3.2", "4.1"),
        meaning="Program bank the next start runs.",
    ),
    _setting(
        name="POS_BANK_SEL",
        address=2,
        kind=QuantityKind.NUMBER,
        permitted=_BANKS,
        sections=_sections("3.2", "4.1"),
        meaning="Position bank the next start uses.",
    ),
    _word(
        name="PROGRAM_CTRL",
        address=3,
        reads=(3,),
        writes=(6,),
        kind=QuantityKind.ENUMERATION,
        effect=WriteEffect.ADD,
        permitted=ValueRange(0, 2),
        values={0: "STOP", 1: "START", 2: "PAUSE"},
        sections=_sections("3.2", "4.1"),
        meaning="Stops, starts or pauses the program; reads as the program's state.",
    ),
    _setting(
        name="AXIS_CTR_MODE",
        address=4,
        kind=QuantityKind.ENUMERATION,
        permitted=ValueRange(0, 1),
        values={0: "DIRECT", 1: "TRIGGER"},
        sections=_sections("3.2", "4.5"),
        meaning="Whether a motion register acts when written (DIRECT) or waits for its trigger register (TRIGGER).",
    ),
    _trigger(
        name="AXIS_VEL_ABS_TRIG",
        address=5,
        meaning="In TRIGGER mode starts the chosen axes with their absolute velocities.",
    ),
    _trigger(
        name="AXIS_VEL_REL_TRIG",
        address=6,
        meaning="In TRIGGER mode starts the chosen axes with their relative velocities.",
    ),
    _trigger(
        name="AXIS_POS_ABS_TRIG",
        address=7,
        meaning="In TRIGGER mode starts the chosen axes towards their absolute positions.",
    ),
    _trigger(
        name="AXIS_POS_REL_TRIG",
        address=8,
        meaning="In TRIGGER mode starts the chosen axes by their relative positions.",
    ),
    _word(
        name="M_ALL_STATUS",
        address=9,
        reads=(3,),
        writes=(),
        kind=QuantityKind.NUMBER,
        effect=WriteEffect.NONE,
        firmwares=("1.23", "1.40"),
        sections=_sections("3.2"),
        meaning="Listed but not available in this firmware: reads 0.",
    ),
    _word(
        name="M_STATUS",
        address=9,
        reads=(3,),
        writes=(),
        kind=QuantityKind.ENUMERATION,
        effect=WriteEffect.NONE,
        values=CONTROLLER_STATUS_TEXTS,
        firmwares=("1.70",),
        sections=_sections("3.2", "", "4.7"),
        meaning="Status of the controller.",
    ),
    _word(
        name="M{n}_STATUS",
        address=10,
        reads=(3,),
        writes=(),
        kind=QuantityKind.ENUMERATION,
        effect=WriteEffect.NONE,
        per=Per.AXIS,
        copies=AXES,
        values=AXIS_STATUS_TEXTS,
        sections=_sections("3.2", "4.7", "4.8"),
        meaning="Status of axis M{n}.",
    ),
    _drives(name="M_ENABLE", address=14, meaning="Switches the enable outputs of the chosen axes on."),
    _drives(name="M_DISABLE", address=15, meaning="Switches the enable outputs of the chosen axes off."),
    _drives(name="M_STOP", address=16, meaning="Stops the chosen axes at once, without ramp."),
    # Control registers of type REAL and DINT (table 3.2)
    MapRow(
        name="JOG_SPEED",
        space=Space.HOLDING,
        control=True,
        address=17,
        type=Type.REAL,
        reads=(),
        writes=(6,),
        word_write=True,  # MIC-6
        kind=QuantityKind.VELOCITY,
        effect=WriteEffect.STORE,
        sections=_sections("3.2", "4.8", "4.9"),
        meaning="Velocity of all axes while jogging, always REAL in units; function 06 writes it as a signed 16-bit number.",
    ),
    _kept(
        name="M{n}_POS_ACT",
        address=20,
        kind=QuantityKind.POSITION,
        sections=_sections("3.2", "4.6"),
        meaning="Counted position of axis M{n}; a write overwrites the counter without motion.",
    ),
    _value(
        name="M{n}_VEL_ACT",
        address=28,
        reads=(3,),
        writes=(),
        kind=QuantityKind.VELOCITY,
        effect=WriteEffect.NONE,
        sections=_sections("3.2", "4.6"),
        meaning="Present velocity of axis M{n}.",
    ),
    _kept(
        name="M{n}_ACC",
        address=36,
        kind=QuantityKind.ACCELERATION,
        permitted=POSITIVE,
        sections=_sections("3.2", "4.3"),
        meaning="Acceleration of axis M{n} in position mode; speeding up and slowing down in velocity mode.",
    ),
    _kept(
        name="M{n}_DEC",
        address=44,
        kind=QuantityKind.ACCELERATION,
        permitted=POSITIVE,
        sections=_sections("3.2", "4.3"),
        meaning="Deceleration of axis M{n} in position mode.",  # MIC-29
    ),
    _kept(
        name="M{n}_VMAX",
        address=52,
        kind=QuantityKind.VELOCITY,
        permitted=POSITIVE,
        sections=_sections("3.2", "4.3"),
        meaning="Cruise velocity of axis M{n} in position mode.",
    ),
    _motion(
        name="M{n}_HOME",
        address=60,
        kind=QuantityKind.VELOCITY,
        sections=_sections("3.2", "4.4"),
        meaning="Homes axis M{n} at this velocity at once: negative towards KL, positive towards KR.",
    ),
    _motion(
        name="M{n}_VEL_ABS",
        address=68,
        kind=QuantityKind.VELOCITY,
        sections=_sections("3.2", "4.5"),
        meaning="Moves axis M{n} at this velocity.",
    ),
    _motion(
        name="M{n}_VEL_REL",
        address=76,
        kind=QuantityKind.VELOCITY,
        effect=WriteEffect.ADD,
        sections=_sections("3.2", "4.5"),
        meaning="Moves axis M{n} at its present velocity plus this value.",
    ),
    _motion(
        name="M{n}_POS_ABS",
        address=84,
        kind=QuantityKind.POSITION,
        sections=_sections("3.2", "4.5"),
        meaning="Moves axis M{n} to this position.",
    ),
    _motion(
        name="M{n}_POS_REL",
        address=92,
        kind=QuantityKind.POSITION,
        effect=WriteEffect.ADD,
        sections=_sections("3.2", "4.5"),
        meaning="Moves axis M{n} to its present position plus this value.",
    ),
    _kept(
        name="ENC{n}_IMP",
        address=100,
        type=Type.DINT,
        kind=QuantityKind.ENCODER,
        sections=_sections("3.2"),
        meaning="Counter of encoder {n} in encoder pulses.",
    ),
    _kept(
        name="ENC{n}_XPOS",
        address=108,
        kind=QuantityKind.POSITION,
        sections=_sections("3.2"),
        meaning="Counter of encoder {n} converted into a position of its drive.",
    ),
    _kept(
        name="M{n}_POSLIM_L",
        address=120,
        kind=QuantityKind.POSITION,
        sections=_sections("3.2"),
        meaning="Soft limit of axis M{n} towards negative positions (L).",
    ),
    _kept(
        name="M{n}_POSLIM_R",
        address=128,
        kind=QuantityKind.POSITION,
        sections=_sections("3.2"),
        meaning="Soft limit of axis M{n} towards positive positions (R).",
    ),
)


UNKNOWN_FIRMWARE = Message("mic488.unknown-firmware", "unknown firmware {name!r}; permitted: {names}")


def firmware(name: str) -> Firmware:
    """The firmware generation of that name. Raises `Misuse` with the permitted names."""
    found = FIRMWARES.get(name)
    if found is None:
        raise Misuse(UNKNOWN_FIRMWARE(name=name, names=list(FIRMWARES)))
    return found


@cache
def register_map(name: str = DEFAULT_FIRMWARE) -> RegisterMap:
    """The map of a firmware (``1.23``, ``1.40``, ``1.70``), built and checked once and shared. Raises `Misuse`."""
    return RegisterMap(firmware(name), ROWS)
