"""What a compiled command is: a closure over its chip that does it and returns the place of the next one.

Each part of the language enters its makers into a table of its own, by the name of the command's row in the command table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, NoReturn, TypeAlias

if TYPE_CHECKING:
    from steptwin.m1486.chip import M1486

Effect: TypeAlias = Callable[[], int]
Maker: TypeAlias = "Callable[[M1486, int, int, int], Effect]"
"""Takes the chip, the command's number (0 for none), its place and the place after it."""


class WrongData(Exception):
    """The command is dropped, and the program stops unless function 44 is ON (M-11). The text says why."""


class Making(NamedTuple):
    """How a command is made. ``computes``: it needs no clock and shows nothing. ``is_linked``: it knows where a label is."""

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
    """A command that can only be wrong data."""

    def run() -> NoReturn:
        raise WrongData(why)

    return run
