"""Reads and changes of the steps of a WBC program."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from steptwin.mic488.program_registers import ACCESS
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementUse
from steptwin.wbc import steps as s
from steptwin.wbc.registers import PREDEFINED

_PINS = frozenset({"OUT", "IN", "AIN"})
_OF_AXIS = frozenset({"M", "STATM", "VACTM", "POSM", "ACCM", "DECM", "VMAXM", "LIMLM", "LIMRM"})
_OF_ENCODER = frozenset({"ENC", "XENC"})
_ANY_AXIS = Resource(ResourceKind.AXIS, "")
_ANY_PIN = Resource(ResourceKind.PIN, "")
_PROGRAM = Resource(ResourceKind.PROGRAM, "")
_EDGES = ((PREDEFINED["RIS"], 1.0), (PREDEFINED["FALL"], 0.0))


def use_of(steps: Sequence[s.ProgramStep], number: int) -> StatementUse:
    """Use of a step by its number; the one after the last is the end of the program, which ends as with END."""
    if number >= len(steps):
        return StatementUse(writes=(_ANY_AXIS, _ANY_PIN, _PROGRAM))
    step = steps[number]
    writes, keeps = _set_by(step) if isinstance(step, s.SetStep) else (tuple(_acted_on(step.effect())), False)
    return StatementUse(
        (*_awaited(step), *_operands(step.sources())),
        writes,
        waits=step.waits is not s.StepWait.NOTHING,
        lasts=isinstance(step, s.PulseStep),
        governs=_governed(steps, number),
        is_loop=isinstance(step, s.WhileStep | s.EndWhileStep),
        jumps=step.target if isinstance(step, s.JumpStep) else None,
        acts_by=tuple(_acted_by(step)),
        keeps=keeps,
        edges=_EDGES if isinstance(step, s.InterruptStep) and step.event.input else (),
        sets=_level(step),
    )


def _acted_on(effect: s.StepEffect) -> Iterable[Resource]:
    if effect.output is not None:
        yield Resource(ResourceKind.PIN, f"OUT{effect.output}")
    if effect.drive is not None:
        yield Resource(ResourceKind.AXIS, str(effect.drive))
    if effect.any_drive or effect.everything:
        yield _ANY_AXIS
    if effect.everything:
        yield _ANY_PIN
        yield _PROGRAM


def _acted_by(step: s.ProgramStep) -> Iterable[Resource]:
    """The coordinates in which a step gives a position, of a row those of the axes that it moves; the switch of an interrupt."""
    match step:
        case s.InterruptStep(event=event):
            yield Resource(ResourceKind.VALUE, f"CFGINT_{event.name}")
        case s.MotionStep(keyword="PABS", axis=axis):
            yield Resource(ResourceKind.ORIGIN, str(axis))
        case s.RowMotionStep(keyword=keyword) if keyword != "MOVELIN_REL":
            yield Resource(ResourceKind.ORIGIN, "")


def _awaited(step: s.ProgramStep) -> Iterable[Resource]:
    """Resources that decide besides the operands."""
    match step:
        case s.InterruptStep(event=event) if event.input:
            return (Resource(ResourceKind.PIN, f"IN{event.input}"),)
        case s.InterruptStep(event=event) if event.axis:
            return (Resource(ResourceKind.AXIS, str(event.axis)),)
        case s.InterruptStep(event=event):
            return () if event.period else (Resource(ResourceKind.REQUEST, "USER_REGISTER"),)
        case s.EndWhileStep(condition=condition):
            return _operands((condition.left, condition.right))
    return (_ANY_AXIS,) if step.waits is s.StepWait.MOTION else ()


def _governed(steps: Sequence[s.ProgramStep], number: int) -> range:
    match steps[number]:
        case s.IfStep(close=close) | s.WhileStep(close=close):
            return range(number + 1, close)
        case s.EndWhileStep(open=begin):
            return range(begin + 1, number)
        case s.InterruptStep():
            return range(number + 1, _return_after(steps, number) + 1)
        case step:
            # A branch without a rule here decides about all that comes after it.
            return range(number + 1, len(steps)) if len(step.after(number)) > 1 else range(0)


def _return_after(steps: Sequence[s.ProgramStep], number: int) -> int:
    """The step that ends an interrupt, or the last one."""
    return next((later for later in range(number, len(steps)) if type(steps[later]) is s.ReturnStep), len(steps))


def _set_by(step: s.SetStep) -> tuple[tuple[Resource, ...], bool]:
    """Resources that SET changes, and whether they are only kept."""
    targets = tuple(_operands((step.target,)))
    if isinstance(step.target, s.Variable) or not ACCESS[step.target.row.key].quiet:
        return (*targets, *_pins_of_axis(step.target)), False
    register = Resource(ResourceKind.VALUE, step.target.name)
    return tuple(dict.fromkeys((*targets, register))), True


def _level(step: s.ProgramStep) -> float | None:
    match step:
        case s.SetStep(target=s.RegisterOperand(row=row), value=s.Literal(value=value)) if row.key == "OUT":
            return float(value != 0.0)
    return None


def _pins_of_axis(target: s.AssignmentTarget) -> Iterable[Resource]:
    """The output that enables an axis, which M switches."""
    if isinstance(target, s.RegisterOperand) and target.row.key == "M":
        yield Resource(ResourceKind.PIN, f"M{target.number}_EN")


def _operands(values: Iterable[s.ValueSource]) -> Iterable[Resource]:
    for value in values:
        match value:
            case s.Variable():
                yield Resource(ResourceKind.VALUE, value.name)
            case s.RegisterOperand(row=row) if row.key in _PINS:
                yield Resource(ResourceKind.PIN, f"{row.key}{value.number}")
            case s.RegisterOperand(row=row) if row.key in ("INPUTS", "OUTPUTS"):
                yield _ANY_PIN
            case s.RegisterOperand(row=row) if row.key in _OF_AXIS:
                yield Resource(ResourceKind.AXIS, str(value.number))
                if row.key == "POSM":
                    yield Resource(ResourceKind.ORIGIN, str(value.number))
            case s.RegisterOperand(row=row) if row.key in _OF_ENCODER:
                yield Resource(ResourceKind.ENCODER, str(value.number))
            case s.RegisterOperand():
                yield Resource(ResourceKind.VALUE, value.name)
