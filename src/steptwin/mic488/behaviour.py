"""The behaviour of registers: one entry for each row of the register table, under the key of the row.

`steptwin.mic488.registers` describes the registers for masters; this is the controller's side. A row without its behaviour,
a behaviour without its row, or one that does not fit its row is refused at import.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.mic488.axis import Axis
from steptwin.mic488.core import CoilAction, ControllerCore, RegisterAction
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, wrapped_dint
from steptwin.mic488.registermap import MapRow, Per, Type
from steptwin.mic488.registers import MOTION_REGISTERS, ROWS, axes_of_mask
from steptwin.tables import IncompleteTable, complete
from steptwin.wire.pdu import DEVICE_FAILURE, WRITE_SINGLE_COIL, ModbusException

BitGetter: TypeAlias = Callable[[int], Callable[[ControllerCore], bool]]
"""Number of the axis, input or output (from 0) → the function that reads it."""
Getter: TypeAlias = Callable[[Any, Nanos], float]
"""(controller or axis, moment) → the number in the response."""
AxisAction: TypeAlias = Callable[[Axis, float, Nanos], None]


@dataclass(frozen=True, slots=True)
class Bit:
    """A coil or input. A function that its row does not permit is None, here and below."""

    read: BitGetter | None = None
    write: CoilAction | None = None


@dataclass(frozen=True, slots=True)
class DeviceBehaviour:
    """A holding register of the controller. ``quiet``: a write only keeps the value, nothing happens earlier or later for it."""

    read: Getter | None = None
    write: RegisterAction | None = None
    quiet: bool = False


@dataclass(frozen=True, slots=True)
class AxisBehaviour:
    """A holding register of an axis. REAL/DINT values are read in units (``read``) or pulses (``read_p``), written in pulses.

    ``quiet`` as in `DeviceBehaviour`. ``waits``: in TRIGGER mode a write is kept for the trigger register (MIC-16).
    """

    read: Getter | None = None
    read_p: Getter | None = None
    write: AxisAction | None = None
    quiet: bool = False
    waits: bool = False


RegisterBehaviour: TypeAlias = Bit | DeviceBehaviour | AxisBehaviour


def checked(rows: Iterable[MapRow], given: Mapping[str, RegisterBehaviour]) -> Mapping[str, Any]:
    """``given``, read-only. `IncompleteTable` for a row without behaviour, a behaviour without row, or one that does not fit its
    row. User registers are plain memory and have none."""
    served = {row.key: row for row in rows if row.type is not Type.MEMORY}
    found = complete("register", served, "behaviour", given)
    for key, behaviour in found.items():
        row = served[key]
        kind = Bit if row.type is Type.BIT else AxisBehaviour if row.per is Per.AXIS else DeviceBehaviour
        if not isinstance(behaviour, kind):
            raise IncompleteTable(f"register {key} needs the behaviour {kind.__name__}, not {type(behaviour).__name__}")
        _check("read", row, behaviour.read, wanted=bool(row.reads))
        _check("write", row, behaviour.write, wanted=bool(row.writes))
        if isinstance(behaviour, AxisBehaviour):
            _check("read_p", row, behaviour.read_p, wanted=bool(row.reads) and row.type is Type.VALUE)
    return found


def _check(name: str, row: MapRow, function: object, *, wanted: bool) -> None:
    if (function is None) is wanted:
        problem = f"lacks its {name}" if wanted else f"has a {name} that its row does not permit"
        raise IncompleteTable(f"register {row.key} ({row.type.value}, reads {row.reads}, writes {row.writes}) {problem}")


# ---------------------------------------------------------------------- coils


def _enable(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
    axis = device.axes[number]
    if on:
        axis.enable(now)
    else:
        axis.disable(now)


def _stop(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.axes[number].stop(now)


def _jog(direction: int) -> CoilAction:
    def jog(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
        axis = device.axes[number]
        axis.jog(direction, on, device.jog_speed_u * axis.gear, now)

    return jog


def _load(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.load_memory()


def _save(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
    if on:
        try:
            device.save_memory()
        except OSError as error:
            device.event("memory-failure", str(error), now)
            raise ModbusException(WRITE_SINGLE_COIL, DEVICE_FAILURE) from error


def _zero(device: ControllerCore, number: int, on: bool, now: Nanos) -> None:
    if on:
        device.zero_memory()


# ---------------------------------------------------------------------- registers of the controller


def _set_data_type(device: ControllerCore, value: float, now: Nanos) -> None:
    """MIC-17: only the representation changes."""
    device.data_type = int(value)


def _set_program_bank(device: ControllerCore, value: float, now: Nanos) -> None:
    device.program.program_bank = int(value)


def _set_position_bank(device: ControllerCore, value: float, now: Nanos) -> None:
    device.program.position_bank = int(value)


def _set_mode(device: ControllerCore, value: float, now: Nanos) -> None:
    device.trigger_mode = int(value)


def _set_jog_speed(device: ControllerCore, value: float, now: Nanos) -> None:
    device.jog_speed_u = float(value)


def _axes_chosen(device: ControllerCore, mask: float) -> list[Axis]:
    """The axes of a mask register (MIC-25)."""
    return [device.axes[number - 1] for number in axes_of_mask(int(mask))]


def _drives(action: Callable[[Axis, Nanos], None]) -> DeviceBehaviour:
    def act(device: ControllerCore, value: float, now: Nanos) -> None:
        for axis in _axes_chosen(device, value):
            action(axis, now)

    return DeviceBehaviour(write=act)


# ---------------------------------------------------------------------- motion registers and their trigger registers

MOTIONS: Mapping[str, AxisAction] = complete(
    "motion register",
    MOTION_REGISTERS,
    "move",
    {
        "VEL_ABS": lambda axis, value, now: axis.move_velocity(value, now),
        "VEL_REL": lambda axis, value, now: axis.change_velocity(value, now),
        "POS_ABS": lambda axis, value, now: axis.move_to(int(value), now),
        "POS_REL": lambda axis, value, now: axis.move_by(int(value), now),
    },
)


TRIGGER_WITHOUT_VALUE = Message("mic488.trigger-without-value", "trigger of M{axis} without a new value of {register}")


def _trigger(key: str, move: AxisAction) -> DeviceBehaviour:
    def trigger(device: ControllerCore, value: float, now: Nanos) -> None:
        """MIC-16: starts the chosen axes that have a stored value, and uses it up, unless values are kept."""
        device.triggered[key] = int(value)
        if not device.trigger_mode:
            return
        for axis in _axes_chosen(device, value):
            stored = axis.pending.get(key) if device.config.trigger_keeps else axis.pending.pop(key, None)
            if stored is None:
                text = TRIGGER_WITHOUT_VALUE(axis=axis.number, register=key)
                device.axis_event(axis.number, "trigger-empty", text, now)
            else:
                move(axis, stored, now)

    return DeviceBehaviour(lambda device, now: device.triggered[key], trigger)


# ---------------------------------------------------------------------- registers of an axis


def _position_u(axis: Axis, now: Nanos) -> float:
    # Masters poll this register most: a copy of `Axis.coordinate_p`.
    coordinate = axis.profile.count(now) + axis.offset_p
    if not DINT_MIN <= coordinate <= DINT_MAX:
        coordinate = wrapped_dint(coordinate)
    return coordinate / axis.gear


def _set_acc(axis: Axis, value: float, now: Nanos) -> None:
    axis.acc_p = value


def _set_dec(axis: Axis, value: float, now: Nanos) -> None:
    axis.dec_p = value


def _set_vmax(axis: Axis, value: float, now: Nanos) -> None:
    axis.vmax_p = value


def _set_encoder(axis: Axis, value: float, now: Nanos) -> None:
    axis.encoder.set_counter(int(value), axis.shaft(now))


def _set_encoder_position(axis: Axis, value: float, now: Nanos) -> None:
    _set_encoder(axis, round(axis.encoder.counts(value)), now)


# ---------------------------------------------------------------------- the table

# MIC-17: REAL/DINT values are stored in pulses and shown according to DATA_TYPE.
# MIC-42: what is read can be written back, and 0 may not be written (MIC-7): ACC, DEC and VMAX in pulses are at least 1.
BEHAVIOUR: Mapping[str, Any] = checked(
    ROWS,
    {
        "EN": Bit(write=_enable),
        "STOP": Bit(write=_stop),
        "JOG_PLUS": Bit(write=_jog(+1)),
        "JOG_MINUS": Bit(write=_jog(-1)),
        "USER_REG_READ": Bit(write=_load),
        "USER_REG_SAVE": Bit(write=_save),
        "USER_REG_ZERO": Bit(write=_zero),
        "OUT": Bit(
            lambda number: lambda device: device.outputs[number],
            lambda device, number, on, now: device.set_output(number, on, now),
        ),
        "IN": Bit(lambda number: lambda device: device.inputs.filtered[number]),
        "DATA_TYPE": DeviceBehaviour(lambda device, now: device.data_type, _set_data_type, quiet=True),
        "PROG_BANK_SEL": DeviceBehaviour(lambda device, now: device.program.program_bank, _set_program_bank, quiet=True),
        "POS_BANK_SEL": DeviceBehaviour(lambda device, now: device.program.position_bank, _set_position_bank, quiet=True),
        "PROGRAM_CTRL": DeviceBehaviour(
            lambda device, now: device.program.state,
            lambda device, value, now: device.program.command(int(value), now),
        ),
        "AXIS_CTR_MODE": DeviceBehaviour(lambda device, now: device.trigger_mode, _set_mode, quiet=True),
        **{f"AXIS_{key}_TRIG": _trigger(key, move) for key, move in MOTIONS.items()},
        "M_ALL_STATUS": DeviceBehaviour(lambda device, now: 0),
        "M_STATUS": DeviceBehaviour(lambda device, now: device.status()),
        "STATUS": AxisBehaviour(lambda axis, now: axis.status),
        "M_ENABLE": _drives(lambda axis, now: axis.enable(now)),
        "M_DISABLE": _drives(lambda axis, now: axis.disable(now)),
        "M_STOP": _drives(lambda axis, now: axis.stop(now)),
        "JOG_SPEED": DeviceBehaviour(write=_set_jog_speed, quiet=True),
        "POS_ACT": AxisBehaviour(
            _position_u,
            lambda axis, now: axis.coordinate_p(now),
            lambda axis, value, now: axis.set_coordinate(int(value), now),
        ),
        "VEL_ACT": AxisBehaviour(
            lambda axis, now: axis.profile.velocity(now) / axis.gear,
            lambda axis, now: round(axis.profile.velocity(now)),
        ),
        "ACC": AxisBehaviour(
            lambda axis, now: axis.acc_p / axis.gear,
            lambda axis, now: max(1, round(axis.acc_p)),
            _set_acc,
            quiet=True,
        ),
        "DEC": AxisBehaviour(
            lambda axis, now: axis.dec_p / axis.gear,
            lambda axis, now: max(1, round(axis.dec_p)),
            _set_dec,
            quiet=True,
        ),
        "VMAX": AxisBehaviour(
            lambda axis, now: axis.vmax_p / axis.gear,
            lambda axis, now: max(1, round(axis.vmax_p)),
            _set_vmax,
            quiet=True,
        ),
        "HOME": AxisBehaviour(write=lambda axis, value, now: axis.home(value, now)),
        **{key: AxisBehaviour(write=move, waits=True) for key, move in MOTIONS.items()},
        "ENC_IMP": AxisBehaviour(lambda axis, now: axis.encoder_counts(now), write=_set_encoder),
        "ENC_XPOS": AxisBehaviour(
            lambda axis, now: axis.encoder.pulses(axis.encoder_counts(now)) / axis.gear,
            lambda axis, now: round(axis.encoder.pulses(axis.encoder_counts(now))),
            _set_encoder_position,
        ),
        "POSLIM_L": AxisBehaviour(
            lambda axis, now: axis.limit_l_p / axis.gear,
            lambda axis, now: axis.limit_l_p,
            lambda axis, value, now: axis.set_limits(now, left_p=int(value)),
        ),
        "POSLIM_R": AxisBehaviour(
            lambda axis, now: axis.limit_r_p / axis.gear,
            lambda axis, now: axis.limit_r_p,
            lambda axis, value, now: axis.set_limits(now, right_p=int(value)),
        ),
    },
)
