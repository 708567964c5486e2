"""The MIC488 in a world."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.machine import MachineEvent, Nanos
from steptwin.mic488 import datasheet, points
from steptwin.mic488.core import ANALOG_PINS, ENABLE_PINS, INPUT_PINS, OUTPUT_PINS, check_pin
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.present import empty_banks, state_of, statement_of
from steptwin.mic488.registers import DEFAULT_FIRMWARE
from steptwin.mic488.status import ProgramState
from steptwin.mic488.values import halted
from steptwin.mic488.vision import VisionReceiver, VisionRecord
from steptwin.simulation.kinds.kind import ControllerKind, LineKind, LinkKind, NamedRegisters, PointMarks, Terminals, Vision
from steptwin.simulation.kinds.mic488 import axes, build, control, faults, line, memory, programs, table
from steptwin.simulation.kinds.mic488.configuration import Mic488Configuration
from steptwin.simulation.kinds.mic488.heldjog import Mic488HeldJog
from steptwin.simulation.kinds.mic488.program_watch import watch_program
from steptwin.simulation.kinds.mic488.table import Mic488Spec
from steptwin.simulation.kinds.mic488.view import Mic488View
from steptwin.simulation.kinds.mic488.words import ModbusWords, follow_writes
from steptwin.simulation.kinds.mic488.writes import encode_write
from steptwin.wire.pdu import ModbusException, decode_request


def _watch_events(device: Mic488Device, call: Callable[[MachineEvent], None]) -> None:
    device.on_event = call


def _keep_memory(device: Mic488Device, memory: bytes | None, keep: Callable[[bytes], None]) -> None:
    device.store = keep


def _address(spec: Mic488Spec, device: Mic488Device) -> int:
    return device.config.address if spec.unit is None else spec.unit


def _input_pin(pin: str, level: float) -> str:
    check_pin(pin, level)
    return pin.upper()


def _is_idle(device: Mic488Device, now: Nanos) -> bool:
    running = device.program.state is ProgramState.RUNNING
    return not running and not any(axis.profile.moving(now) for axis in device.axes)


def _ended_by(device: Mic488Device, pdu: bytes) -> tuple[int, ...]:
    try:
        return halted(device.registers, decode_request(pdu))
    except ModbusException:
        return ()


def _see(device: Mic488Device, record: tuple[float, float, float, float], now: Nanos) -> None:
    device.see(VisionRecord(*record), now)


MODBUS = LineKind(
    name="modbus",
    meaning="modbus (MIC488)",
    links={
        "pty": LinkKind("rtu", "pty", "Modbus RTU"),
        "serial": LinkKind("serial", "serial", "Modbus RTU"),
        "rtu_tcp": LinkKind("rtu", "rtu", "RTU over TCP"),
        "tcp": LinkKind("tcp", "tcp", "Modbus TCP"),
        "rfc2217": LinkKind("rtu", "rtu", "network port"),
        "tls_tcp": LinkKind("tcp", "tcp", "Modbus TCP Security"),
    },
    keys=frozenset({"gap"}),
    make=line.make,
    words=ModbusWords,
    writes=follow_writes,
)

MIC488: ControllerKind[Mic488Spec, Mic488Device, Mic488View] = ControllerKind(
    name="mic488",
    model="MIC488",
    spec=Mic488Spec,
    files=table.files,
    build=build.build,
    watch_events=_watch_events,
    keep_memory=_keep_memory,
    announced=lambda device, unit: {"kind": "mic488", "unit": unit, "firmware": device.firmware.name},
    line=MODBUS,
    address=_address,
    terminals=Terminals(
        digital_inputs=(*INPUT_PINS,), analog_inputs=(*ANALOG_PINS,), outputs=(*OUTPUT_PINS, *ENABLE_PINS, "ERR")
    ),
    input_pin=_input_pin,
    scale=axes.scale,
    is_idle=_is_idle,
    datasheet=datasheet.datasheet,
    pins=lambda device: datasheet.PINS,
    datasheet_of=lambda variant: datasheet.datasheet_of(variant or DEFAULT_FIRMWARE),
    point=points.live_point,
    marks=PointMarks(points.marks),
    motion_ends=control.motion_ends,
    control=control.CONTROL,
    halt=control.halt,
    held_jog=Mic488HeldJog,
    state=state_of,
    statement=statement_of,
    view=Mic488View,
    lanes=axes.lanes,
    body=faults.body,
    keeps_memory=lambda device: device.firmware.stored_user_registers is not None,
    watch_program=watch_program,
    languages=(memory.WBC, memory.TABLES),
    dialect_keys=("firmware",),
    texts=memory.texts,
    download=memory.download,
    programs=programs.programs,
    configuration=build.configuration,
    configuration_format=Mic488Configuration(),
    remarks=empty_banks,
    encoders=axes.ENCODERS,
    registers=NamedRegisters(
        requests=encode_write,
        dialect=lambda device: (device.firmware.name, device.data_type),
        execute=lambda device, pdu, now: device.execute(pdu, now),
        ended_by=_ended_by,
    ),
    vision=Vision(address=lambda spec: spec.vision, see=_see, records=lambda: VisionReceiver().feed),
)
