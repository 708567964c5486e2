"""The M1486 as a kind of controller in a world: `M1486`. Positions are in minimum microsteps, as in its data sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from steptwin.controller import ControllerEvent, Nanos
from steptwin.controllerstate import ProgramActivity
from steptwin.datasheet import Datasheet, Pin
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, Refusal
from steptwin.m1486 import datasheet, points
from steptwin.m1486.check import check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of, unpack
from steptwin.m1486.lines import SEEK_ENDS_LOW, STEP_DIRECTION, interface
from steptwin.m1486.microsteps import FULL_STEP, UNIT
from steptwin.m1486.pins import CONTROL_PINS, LINE_PINS, OUTPUT_PINS, WAVEFORM, refuse_taken, seek_ends, settable_pin
from steptwin.m1486.present import describe_program, state_of
from steptwin.m1486.signals import STEP_PULSE_NS
from steptwin.m1486.variants import Store, variant
from steptwin.messages import Message, MessageText
from steptwin.points import LivePoint
from steptwin.simulation.faults import AxisLoad
from steptwin.simulation.kinds.kind import (
    BuildContext,
    ControllerKind,
    LineUnit,
    MotionEnds,
    RunningWorld,
    Terminals,
    TextContext,
)
from steptwin.simulation.kinds.m1486 import build, memory
from steptwin.simulation.kinds.m1486 import table as its_table
from steptwin.simulation.kinds.m1486.axes import motor
from steptwin.simulation.kinds.m1486.control import line_number, number, on_grid, refuse_busy, typed_for
from steptwin.simulation.kinds.m1486.deadmanjog import M1486DeadManJog
from steptwin.simulation.kinds.m1486.faults import M1486Body
from steptwin.simulation.kinds.m1486.linekind import CharacterLines
from steptwin.simulation.kinds.m1486.programs import ChipPrograms
from steptwin.simulation.kinds.m1486.table import M1486Spec
from steptwin.simulation.kinds.m1486.view import M1486View
from steptwin.simulation.kinds.programtexts import Destination, Downloading, ProgramText
from steptwin.simulation.mechanics.channels import AxisChannel, PhaseOutputs, StepOutputs
from steptwin.simulation.mechanics.scale import DriveScale, GivenScale
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import ControlProgram, Halt, Jog, Move, Seek, StopAxes

AXIS = "1"
"""The subject of the plans of a chip's only axis."""
_AT_WORK = (ProgramActivity.RUNNING, ProgramActivity.WAITING)
POSITION = Message("simulation.m1486.position", "position {position:g} {unit}")
DISTANCE = Message("simulation.m1486.distance", "distance {distance:g} {unit}")
VELOCITY = Message("simulation.m1486.velocity", "velocity {velocity:g} {unit}/s, V{number:g}")
COUNTER_SHOWS_THE_TARGET = Message(
    "simulation.m1486.counter-shows-the-target",
    "{controller} was stopped in a move: its counter does not show where it is (M-16)",
)
PROGRAM_CAN_ONLY_BE_STOPPED = Message(
    "simulation.m1486.program-can-only-be-stopped",
    "{controller}: an M1486 has no command to {action} its program: only stop can be done",
)
NO_COMMANDS = Message("simulation.m1486.no-commands", "{name} has no commands")
CANNOT_BE_TYPED_TO = Message("simulation.m1486.cannot-be-typed-to", "{controller} is on no line, so nothing can be typed to it")
RECEIVES_NOTHING = Message("simulation.m1486.receives-nothing", "{controller} is {words}, so it receives nothing")


