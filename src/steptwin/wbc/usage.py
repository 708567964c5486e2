"""Warnings about what a program uses: variables, drives, interrupts, conditions, settings of the axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, floor, inf, log10

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.messages import Message, MessageText
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.conditions import outcome
from steptwin.wbc.events import BY_REGISTER, INPUTS, InterruptEvent
from steptwin.wbc.positions import PositionTable, number_text
from steptwin.wbc.real import real_text
from steptwin.wbc.statements import CIRCLES, LINES
from steptwin.wbc.tree import Assign, DecimalNumber, KeywordStatement, ProgramTree

HOME_WITHOUT_INPUT = Message("wbc.home-without-input", "HOME M{axis} goes to {side}, but the configuration has no input for it")
GIVE_AN_INPUT = Message("wbc.give-an-input", "give In{side} of [Axis{axis}] an input")
HOME_NEGATIVE = Message(
    "wbc.home-negative", "give In{side} of [Axis{axis}] an input, or home to {other} with a negative velocity"
)
HOME_POSITIVE = Message(
    "wbc.home-positive", "give In{side} of [Axis{axis}] an input, or home to {other} with a positive velocity"
)
GEARS_OF_AXES = Message("wbc.gears-of-axes", "GEAR of M1 is {one:g}, of M2 {other:g} pulses per unit")
WAITS_FOR_VELOCITY = Message(
    "wbc.waits-for-velocity", "this WAITPOS does not end by itself: VABS moves M{axis} until something stops it"
)
STOP_IT_BEFORE = Message("wbc.stop-it-before", "write BRAKE M{axis} before it; otherwise only a limit switch or a master ends it")
WAIT_NEVER_ENDS = Message("wbc.wait-never-ends", "this WAIT never ends: its condition is never true")
READS = Message("wbc.reads", "{name} reads {domain}")
ABOVE_OUTPUTS = Message("wbc.above-outputs", "{value} u/s at GEAR {gear:g} of M{axis} are {speed_p:.10g} pulses/s")
OUTPUTS_GIVE = Message("wbc.outputs-give", "the outputs give {most_p:g} pulses/s, {most:.6g} u/s")
ENABLED_WITHOUT_LABEL = Message(
    "wbc.enabled-without-label", "the interrupt of {name} is enabled, but there is no label INT_{name}"
)
INTERRUPT_IS_NEVER_ENABLED = Message("wbc.interrupt-is-never-enabled", "the interrupt of {name} is never enabled")
MOVED_BUT_NEVER_ENABLED = Message("wbc.moved-but-never-enabled", "M{axis} is moved, but the program never enables it")
INPUTS_OF_CONTROLLER = Message("wbc.inputs-of-controller", "the controller has the inputs IN1…IN{inputs}")
SAME_GEARS_FOR_A_CIRCLE = Message("wbc.same-gears-for-a-circle", "a circle needs the same GEAR on both axes to be round")
RAMPS_OF_AXES = Message("wbc.ramps-of-axes", "{name} of M1 is {one:g}, of M2 {other:g} u/s²")
WRITE_INTERRUPT_LABEL = Message("wbc.write-interrupt-label", "write INT_{name}: and its lines up to RETURN")
CONFIGURATION_ENABLES_IT = Message(
    "wbc.configuration-enables-it", "IN{input} interrupts only if the configuration enables it (Int)"
)
SET_TO_ENABLE_IT = Message("wbc.set-to-enable-it", "set {register} to enable it")
ENABLE_DRIVE = Message("wbc.enable-drive", "write M{axis} = ON, unless a master enables the drive")
SAME_RAMPS_FOR_A_LINE = Message("wbc.same-ramps-for-a-line", "give both axes of a line the same ramps")

_RAMPS = frozenset({"ACCM", "DECM"})
_PLANAR_AXES = (1, 2)


@dataclass(frozen=True, slots=True)
class Setup:
    """Values of a configuration (`.cfg`) for the checker: per axis GEAR in pulses per unit and the ramps in u/s², per input
    the interrupt preset ``Int`` (0 off).

    ``homing_ends``: per axis whether homing to KL and to KR comes to an end, by a switch or without needing one.
    ``most_speed_p``: what the pulse outputs give, in pulses/s.
    """

    gears: tuple[float, ...]
    accelerations: tuple[float, ...]
    decelerations: tuple[float, ...]
    input_interrupts: tuple[int, ...]
    homing_ends: tuple[tuple[bool, bool], ...] = ((True, True),) * 4
    most_speed_p: float = inf


def endless_waits(executable: s.Executable) -> list[Diagnostic]:
    return [
        f.NEVER_ENDS.at(step, WAIT_NEVER_ENDS(), _domain_hint(step.condition))
        for step in executable.steps
        if isinstance(step, s.WaitStep) and outcome(step.condition) is False
    ]


def waits_for_velocity(executable: s.Executable) -> list[Diagnostic]:
    """WAITPOS straight behind a VABS of an axis that nothing stops between them."""
    if executable.entries:
        return []  # an interrupt may stop it
    steps, found = executable.steps, dict[int, Diagnostic]()
    for begin, motion in enumerate(steps):
        if not isinstance(motion, s.MotionStep) or motion.keyword != "VABS":
            continue
        if not isinstance(motion.value, s.Literal) or _is_zero(motion.value):
            continue
        for number in range(begin + 1, len(steps)):
            step = steps[number]
            if isinstance(step, s.WaitPosStep):
                message = WAITS_FOR_VELOCITY(axis=motion.axis)
                found[number] = f.WAITS_FOR_VELOCITY.at(step, message, STOP_IT_BEFORE(axis=motion.axis))
                break
            if step.after(number) != (number + 1,) or _may_stop(step, motion.axis):
                break
    return list(found.values())


def _may_stop(step: s.ProgramStep, axis: int) -> bool:
    effect = step.effect()
    target = step.target if isinstance(step, s.SetStep) else None
    is_register = isinstance(target, s.RegisterOperand) and target.row.key != "OUT"
    return is_register or effect.any_drive or effect.drive == axis


def _domain_hint(condition: s.StepCondition) -> MessageText | None:
    for side in (condition.left, condition.right):
        if isinstance(side, s.RegisterOperand):
            return READS(name=side.name, domain=side.row.reads.text)
    return None


def axes_never_enabled(executable: s.Executable, positions: PositionTable | None) -> list[Diagnostic]:
    """The first motion of every drive the program does not switch on; a master could do it over Modbus."""
    switched_on = (register for register, step in _register_writes(executable) if not _is_zero(step.value))
    enabled = {register.number for register in switched_on if register.row.key == "M"}
    found: list[Diagnostic] = []
    reported: set[int] = set()
    for step in executable.steps:
        for axis in _moved(step, positions):
            if axis not in enabled and axis not in reported:
                reported.add(axis)
                message = MOVED_BUT_NEVER_ENABLED(axis=axis)
                fix = f.before(executable.steps[0], f"M{axis} = ON\n")
                found.append(f.NEVER_ENABLED.at(step, message, ENABLE_DRIVE(axis=axis), fix))
    return found


def _register_writes(executable: s.Executable) -> Iterator[tuple[s.RegisterOperand, s.SetStep]]:
    for step in executable.steps:
        if isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand):
            yield step.target, step


def _is_zero(value: object) -> bool:
    return isinstance(value, s.Literal) and value.value == 0


def _moved(step: s.ProgramStep, positions: PositionTable | None) -> tuple[int, ...]:
    """The drives a step moves, as far as they are known."""
    match step:
        case s.MotionStep(axis=axis):
            return (axis,)
        case s.RowMotionStep(keyword="MOVEPTP", row=s.Literal(value=index)):
            if positions is None or not index < len(positions.rows):
                return ()
            mask = positions.rows[int(index)].mask
            return tuple(axis for axis in range(1, 5) if mask & 1 << axis - 1)
        case s.RowMotionStep(keyword=keyword) if keyword != "MOVEPTP":
            return _PLANAR_AXES
        case _:
            return ()


def homing_sides(steps: Sequence[s.ProgramStep]) -> dict[int, frozenset[int]]:
    """The drives a program homes, each with the sides it goes to: -1 KL, 1 KR, 0 where the velocity is not known before."""
    sides: dict[int, frozenset[int]] = {}
    for step in steps:
        if isinstance(step, s.MotionStep) and step.keyword == "HOME":
            sides[step.axis] = sides.get(step.axis, frozenset()) | _signs(step.value, steps)
    return sides


def _signs(source: s.ValueSource, steps: Sequence[s.ProgramStep]) -> frozenset[int]:
    """Signs a value can have; 0 where that is not known, none for the number 0."""
    if isinstance(source, s.Literal):
        return frozenset({1 if source.value > 0 else -1}) if source.value else frozenset()
    values = [step.value for step in steps if isinstance(step, s.SetStep) and step.target == source]
    if isinstance(source, s.Variable) and values and all(isinstance(value, s.Literal) for value in values):
        return frozenset().union(*(_signs(value, steps) for value in values if isinstance(value, s.Literal)))
    return frozenset({0})


def homing_without_end(executable: s.Executable, setup: Setup) -> list[Diagnostic]:
    """HOMEs to a side for which the configuration has no input."""
    found: list[Diagnostic] = []
    for step in executable.steps:
        if not isinstance(step, s.MotionStep) or step.keyword != "HOME":
            continue
        signs = _signs(step.value, executable.steps)
        to_kl, to_kr = setup.homing_ends[step.axis - 1]
        if not signs or 0 in signs or (to_kl and -1 in signs) or (to_kr and 1 in signs):
            continue
        sides = ("KR", "KL") if 1 in signs else ("KL", "KR")
        message = HOME_WITHOUT_INPUT(axis=step.axis, side=sides[0])
        other = to_kl if 1 in signs else to_kr
        hint = GIVE_AN_INPUT if not other else HOME_NEGATIVE if 1 in signs else HOME_POSITIVE
        found.append(f.HOME_WITHOUT_SWITCH.at(step, message, hint(side=sides[0], axis=step.axis - 1, other=sides[1])))
    return found


def too_fast(executable: s.Executable, program: ProgramTree, setup: Setup) -> list[Diagnostic]:
    """Velocities, known before, that are more than the pulse outputs give."""
    found: list[Diagnostic] = []
    for step in executable.steps:
        if isinstance(step, s.MotionStep) and step.keyword in ("VABS", "HOME"):
            axis, value = step.axis, step.value
        elif isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand) and step.target.row.key == "VMAXM":
            axis, value = step.target.number, step.value
        else:
            continue
        if not isinstance(value, s.Literal):
            continue
        gear = setup.gears[axis - 1]
        speed_p = abs(value.value) * gear
        if speed_p > setup.most_speed_p:
            message = ABOVE_OUTPUTS(value=real_text(value.value), gear=gear, axis=axis, speed_p=speed_p)
            most = setup.most_speed_p / gear
            hint = OUTPUTS_GIVE(most_p=setup.most_speed_p, most=most)
            number = _number_of(program, step)
            text = number_text(copysign(_six_digits_below(most), value.value))
            found.append(
                f.TOO_FAST.at(step, message, hint, None if number is None else Fix(Span(number.start, number.end), text))
            )
    return found


def _six_digits_below(value: float) -> float:
    """The largest number with six digits that is no larger than a positive one."""
    found = float(f"{value:.6g}")
    return found if found <= value else float(f"{value - 10.0 ** (floor(log10(value)) - 5):.6g}")


def _number_of(program: ProgramTree, step: s.ProgramStep) -> DecimalNumber | None:
    """The last number written in the line of a step; None where a constant stands for it."""
    statement = next((line.statement for line in program.lines if line.statement and line.statement.start == step.start), None)
    match statement:
        case Assign(value=DecimalNumber() as number) | KeywordStatement(operands=(*_, DecimalNumber() as number)):
            return number
    return None


def interrupts(executable: s.Executable, setup: Setup | None) -> list[Diagnostic]:
    """Interrupts switched on that have no label, and labels whose interrupt nothing switches on."""
    found: list[Diagnostic] = []
    switched_on: set[InterruptEvent] = set()
    reported: set[InterruptEvent] = set()
    for register, step in _register_writes(executable):
        event = BY_REGISTER.get(register.name.upper())
        if event is None or _is_zero(step.value):
            continue
        switched_on.add(event)
        if event not in executable.entries and event not in reported:
            reported.add(event)
            message = ENABLED_WITHOUT_LABEL(name=event.name)
            fix = f.after(executable.steps[-1], f"{_end_of(executable)}\nINT_{event.name}:\nRETURN")
            found.append(f.NO_HANDLER.at(step, message, WRITE_INTERRUPT_LABEL(name=event.name), fix))
    for event, entry in executable.entries.items():
        if event not in switched_on and _stays_off(event, setup):
            if event.input > INPUTS:
                hint = INPUTS_OF_CONTROLLER(inputs=INPUTS)
            elif event.register is None:
                hint = CONFIGURATION_ENABLES_IT(input=event.input)
            else:
                hint = SET_TO_ENABLE_IT(register=event.register)
            message = INTERRUPT_IS_NEVER_ENABLED(name=event.name)
            found.append(f.INTERRUPT_OFF.at(executable.steps[entry], message, hint))
    return found


def _end_of(executable: s.Executable) -> str:
    """Line end of the lines above a label that is appended."""
    ends = isinstance(executable.steps[-1], s.EndStep | s.JumpStep | s.ReturnStep | s.ProgResetStep)
    return "" if ends else "\nEND"


def _stays_off(event: InterruptEvent, setup: Setup | None) -> bool:
    """Whether an interrupt the program does not enable is off: inputs can be preset by the configuration."""
    if event.input == 0 or event.input > INPUTS:
        return True
    return setup is not None and setup.input_interrupts[event.input - 1] == 0


def unequal_axes(executable: s.Executable, setup: Setup) -> list[Diagnostic]:
    """The first circle when the gears of M1 and M2 differ, the first line when their ramps do."""
    paths = [step for step in executable.steps if isinstance(step, s.RowMotionStep)]
    circle = next((step for step in paths if step.keyword in CIRCLES), None)
    line = next((step for step in paths if step.keyword in LINES), None)
    written = (register for register, _ in _register_writes(executable))
    ramps_set = any(register.row.key in _RAMPS and register.number in _PLANAR_AXES for register in written)
    found: list[Diagnostic] = []
    if circle is not None and setup.gears[0] != setup.gears[1]:
        message = GEARS_OF_AXES(one=setup.gears[0], other=setup.gears[1])
        found.append(f.GEARS_DIFFER.at(circle, message, SAME_GEARS_FOR_A_CIRCLE()))
    if line is not None and not ramps_set:
        for name, ramps in (("Acc", setup.accelerations), ("Dec", setup.decelerations)):
            if ramps[0] != ramps[1]:
                message = RAMPS_OF_AXES(name=name, one=ramps[0], other=ramps[1])
                found.append(f.RAMPS_DIFFER.at(line, message, SAME_RAMPS_FOR_A_LINE()))
    return found
