"""Declaration of the commands that a simulation takes from outside, and of their fields (`steptwin.fields`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from steptwin.fields import LONGEST_TEXT, MOST_ITEMS, TEXT, RequestType, ValueType, check_text, fields_of, number, wrong
from steptwin.messages import Message
from steptwin.simulation.faults import Fault
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.toml.values import pin_name

_Kind = TypeVar("_Kind")

NOTHING = "null"
"""The answer of a command without a result."""
UNITS = "units of the data sheet"
"""Unit of fields that are in the unit of their axis."""


@dataclass(frozen=True, slots=True)
class CommandType(RequestType):
    """A command, and what its answer is, in words."""

    answer: str
    is_list: bool
    """Whether the answer is a list of what ``answer`` names; without, it is one, or `NOTHING`."""

    @property
    def result(self) -> dict[str, object]:
        """A schema of the answer; the words are its description."""
        if self.answer == NOTHING:
            return {"type": "null"}
        if self.is_list:
            return {"type": "array", "items": {"type": "object"}, "description": self.answer}
        return {"type": "object", "description": self.answer}


_TYPES: dict[object, CommandType] = {}


def command(name: str, meaning: str, answer: str = NOTHING, *, is_list: bool = False) -> Callable[[type[_Kind]], type[_Kind]]:
    """Declares a command: a dataclass or a named tuple whose attributes are its fields. Raises `TypeError` as `fields_of`."""

    def declare(kind: type[_Kind]) -> type[_Kind]:
        _TYPES[kind] = CommandType(name, kind, meaning, fields_of(kind), answer, is_list)
        return kind

    return declare


def declared(kind: type) -> CommandType:
    """The declaration of a class of commands. Raises `KeyError` for one that has none."""
    return _TYPES[kind]


def _levels(value: Any) -> tuple[tuple[str, str, float], ...]:
    if not isinstance(value, dict) or not 0 < len(value) <= MOST_ITEMS:
        raise wrong(value, LEVELS.what)
    level = number()
    return tuple((*pin_name(check_text(name)), level.read(one)) for name, one in value.items())


LEVELS = ValueType(
    '{"CONTROLLER.NAME": NUMBER, ...}',
    {
        "type": "object",
        "minProperties": 1,
        "maxProperties": MOST_ITEMS,
        "additionalProperties": {"type": "number"},
        "propertyNames": {"pattern": "^[^.]+[.].+$", "maxLength": LONGEST_TEXT},
    },
    _levels,
    lambda levels: {f"{controller}.{name}": value for controller, name, value in levels},
)


def _fault(value: Any) -> Fault:
    return read_fault(TEXT.read(value))


A_FAULT = Message("simulation.a-fault", "a fault such as 'crc unit=1 nth=3'")
FAULT = ValueType(A_FAULT(), TEXT.schema, _fault, str)
