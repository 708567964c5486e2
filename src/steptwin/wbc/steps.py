"""A program resolved for execution: one step per executable line, every name replaced by what it stands for.

Step numbers are the slot numbers of the compiled image: labels take no step, interrupt labels do. Targets are step numbers.
``start`` and ``end`` of a step are the place of its statement in the source; steps compare by what they do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from steptwin.wbc.events import InterruptEvent
from steptwin.wbc.registers import RegisterRow

SHORTEST_DELAY_S = 0.01


@dataclass(frozen=True, slots=True)
class Literal:
    value: float


@dataclass(frozen=True, slots=True)
class Variable:
    """``index`` counts the variables of the program from 0."""

    index: int
    name: str


@dataclass(frozen=True, slots=True)
class RegisterOperand:
    """``number`` is the number in the name (``OUT3`` → 3, ``$D10`` → 10), 0 for a single register."""

    row: RegisterRow
    number: int

    @property
    def name(self) -> str:
        return f"{self.row.name}{self.number}" if self.row.last or self.row.words else self.row.name


ValueSource: TypeAlias = Literal | Variable | RegisterOperand
AssignmentTarget: TypeAlias = Variable | RegisterOperand


@dataclass(frozen=True, slots=True)
class StepCondition:
    """``sign`` is one of ``= < > <= >=``."""

    left: ValueSource
    sign: str
    right: ValueSource


@dataclass(frozen=True, slots=True)
class Operation:
    left: ValueSource
    operator: str
    right: ValueSource


@dataclass(frozen=True, slots=True)
class FunctionOperation:
    """``name`` is in upper case."""

    name: str
    arguments: tuple[ValueSource, ...]


@dataclass(frozen=True, slots=True)
class ProgramStep:
    start: int = field(compare=False)
    end: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class SetStep(ProgramStep):
    target: AssignmentTarget
    value: ValueSource | Operation | FunctionOperation


@dataclass(frozen=True, slots=True)
class IfStep(ProgramStep):
    """``middle`` is the step of ELSE, None without one; ``close`` that of ENDIF."""

    condition: StepCondition
    middle: int | None
    close: int

    @property
    def otherwise(self) -> int:
        """The step that follows if the condition is false."""
        return (self.close if self.middle is None else self.middle) + 1


@dataclass(frozen=True, slots=True)
class ElseStep(ProgramStep):
    """Reached only from the lines above it: goes on at ``close``, the ENDIF."""

    close: int


@dataclass(frozen=True, slots=True)
class EndIfStep(ProgramStep):
    pass


@dataclass(frozen=True, slots=True)
class WhileStep(ProgramStep):
    condition: StepCondition
    close: int


@dataclass(frozen=True, slots=True)
class EndWhileStep(ProgramStep):
    """``condition`` is that of the WHILE at ``open``."""

    condition: StepCondition
    open: int


@dataclass(frozen=True, slots=True)
class WaitStep(ProgramStep):
    condition: StepCondition


@dataclass(frozen=True, slots=True)
class DelayStep(ProgramStep):
    """At least `SHORTEST_DELAY_S` (WBC-7)."""

    seconds: ValueSource


@dataclass(frozen=True, slots=True)
class JumpStep(ProgramStep):
    target: int


@dataclass(frozen=True, slots=True)
class ReturnStep(ProgramStep):
    pass


@dataclass(frozen=True, slots=True)
class EndStep(ProgramStep):
    pass


@dataclass(frozen=True, slots=True)
class ProgResetStep(ProgramStep):
    pass


@dataclass(frozen=True, slots=True)
class MotionStep(ProgramStep):
    """HOME, VABS, VREL, PABS or PREL. ``axis`` counts from 1."""

    keyword: str
    axis: int
    value: ValueSource


@dataclass(frozen=True, slots=True)
class HaltStep(ProgramStep):
    """BRAKE or STOP. ``axis`` counts from 1."""

    keyword: str
    axis: int


@dataclass(frozen=True, slots=True)
class RowMotionStep(ProgramStep):
    """A motion with the parameters of a row of the position table; ``row`` gives its index from 0."""

    keyword: str
    row: ValueSource


@dataclass(frozen=True, slots=True)
class WaitPosStep(ProgramStep):
    pass


@dataclass(frozen=True, slots=True)
class PulseStep(ProgramStep):
    """``output`` counts from 1."""

    output: int
    seconds: ValueSource


@dataclass(frozen=True, slots=True)
class InterruptStep(ProgramStep):
    """An interrupt label. ``hard`` waits for the end of the statement in progress."""

    event: InterruptEvent
    hard: bool


@dataclass(frozen=True, slots=True)
class IllegalStep(ProgramStep):
    """A line that cannot be executed: an unknown record of an image, or (in a program with errors) a wrong line.

    ``opaque``: where the program goes on after it is not known.
    """

    data: bytes
    opaque: bool


STEPS: tuple[type[ProgramStep], ...] = tuple(
    found
    for found in list(globals().values())
    if isinstance(found, type) and issubclass(found, ProgramStep) and found is not ProgramStep
)
"""Every class of step; each needs its code, its sources and its successors."""


BLOCK_MARKS = (ElseStep, EndIfStep, EndWhileStep)
"""Steps that only mark where blocks end: a block that is left by a jump never comes to them."""


@dataclass(frozen=True, slots=True)
class Executable:
    """``variables`` in the order of their indices; ``labels`` by name in upper case; ``entries`` steps of interrupt labels;
    ``position_records`` rows of the image that replace those of the table."""

    steps: tuple[ProgramStep, ...]
    variables: tuple[str, ...]
    labels: Mapping[str, int]
    entries: Mapping[InterruptEvent, int]
    position_records: Mapping[int, bytes]
