"""The programs of a subject, as viewers are shown them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from steptwin.explain.model import MemoryUse
from steptwin.simulation.world.worldprograms import ShownProgram, ShownProgramText


class ProgramTexts(Protocol):
    """The texts of programs that the controllers of a subject were given."""

    def list(self) -> Sequence[ShownProgram]: ...

    def text(self, controller: str, place: str) -> ShownProgramText:
        """Raises `Misuse` where there is none."""
        ...

    def memory(self, controller: str, place: str, text: str) -> Sequence[MemoryUse]:
        """Use of the memory at a place by a text; empty for one with errors. Raises `Misuse` where there is no place."""
        ...

    def files(self) -> Mapping[str, bytes]:
        """For editors: texts, and what belongs together, by address."""
        ...
