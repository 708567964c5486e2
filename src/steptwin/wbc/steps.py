"""A program resolved for execution: one step per executable line, every name replaced by what it stands for.

Step numbers are the slot numbers of the compiled image: labels take no step, interrupt labels do. Targets are step numbers.
``start`` and ``end`` of a step are the place of its statement in the source; steps compare by what they do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from steptwin.wbc.events import Event
from steptwin.wbc.registers import RegisterRow


@dataclass(frozen=True, slots=True)
class Literal:
    value: float


@dataclass(frozen=True, slots=True)
class Variable:
    """``index`` counts the variables of the program from 0."""

    index: int
    name: str


@dataclass(frozen=True, slots=True)
class Register:
    """``number`` is the number in the name (``OUT3`` → 3, ``$D10`` → 10), 0 for a single register."""

    row: RegisterRow
    number: int

    @property
    def name(self) -> str:
        return f"{self.row.name}{self.number}" if self.row.last or self.row.words else self.row.name


Source: TypeAlias = Literal | Variable | Register
Target: TypeAlias = Variable | Register


@dataclass(frozen=True, slots=True)
class Comparison:
    """``sign`` is one of ``= < > <= >=``."""

    left: Source
    sign: str
    right: Source


@dataclass(frozen=True, slots=True)
class Operation:
    left: Source
    operator: str
    right: Source


@dataclass(frozen=True, slots=True)
class Function:
    """``name`` is in upper case."""

    name: str
    arguments: tuple[Source, ...]


@dataclass(frozen=True, slots=True)
class Step:
    start: int = field(compare=False)
    end: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Set(Step):
    target: Target
    value: Source | Operation | Function


@dataclass(frozen=True, slots=True)
class If(Step):
    """``middle`` is the step of ELSE, None without one; ``close`` that of ENDIF."""

    condition: Comparison
    middle: int | None
    close: int

    @property
    def otherwise(self) -> int:
        """Where it goes on when the condition is false."""
        return (self.close if self.middle is None else self.middle) + 1


@dataclass(frozen=True, slots=True)
class Else(Step):
    """Reached only from the lines above it: goes on at ``close``, the ENDIF."""

    close: int


@dataclass(frozen=True, slots=True)
class EndIf(Step):
    pass


@dataclass(frozen=True, slots=True)
class While(Step):
    condition: Comparison
    close: int


@dataclass(frozen=True, slots=True)
class EndWhile(Step):
    """``condition`` is that of the WHILE at ``open``."""

    condition: Comparison
    open: int


@dataclass(frozen=True, slots=True)
class Wait(Step):
    condition: Comparison


@dataclass(frozen=True, slots=True)
class Delay(Step):
    seconds: Source


@dataclass(frozen=True, slots=True)
class Jump(Step):
    target: int


@dataclass(frozen=True, slots=True)
class Return(Step):
    pass


@dataclass(frozen=True, slots=True)
class End(Step):
    pass


@dataclass(frozen=True, slots=True)
class ProgReset(Step):
    pass


@dataclass(frozen=True, slots=True)
class Motion(Step):
    """HOME, VABS, VREL, PABS or PREL. ``axis`` counts from 1."""

    keyword: str
    axis: int
    value: Source


@dataclass(frozen=True, slots=True)
class Halt(Step):
    """BRAKE or STOP. ``axis`` counts from 1."""

    keyword: str
    axis: int


@dataclass(frozen=True, slots=True)
class RowMotion(Step):
    """A motion with the parameters of a row of the position table; ``row`` gives its index from 0."""

    keyword: str
    row: Source


@dataclass(frozen=True, slots=True)
class WaitPos(Step):
    pass


@dataclass(frozen=True, slots=True)
class Pulse(Step):
    """``output`` counts from 1."""

    output: int
    seconds: Source


@dataclass(frozen=True, slots=True)
class Entry(Step):
    """An interrupt label. ``hard`` waits for the end of the statement in progress."""

    event: Event
    hard: bool


@dataclass(frozen=True, slots=True)
class Illegal(Step):
    """A line that cannot be executed: an unknown record of an image, or (in a program with errors) a wrong line.

    ``opaque``: where the program goes on after it is not known.
    """

    data: bytes
    opaque: bool


STEPS: tuple[type[Step], ...] = tuple(
    found for found in list(globals().values()) if isinstance(found, type) and issubclass(found, Step) and found is not Step
)
"""Every class of step; each needs its code, what it reads, and where it goes on."""


@dataclass(frozen=True, slots=True)
class Executable:
    """``variables`` in the order of their indices; ``labels`` by name in upper case; ``entries`` steps of interrupt labels;
    ``position_records`` rows of the image that replace those of the table."""

    steps: tuple[Step, ...]
    variables: tuple[str, ...]
    labels: Mapping[str, int]
    entries: Mapping[Event, int]
    position_records: Mapping[int, bytes]
