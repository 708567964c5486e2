"""Compiled commands: closures over their chip that execute a command and return the place of the next one.

Each part of the language enters its makers into a table of its own, by the name of the command's row in the command table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, NoReturn, Protocol, TypeAlias

from steptwin.controller import Fact, Nanos
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.lines import Interface
from steptwin.m1486.memory import CommandMemory
from steptwin.m1486.pins import ChipPins
from steptwin.m1486.uart import Uart
from steptwin.m1486.unit import NumericUnit
from steptwin.m1486.variants import Variant


class ProgramFlow(Protocol):
    """The state of a program: loops and call in progress, present wait. See `steptwin.m1486.program`."""

    loop_starts: list[int]
    loop_counts: list[int]
    back: int | None

    def wait_until(self, moment: Nanos) -> None: ...
    def wait_for_line(self, line: int, level: int) -> None: ...


class Mover(Protocol):
    """Starts motions. False: one is in progress, and the command waits for its end."""

    def move(self, now: Nanos) -> bool: ...
    def seek(self, line: int, direction: int, now: Nanos) -> bool: ...


class CommandHost(Protocol):
    """The interface of a chip to its commands, each at its moment ``now``."""

    @property
    def variant(self) -> Variant: ...
    @property
    def interface(self) -> Interface: ...
    @property
    def unit(self) -> NumericUnit: ...
    @property
    def memory(self) -> CommandMemory: ...
    @property
    def drive(self) -> ChipDrive: ...
    @property
    def io(self) -> ChipPins: ...
    @property
    def uart(self) -> Uart: ...
    @property
    def program(self) -> ProgramFlow: ...
    @property
    def motor(self) -> Mover: ...
    def level(self, line: int, now: Nanos) -> int: ...
    def read(self, lines: range, now: Nanos) -> int: ...
    def refuse_occupied(self, line: int) -> None: ...
    def put_out(self, lines: range, bits: int, now: Nanos) -> None: ...
    def switch(self, function: int, on: bool, now: Nanos) -> None: ...
    def upload(self, number: int, byte: int, now: Nanos) -> None: ...
    def event(self, code: str, text: str, now: Nanos, *facts: Fact) -> None: ...


Effect: TypeAlias = Callable[[Nanos], int]
"""Called with the moment of the command."""
Maker: TypeAlias = Callable[[CommandHost, int, int, int], Effect]
"""Takes the chip, the command's number (0 for none), its place and the place after it."""


class WrongData(Exception):
    """The command is dropped, and the program stops unless function 44 is ON (M-11). The text has the reason."""


class Making(NamedTuple):
    """How a command is compiled. ``computes``: it neither depends on time nor has visible effects. ``is_linked``: it contains
    the place of a label."""

    make: Maker
    computes: bool
    is_linked: bool


class Makers(dict[str, Making]):
    """The commands of one part of the language."""

    def does(self, *names: str, computes: bool = False, is_linked: bool = False) -> Callable[[Maker], Maker]:
        """Enter the decorated maker for the commands called ``names``."""

        def enter(maker: Maker) -> Maker:
            for name in names:
                self[name] = Making(maker, computes, is_linked)
            return maker

        return enter


def refusing(why: str) -> Effect:
    """A command that is always wrong data."""

    def run(now: Nanos) -> NoReturn:
        raise WrongData(why)

    return run