class M1486Kind(ControllerKind[M1486Spec, M1486Chip, M1486View]):
    name = "m1486"
    model = "M1486"
    article = "an"
    spec = M1486Spec
    line = CharacterLines()
    # User lines are both inputs and outputs (manual chapter II).
    terminals = Terminals(digital_inputs=(*LINE_PINS, *CONTROL_PINS), analog_inputs=(), outputs=(*LINE_PINS, *OUTPUT_PINS))
    state = state_of
    languages = (memory.COMMANDS,)
    dialect_keys = ("variant", "interface")

    # ------------------------------------------------------------------ its table in a description

    def files(self, spec: M1486Spec) -> Iterator[tuple[str, str]]:
        if spec.program is not None:
            yield spec.program, "program"

    def build(self, spec: M1486Spec, context: BuildContext) -> Callable[[bytes | None], M1486Chip]:
        kind = variant(spec.variant)
        program = build.image(spec, kind, context)
        timed = any(line.name == spec.line and line.timing != "off" for line in context.lines)
        baud = spec.baud
        if baud is None:
            baud = next((line.baud for line in context.lines if line.name == spec.line), None)

        def make(memory: bytes | None) -> M1486Chip:
            kept = memory if memory is not None and kind.store is Store.EEPROM else b""
            return M1486Chip(
                kind,
                address=spec.address,
                interface=interface(spec.interface),
                baud=baud,
                statement_ns=spec.statement_time,
                is_timed=timed,
                image=kept if program is None else program,
            )

        return make

    # ------------------------------------------------------------------ its line and its surroundings

    def address(self, spec: M1486Spec, chip: M1486Chip) -> int:
        return chip.address

    def announced(self, chip: M1486Chip, address: int) -> dict[str, object]:
        return {"kind": self.name, "chip": f"{chip.address:X}", "variant": chip.variant.name}

    def input_pin(self, pin: str, level: float) -> str:
        return settable_pin(pin, level)

    def refuse_taken(self, chip: M1486Chip, pin: str) -> None:
        refuse_taken(pin, chip.interface)

    def ends_motion(self, chip: M1486Chip, axis: int) -> str | None:
        line = chip.motor.sought
        return None if line is None else f"B{line}"

    def would_end_seek(self, chip: M1486Chip, pin: str) -> bool:
        line = line_number(pin)
        return seek_ends(line, chip.io.levels[line])

    def scale(self, given: GivenScale, chip: M1486Chip, axis: int) -> DriveScale:
        per_rev, full_steps = motor(given.pulses_per_rev, given.full_steps)
        return DriveScale(pulses_per_rev=per_rev, full_steps=full_steps, text="counts minimum microsteps")

    def channels(self, chip: M1486Chip) -> Mapping[str, AxisChannel]:
        """In full steps."""
        outputs: StepOutputs | PhaseOutputs = PhaseOutputs(characteristic_pin=WAVEFORM)
        if chip.interface is STEP_DIRECTION:
            # The chip has DIRECTION itself.
            outputs = StepOutputs(dir=None, active_low=True, width_ns=STEP_PULSE_NS)
        return {AXIS: AxisChannel("axis", "step", float(FULL_STEP), outputs)}

    def body(self, chip: M1486Chip, service: LineUnit, shafts: Mapping[int, AxisLoad]) -> M1486Body:
        return M1486Body(chip, shafts.values())

    def watch_events(self, chip: M1486Chip, call: Callable[[ControllerEvent], None]) -> None:
        chip.on_event = call

    def keeps_memory(self, chip: M1486Chip) -> bool:
        return chip.variant.store is Store.EEPROM

    def keep_memory(self, chip: M1486Chip, memory: bytes | None, keep: Callable[[bytes], None]) -> None:
        """Types with EEPROM keep the program they are switched on with, too."""
        chip.store = keep
        if chip.variant.store is Store.EEPROM and chip.image != (memory or b""):
            keep(chip.image)

    # ------------------------------------------------------------------ what there is to read of it

    def datasheet(self, chip: M1486Chip) -> Datasheet:
        return datasheet.datasheet(chip)

    def datasheet_of(self, variant_name: str | None) -> Datasheet:
        return datasheet.datasheet_of(variant(variant_name or its_table.DEFAULT_VARIANT))

    def pins(self, chip: M1486Chip) -> Mapping[str, Pin]:
        return datasheet.pins_of(chip.variant)

    def point(self, chip: M1486Chip, name: str) -> LivePoint | None:
        return points.live_point(chip, name)

    def marks(self, chip: M1486Chip) -> tuple[object, ...]:
        return points.marks(chip)

    def mark_of(self, path: str) -> int:
        return points.mark_of(path)

    def is_idle(self, chip: M1486Chip, now: Nanos) -> bool:
        return chip.is_idle()

    def view(self, world: RunningWorld, name: str, chip: M1486Chip) -> M1486View:
        return M1486View(world, name, chip)

    # ------------------------------------------------------------------ commands, as its host types them

    # It has no enable, its home is a line that is not known (`seek`), and programs begin at labels: characters go to its line.

    def move(self, chip: M1486Chip, line: str | None, command: Move) -> do.Send:
        refuse_busy(chip, command.controller)
        if command.to is not None:
            if not chip.drive.is_valid:
                raise Refusal(COUNTER_SHOWS_THE_TARGET(controller=command.controller))
            what = POSITION(position=command.to, unit=UNIT)
            text = "h" if command.to == 0 else number(chip, "G", command.to, what)
            on_grid(chip, command.to - chip.drive.counter_u(chip.now), what)
        else:
            distance = command.by or 0.0
            what = DISTANCE(distance=distance, unit=UNIT)
            text = number(chip, "F" if distance >= 0 else "B", abs(distance), what)
            on_grid(chip, distance, what)
        return typed_for(chip, line, command, text, "r")

    def seek(self, chip: M1486Chip, line: str | None, command: Seek) -> do.Send:
        """At start/stop speed until the line has its end level; then the counter is 0."""
        refuse_busy(chip, command.controller)
        return typed_for(chip, line, command, f"{')' if command.direction > 0 else '('}{line_number(command.pin)}", "c100")

    def jog(self, chip: M1486Chip, line: str | None, command: Jog) -> do.Send:
        """V is in full steps/s; a type for 24 MHz makes twice as many of them."""
        refuse_busy(chip, command.controller)
        steps = abs(command.velocity) / (FULL_STEP * chip.variant.clock)
        velocity = number(chip, "V", steps, VELOCITY(velocity=command.velocity, unit=UNIT, number=steps))
        return typed_for(chip, line, command, velocity, "g+" if command.velocity > 0 else "g-", "r")

    def stop_axes(self, chip: M1486Chip, line: str | None, command: StopAxes) -> Halt:
        return Halt(command.controller, command.axis)

    def control_program(self, chip: M1486Chip, line: str | None, command: ControlProgram) -> Halt:
        if command.action != "stop":
            raise Refusal(PROGRAM_CAN_ONLY_BE_STOPPED(controller=command.controller, action=command.action))
        return Halt(command.controller, program=command.action)

    def motion_ends(self, name: str, axis: int, line: str | None, seek: Seek | None) -> MotionEnds:
        """Whether what was typed has been executed, and no move was stopped before its end; a seek has come to its line."""
        pending = "" if line is None else f" and {line}.idle"
        sought = ""
        if seek is not None:
            sought = f" and {name}.counter == 0 and {name}.{seek.pin} == {0 if line_number(seek.pin) in SEEK_ENDS_LOW else 1}"
        return MotionEnds(f"not {name}.busy{pending}", f"{name}.valid{sought}")

    def dead_man_jog(self, chip: M1486Chip, line: str | None, wanted: Jog) -> M1486DeadManJog:
        return M1486DeadManJog(chip, line, wanted)

    def halt(self, chip: M1486Chip, wanted: Halt, now: Nanos) -> None:
        """Every stop ends motion and program: the memory has one row of commands, whether they were typed or belong to a program,
        and the chip has no pause."""
        chip.halt(now)

    # ------------------------------------------------------------------ its programs

    def texts(self, spec: M1486Spec, chip: M1486Chip, context: TextContext) -> Sequence[ProgramText]:
        """Commands in a memory have no text: it is the one that was given or put there last. It does not run where another
        program has been typed since."""
        source = context.downloaded(spec.name, memory.PLACE) or memory.given_text(spec, context)
        is_empty = source is None
        source = source or SourceText(memory.PLACE, "")
        checked = check(source.text, chip.variant, chip.interface)
        is_there = (
            not is_empty
            and checked.is_sound
            and memory.is_in(chip, unpack(image_of(checked.program, chip.variant), chip.variant))
        )
        is_running = is_there and state_of(chip, chip.now).program.state in _AT_WORK
        findings = checked.diagnostics
        return (
            ProgramText(
                place=memory.PLACE,
                language=memory.COMMANDS,
                source=source,
                check=lambda: findings,
                memory=lambda text: memory.parts(chip, text),
                is_empty=is_empty,
                is_running=is_running,
            ),
        )

    def programs(self, spec: M1486Spec, chip: M1486Chip, context: TextContext) -> ChipPrograms:
        given = memory.given_text(spec, context)
        return ChipPrograms(chip, lambda: context.downloaded(spec.name, memory.PLACE) or given)

    def download(self, chip: M1486Chip, to: Destination, source: SourceText) -> Downloading:
        """A host types it: Kill, which stops with the ramp; Reset, which ends the program and empties the memory; the file in
        ``[ ]``, which runs as soon as it is there (chapter II, Memory)."""
        program = build.sound(source, chip.variant, chip.interface).program
        if not program.all_commands:
            raise Misuse(NO_COMMANDS(name=source.name))
        image_of(program, chip.variant)
        if to.line is None:
            raise Refusal(CANNOT_BE_TYPED_TO(controller=to.controller))
        if chip.is_shut_down:
            raise Refusal(RECEIVES_NOTHING(controller=to.controller, words=MessageText(describe_program(chip, chip.now))))
        return Downloading(typed=tuple(memory.typed_program(chip, to.controller, to.line, program)))


M1486 = M1486Kind()
