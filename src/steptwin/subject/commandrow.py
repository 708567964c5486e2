"""The row of a command in the table of commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from steptwin.subject.fields import TEXT, Field


@dataclass(frozen=True, slots=True)
class CommandRow:
    """A command: its name, its class, its fields, and what its answer is."""

    name: str
    kind: Callable[..., Any]
    meaning: str
    answer: str
    fields: tuple[Field, ...] = ()
    is_list: bool = False
    """Whether the answer is a list of what ``answer`` names; without, it is one, or `NOTHING`."""

    @property
    def result(self) -> dict[str, object]:
        """A schema of the answer; the words are its description."""
        if self.answer == NOTHING:
            return {"type": "null"}
        if self.is_list:
            return {"type": "array", "items": {"type": "object"}, "description": self.answer}
        return {"type": "object", "description": self.answer}


MACHINE = Field("machine", TEXT, "The name of a machine.")
NOTHING = "null"
"""The answer of a command without a result."""
