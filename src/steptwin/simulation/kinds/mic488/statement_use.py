"""What the steps of a WBC program read and change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from steptwin.mic488.program_registers import ACCESS
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementUse
from steptwin.tables import complete
from steptwin.wbc import steps as s
from steptwin.wbc.usage import sources

_PINS = frozenset({"OUT", "IN", "AIN"})
_OF_AXIS = frozenset({"M", "STATM", "VACTM", "POSM", "ACCM", "DECM", "VMAXM", "LIMLM", "LIMRM", "ENC", "XENC", "CFGINT_M"})
_ANY_AXIS = Resource(ResourceKind.AXIS, "")
_ANY_PIN = Resource(ResourceKind.PIN, "")


def use_of(steps: Sequence[s.ProgramStep], number: int) -> StatementUse:
    """Of a step by its number; the one after the last is the end of the program."""
    if number >= len(steps):
        return StatementUse()
    step = steps[number]
    use = _USES[type(step)](step, number)
    if type(step) is s.InterruptStep:
        use = use._replace(governs=range(number + 1, _return_after(steps, number) + 1))
    return use._replace(reads=(*use.reads, *_operands(sources(step))))


def _return_after(steps: Sequence[s.ProgramStep], number: int) -> int:
    """The step that ends an interrupt, or the last one."""
    return next((later for later in range(number, len(steps)) if type(steps[later]) is s.ReturnStep), len(steps))


def _interrupt(step: s.InterruptStep, number: int) -> StatementUse:
    event = step.event
    if event.input:
        return StatementUse((Resource(ResourceKind.PIN, f"IN{event.input}"),), waits=True)
    return StatementUse((Resource(ResourceKind.AXIS, str(event.axis)),) if event.axis else (), waits=True)


def _end_of_while(step: s.EndWhileStep, number: int) -> StatementUse:
    reads = tuple(_operands((step.condition.left, step.condition.right)))
    return StatementUse(reads, governs=range(step.open + 1, number), is_loop=True)


def _sets(step: s.SetStep, number: int) -> StatementUse:
    (target,) = _operands((step.target,))
    if isinstance(step.target, s.Variable) or not ACCESS[step.target.row.key].quiet:
        return StatementUse(writes=(target,))
    register = Resource(ResourceKind.VALUE, step.target.name)
    return StatementUse(writes=(target,) if target == register else (target, register), keeps=True)


def _of_axis(step: s.MotionStep | s.HaltStep, number: int) -> StatementUse:
    return StatementUse(writes=(Resource(ResourceKind.AXIS, str(step.axis)),))


def _nothing(step: s.ProgramStep, number: int) -> StatementUse:
    return StatementUse()


_USES: Mapping[type[s.ProgramStep], Callable[[Any, int], StatementUse]] = complete(
    "step",
    s.STEPS,
    "use",
    {
        s.SetStep: _sets,
        s.PulseStep: lambda step, number: StatementUse(writes=(Resource(ResourceKind.PIN, f"OUT{step.output}"),)),
        **dict.fromkeys((s.MotionStep, s.HaltStep), _of_axis),
        s.RowMotionStep: lambda step, number: StatementUse(writes=(_ANY_AXIS,)),
        s.IfStep: lambda step, number: StatementUse(governs=range(number + 1, step.close)),
        s.WhileStep: lambda step, number: StatementUse(governs=range(number + 1, step.close), is_loop=True),
        s.EndWhileStep: _end_of_while,
        **dict.fromkeys((s.WaitStep, s.DelayStep), lambda step, number: StatementUse(waits=True)),
        s.WaitPosStep: lambda step, number: StatementUse((_ANY_AXIS,), waits=True),
        s.InterruptStep: _interrupt,
        s.JumpStep: lambda step, number: StatementUse(jumps=step.target),
        **dict.fromkeys((s.EndStep, s.ProgResetStep), lambda step, number: StatementUse(writes=(_ANY_AXIS, _ANY_PIN))),
        **dict.fromkeys((s.ElseStep, s.EndIfStep, s.ReturnStep, s.IllegalStep), _nothing),
    },
)


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
            case s.RegisterOperand():
                yield Resource(ResourceKind.VALUE, value.name)
