"""The MIC488 as a kind of controller in a world: `MIC488`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction

from steptwin.controller import ControllerEvent, Nanos
from steptwin.datasheet import Datasheet, Pin
from steptwin.diagnostics import SourceText
from steptwin.errors import Refusal
from steptwin.messages import Message
from steptwin.mic488 import datasheet, points
from steptwin.mic488.config import NO_INPUT, encoder_channel, examine_config
from steptwin.mic488.configtext import config_text
from steptwin.mic488.core import ANALOG_PINS, ENABLE_PINS, INPUT_PINS, OUTPUT_PINS, check_pin, check_turn
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.inputs import index_input
from steptwin.mic488.position_control import PositionControl
from steptwin.mic488.present import empty_banks, state_of
from steptwin.mic488.program_banks import load
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE
from steptwin.mic488.slave import slave
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.mic488.vision import VisionReceiver, VisionRecord
from steptwin.points import LivePoint
from steptwin.simulation.faults import AxisLoad
from steptwin.simulation.kinds.kind import (
    BuildContext,
    ControllerKind,
    EncoderInputs,
    EndSwitch,
    LineUnit,
    MotionEnds,
    RunningWorld,
    SeenRecord,
    Terminals,
    TextContext,
    Vision,
)
from steptwin.simulation.kinds.mic488 import build, memory
from steptwin.simulation.kinds.mic488.configuration import Mic488Configuration
from steptwin.simulation.kinds.mic488.deadmanjog import Mic488DeadManJog
from steptwin.simulation.kinds.mic488.faults import Mic488Body
from steptwin.simulation.kinds.mic488.linekind import ModbusLines
from steptwin.simulation.kinds.mic488.program_watch import ProgramWatch
from steptwin.simulation.kinds.mic488.programs import WbcPrograms
from steptwin.simulation.kinds.mic488.table import Mic488Spec
from steptwin.simulation.kinds.mic488.view import Mic488View
from steptwin.simulation.kinds.mic488.writes import REGISTERS
from steptwin.simulation.kinds.programtexts import Destination, Downloading, ProgramText
from steptwin.simulation.mechanics.channels import AxisChannel, plain_view
from steptwin.simulation.mechanics.scale import FULL_STEPS, DriveScale, GivenScale, exact_fraction
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControlProgram, Enable, Halt, Home, Jog, Move, Seek, StopAxes
from steptwin.wbc.interpreter import STATEMENT_TIME

PROGRAM = {"stop": 0, "start": 1, "pause": 2}
"""PROGRAM_CTRL by action."""
PROGRAM_IS_IN_USE = Message(
    "simulation.mic488.program-is-in-use", "{place} is in use by the program that runs or is paused: stop it first"
)


class Mic488Encoders(EncoderInputs[Mic488Device]):
    def reader(self, device: Mic488Device) -> Mic488Device:
        return device

    def counts_per_pulse(self, device: Mic488Device, axis: int) -> Fraction:
        encoder = device.axes[axis - 1].encoder
        return Fraction(encoder.enc_resol, encoder.mot_resol)

    def index_input(self, axis: int) -> str:
        return f"IN{index_input(axis - 1) + 1}"

    def to_json(self, device: Mic488Device, now: Nanos) -> list[dict[str, object]]:
        return [{"axis": a.number, "counts": a.encoder_counts(now), "turned_by": a.encoder.coupling.value} for a in device.axes]

    def is_followed(self, device: Mic488Device, axis: int) -> bool:
        return device.axes[axis - 1].config.pos_ctrl_mode == PositionControl.ENCFOLLOW

    def couple(self, device: Mic488Device, axis: int, coupling: str, now: Nanos) -> None:
        device.couple_encoder(axis, Coupling(coupling), now)

    def check_turn(self, axis: int, counts: int) -> None:
        check_turn(axis, counts)


class Mic488Vision(Vision[Mic488Spec, Mic488Device]):
    def address(self, spec: Mic488Spec) -> str | None:
        return spec.vision

    def see(self, device: Mic488Device, record: SeenRecord, now: Nanos) -> None:
        device.see(VisionRecord(*record), now)

    def records(self) -> Callable[[bytes], Sequence[SeenRecord]]:
        return VisionReceiver().feed


class Mic488Kind(ControllerKind[Mic488Spec, Mic488Device, Mic488View]):
    name = "mic488"
    model = "MIC488"
    spec = Mic488Spec
    line = ModbusLines()
    terminals = Terminals(
        digital_inputs=(*INPUT_PINS,), analog_inputs=(*ANALOG_PINS,), outputs=(*OUTPUT_PINS, *ENABLE_PINS, "ERR")
    )
    state = state_of
    encoders = Mic488Encoders()
    registers = REGISTERS
    vision = Mic488Vision()
    languages = (memory.WBC, memory.TABLES)
    dialect_keys = ("firmware",)
    configuration_format = Mic488Configuration()

    # ------------------------------------------------------------------ its table in a description

    def files(self, spec: Mic488Spec) -> Iterator[tuple[str, str]]:
        if spec.config is not None:
            yield spec.config, "config"
        if spec.program is not None:
            yield spec.program, "program"
        for _, name in spec.programs:
            yield name, "programs"
        for _, name in spec.positions:
            yield name, "positions"

    def build(self, spec: Mic488Spec, context: BuildContext) -> Callable[[bytes | None], Mic488Device]:
        config = build.configured(spec, context)
        programs, positions = build.banks(spec, config, context)
        statement_time = STATEMENT_TIME if spec.statement_time is None else spec.statement_time

        def make(memory: bytes | None) -> Mic488Device:
            return Mic488Device(
                config,
                spec.firmware,
                lenient=spec.lenient,
                memory=memory,
                programs=programs,
                positions=positions,
                statement_time=statement_time,
            )

        return make

    # ------------------------------------------------------------------ its line and its surroundings

    def address(self, spec: Mic488Spec, device: Mic488Device) -> int:
        return device.config.address if spec.unit is None else spec.unit

    def announced(self, device: Mic488Device, address: int) -> dict[str, object]:
        return {"kind": self.name, "unit": address, "firmware": device.firmware.name}

    def input_pin(self, pin: str, level: float) -> str:
        check_pin(pin, level)
        return pin.upper()

    def end_switches(self, device: Mic488Device) -> Iterator[EndSwitch]:
        for axis in device.axes:
            config = axis.config
            for direction, bit, attribute in ((-1, 1, "in_kl"), (1, 2, "in_kr")):
                pin = getattr(config, attribute)
                if pin != NO_INPUT and encoder_channel(pin) is None:
                    active = 1.0 - device.config.inputs[pin].level
                    stops = bool(config.limit_mode & bit)
                    yield EndSwitch(axis.number, direction, f"IN{pin + 1}", active, stops, (f"M{axis.number}", attribute))

    def ends_motion(self, device: Mic488Device, axis: int) -> str | None:
        homing = device.axes[axis - 1].homing
        if homing.leg in (homing.NONE, homing.TO_STOP):
            return None
        number = index_input(axis - 1) if homing.leg == homing.TO_INDEX else homing.sensor
        return "" if number == NO_INPUT else f"IN{number + 1}"

    def filter_of(self, device: Mic488Device, pin: str) -> Nanos:
        number = pin.removeprefix("IN")
        return device.inputs.filter_ns(int(number) - 1) if number.isdecimal() and pin != number else 0

    def is_inverted(self, device: Mic488Device, pin: str) -> bool:
        number = pin.removeprefix("IN")
        return number.isdecimal() and pin != number and device.config.inputs[int(number) - 1].level == 1

    def scale(self, given: GivenScale, device: Mic488Device, axis: int) -> DriveScale:
        its = device.axes[axis - 1]
        return DriveScale(
            pulses_per_rev=its.config.mot_resol if given.pulses_per_rev is None else given.pulses_per_rev,
            full_steps=FULL_STEPS if given.full_steps is None else given.full_steps,
            unit=its.config.unit_name,
            pulses_per_unit=exact_fraction(its.gear),
            text=f"has axis {axis} in {its.config.unit_name}",
        )

    def channels(self, device: Mic488Device) -> Mapping[str, AxisChannel]:
        """In configured units."""
        return {
            str(axis.number): plain_view(str(axis.number))._replace(unit=axis.config.unit_name, pulses_per_unit=axis.gear)
            for axis in device.axes
        }

    def body(self, device: Mic488Device, service: LineUnit, shafts: Mapping[int, AxisLoad]) -> Mic488Body:
        """Mechanics move the axes that have them."""
        found = Mic488Body(device, *service)
        for number, shaft in shafts.items():
            found.shafts[number - 1] = shaft
        return found

    def watch_events(self, device: Mic488Device, call: Callable[[ControllerEvent], None]) -> None:
        device.on_event = call

    def keeps_memory(self, device: Mic488Device) -> bool:
        return device.firmware.stored_user_registers is not None

    def keep_memory(self, device: Mic488Device, memory: bytes | None, keep: Callable[[bytes], None]) -> None:
        device.store = keep

    # ------------------------------------------------------------------ what there is to read of it

    def datasheet(self, device: Mic488Device) -> Datasheet:
        return datasheet.datasheet(device)

    def datasheet_of(self, variant: str | None) -> Datasheet:
        return datasheet.datasheet_of(variant or DEFAULT_FIRMWARE)

    def pins(self, device: Mic488Device) -> Mapping[str, Pin]:
        return datasheet.PINS

    def point(self, device: Mic488Device, name: str) -> LivePoint | None:
        return points.live_point(device, name)

    def marks(self, device: Mic488Device) -> tuple[object, ...]:
        return points.marks(device)

    def is_idle(self, device: Mic488Device, now: Nanos) -> bool:
        running = device.program.state is ProgramState.RUNNING
        return not running and not any(axis.profile.moving(now) for axis in device.axes)

    def view(self, world: RunningWorld, name: str, device: Mic488Device) -> Mic488View:
        return Mic488View(world, name, device)

    def remarks(self, name: str, device: Mic488Device) -> Sequence[str]:
        return empty_banks(name, device)

    # ------------------------------------------------------------------ commands, as its master does them

    # Ranges are those of the registers.

    def enable(self, device: Mic488Device, line: str | None, command: Enable) -> do.Write:
        return _write(command, "EN", float(command.on))

    def move(self, device: Mic488Device, line: str | None, command: Move) -> do.Write:
        return _write(command, "POS_REL", command.by or 0.0) if command.to is None else _write(command, "POS_ABS", command.to)

    def home(self, device: Mic488Device, line: str | None, command: Home) -> do.Write:
        return _write(command, "HOME", command.velocity)

    def jog(self, device: Mic488Device, line: str | None, command: Jog) -> do.Write:
        return _write(command, "VEL_ABS", command.velocity)

    def stop_axes(self, device: Mic488Device, line: str | None, command: StopAxes) -> Halt:
        return Halt(command.controller, command.axis)

    def control_program(self, device: Mic488Device, line: str | None, command: ControlProgram) -> do.Write | Halt:
        if command.action != "start":
            return Halt(command.controller, program=command.action)
        return do.Write(((command.controller, "PROGRAM_CTRL", float(PROGRAM[command.action])),))

    def motion_ends(self, name: str, axis: int, line: str | None, seek: Seek | None) -> MotionEnds:
        """By the status, which is that of a motion as soon as the request that starts it has been answered."""
        status = f"{name}.M{axis}.status"
        busy = (AxisStatus.POSITION, AxisStatus.HOMING, AxisStatus.CORRECTION)
        over = " and ".join(f"{status} != {one.value}" for one in busy)
        return MotionEnds(over, f"{status} == {AxisStatus.REACHED.value}")

    def dead_man_jog(self, device: Mic488Device, line: str | None, wanted: Jog) -> Mic488DeadManJog:
        return Mic488DeadManJog(device, line, wanted)

    def halt(self, device: Mic488Device, wanted: Halt, now: Nanos) -> None:
        """By the registers by which a master does it, but where no fault of protocol or line comes between."""
        axes = range(1, AXES + 1) if wanted.axis is None else (wanted.axis,)
        stops = tuple((f"M{axis}_STOP", 1.0) for axis in axes)
        values = stops if wanted.program is None else (("PROGRAM_CTRL", float(PROGRAM[wanted.program])),)
        device.advance(now)
        for pdu in REGISTERS.requests(device, values, is_command=False):
            slave(device.firmware.name, lenient=False).answer(device, pdu)

    # ------------------------------------------------------------------ its programs

    def texts(self, spec: Mic488Spec, device: Mic488Device, context: TextContext) -> Sequence[ProgramText]:
        """A program that was given as an image is the text made of it."""
        return [*memory.program_texts(device), *memory.position_texts(spec, device)]

    def programs(self, spec: Mic488Spec, device: Mic488Device, context: TextContext) -> WbcPrograms:
        return WbcPrograms(device)

    def watch_program(self, device: Mic488Device, scheduler: Scheduler, name: str) -> ProgramWatch | None:
        return ProgramWatch(device, scheduler, name) if device.program.banks.programs else None

    def download(self, device: Mic488Device, to: Destination, source: SourceText) -> Downloading:
        """The bank is filled at once, without the line, for how the vendor's program does it is not documented. Its program must
        be stopped (manual 4.1)."""
        what, _, number = to.place.partition(" ")
        bank, control = int(number), device.program
        if control.runs_program(bank) if what == memory.PROGRAM else control.runs_positions(bank):
            raise Refusal(PROGRAM_IS_IN_USE(place=to.place))
        if what == memory.PROGRAM:
            checked = memory.checked(device, bank, source.text)
            memory.refuse(source, checked.errors)
            program = load(checked, source.name)
            return Downloading(lambda now: device.load_program(bank, program))
        table = memory.table_of(source)
        return Downloading(lambda now: device.load_positions(bank, table))

    def configuration(self, spec: Mic488Spec, device: Mic488Device, context: BuildContext) -> SourceText:
        """The file itself unless the description changes some of it."""
        if spec.config is not None:
            source = IniFile.parse(context.data(spec.config), spec.config).source
            if examine_config(IniFile.of_text(source.text), spec.firmware)[0] == device.config:
                return source
        return SourceText(f"{spec.name}.cfg", config_text(device.config, device.firmware))


def _write(command: Enable | Move | Home | Jog, register: str, value: float) -> do.Write:
    """A register of the axis of a command, by the rest of its name."""
    return do.Write(((command.controller, f"M{command.axis}_{register}", value),))


MIC488 = Mic488Kind()
