"""A program resolved for execution: one step per executable line, every name replaced by what it stands for.

Step numbers are the slot numbers of the compiled image: labels take no step, interrupt labels do. Targets are step numbers.
``start`` and ``end`` of a step are the place of its statement in the source; steps compare by what they do.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, TypeAlias

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


class StepWait(enum.Enum):
    """Wait of a step besides the time of a statement."""

    NOTHING = "nothing"
    TIME = "a time"
    CONDITION = "a condition"
    MOTION = "the end of all motions"
    EVENT = "an event"


class StepEffect(NamedTuple):
    """Effect of a step besides the target of SET: an output or a drive, from 1, or any drive, or everything of the program."""

    output: int | None = None
    drive: int | None = None
    any_drive: bool = False
    everything: bool = False
    """All drives and outputs: the program is over, or begins again."""

    @property
    def on_drives(self) -> bool:
        return self.drive is not None or self.any_drive or self.everything


NO_EFFECT = StepEffect()
_FACTS = ("waits", "sources", "effect", "after")


@dataclass(frozen=True, slots=True)
class ProgramStep:
    """Each class of step says by itself what it waits for, reads and acts on, and what comes after it: one that does not is a
    type error at import."""

    start: int = field(compare=False)
    end: int = field(compare=False)
    waits: ClassVar[StepWait]

    def __init_subclass__(cls) -> None:
        # Not super(): with slots, dataclass makes the class a second time.
        lacking = [fact for fact in _FACTS if fact not in vars(cls)]
        if lacking:
            raise TypeError(f"step {cls.__name__} lacks its {', '.join(lacking)}")

    def sources(self) -> tuple[ValueSource, ...]:
        """Everything it reads."""
        raise NotImplementedError

    def effect(self) -> StepEffect:
        raise NotImplementedError

    def after(self, number: int) -> tuple[int, ...]:
        """Where the step with this number goes on: a branch at two, of which the first is that of a true condition; JUMP at the
        next line, which is reached only if the target can return."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class SetStep(ProgramStep):
    target: AssignmentTarget
    value: ValueSource | Operation | FunctionOperation
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        value = self.value
        if isinstance(value, Operation):
            return value.left, value.right
        return value.arguments if isinstance(value, FunctionOperation) else (value,)

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


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

    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return self.condition.left, self.condition.right

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return number + 1, self.otherwise


@dataclass(frozen=True, slots=True)
class ElseStep(ProgramStep):
    """Reached only from the lines above it: goes on at ``close``, the ENDIF."""

    close: int
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (self.close,)


@dataclass(frozen=True, slots=True)
class EndIfStep(ProgramStep):
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class WhileStep(ProgramStep):
    condition: StepCondition
    close: int
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return self.condition.left, self.condition.right

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return number + 1, self.close + 1


@dataclass(frozen=True, slots=True)
class EndWhileStep(ProgramStep):
    """``condition`` is that of the WHILE at ``open``."""

    condition: StepCondition
    open: int
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (self.open,)


@dataclass(frozen=True, slots=True)
class WaitStep(ProgramStep):
    condition: StepCondition
    waits: ClassVar[StepWait] = StepWait.CONDITION

    def sources(self) -> tuple[ValueSource, ...]:
        return self.condition.left, self.condition.right

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class DelayStep(ProgramStep):
    """At least `SHORTEST_DELAY_S` (WBC-7)."""

    seconds: ValueSource
    waits: ClassVar[StepWait] = StepWait.TIME

    def sources(self) -> tuple[ValueSource, ...]:
        return (self.seconds,)

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class JumpStep(ProgramStep):
    target: int
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class ReturnStep(ProgramStep):
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return ()


@dataclass(frozen=True, slots=True)
class EndStep(ProgramStep):
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return StepEffect(everything=True)

    def after(self, number: int) -> tuple[int, ...]:
        return ()


@dataclass(frozen=True, slots=True)
class ProgResetStep(ProgramStep):
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return StepEffect(everything=True)

    def after(self, number: int) -> tuple[int, ...]:
        return ()


@dataclass(frozen=True, slots=True)
class MotionStep(ProgramStep):
    """HOME, VABS, VREL, PABS or PREL. ``axis`` counts from 1."""

    keyword: str
    axis: int
    value: ValueSource
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return (self.value,)

    def effect(self) -> StepEffect:
        return StepEffect(drive=self.axis)

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class HaltStep(ProgramStep):
    """BRAKE or STOP. ``axis`` counts from 1."""

    keyword: str
    axis: int
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return StepEffect(drive=self.axis)

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class RowMotionStep(ProgramStep):
    """A motion with the parameters of a row of the position table; ``row`` gives its index from 0."""

    keyword: str
    row: ValueSource
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return (self.row,)

    def effect(self) -> StepEffect:
        # The drives of a row are those of its values.
        return StepEffect(any_drive=True)

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class WaitPosStep(ProgramStep):
    waits: ClassVar[StepWait] = StepWait.MOTION

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class PulseStep(ProgramStep):
    """``output`` counts from 1."""

    output: int
    seconds: ValueSource
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return (self.seconds,)

    def effect(self) -> StepEffect:
        return StepEffect(output=self.output)

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class InterruptStep(ProgramStep):
    """An interrupt label. ``hard`` waits for the end of the statement in progress."""

    event: InterruptEvent
    hard: bool
    waits: ClassVar[StepWait] = StepWait.EVENT

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


@dataclass(frozen=True, slots=True)
class IllegalStep(ProgramStep):
    """A line that cannot be executed: an unknown record of an image, or (in a program with errors) a wrong line.

    ``opaque``: where the program goes on after it is not known.
    """

    data: bytes
    opaque: bool
    waits: ClassVar[StepWait] = StepWait.NOTHING

    def sources(self) -> tuple[ValueSource, ...]:
        return ()

    def effect(self) -> StepEffect:
        return NO_EFFECT

    def after(self, number: int) -> tuple[int, ...]:
        return (number + 1,)


STEPS: tuple[type[ProgramStep], ...] = tuple(
    found
    for found in list(globals().values())
    if isinstance(found, type) and issubclass(found, ProgramStep) and found is not ProgramStep
)
"""Every class of step; each needs its code and its record in the image."""


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
