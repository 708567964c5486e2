"""Requests for the arrangement of the machine panel: where axes and elements are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.fields import LONGEST_TEXT, Meaning, Schema, ValueType, check_text, whole, wrong
from steptwin.jsonvalues import JsonForm
from steptwin.simulation.describe.arrangement import MOST_PLACED, MOST_PX, DrawnPosition
from steptwin.studio.requesttype import request

_PIXELS: Schema = {"type": "integer", "minimum": 0, "maximum": MOST_PX}
_CORNER: Schema = {"type": "array", "items": _PIXELS, "minItems": 2, "maxItems": 2}


def _to_json(places: Sequence[DrawnPosition]) -> dict[str, list[int]]:
    return {of: [x, y] for of, x, y in places}


@dataclass(frozen=True, slots=True)
class Drawing:
    """Positions of axes and elements in the machine panel."""

    places: Annotated[Sequence[DrawnPosition], JsonForm({"type": "object", "additionalProperties": _CORNER}, to_json=_to_json)]
    file: Annotated[str | None, "Of the description; null: it is in none."]


@dataclass(frozen=True, slots=True)
class SavedDrawing:
    """The description of a world with its arrangement."""

    file: Annotated[str | None, "What has been written; null: it cannot be written."]
    name: Annotated[str, "For a file."]
    text: Annotated[str, "The description with these places."]


class Arrangement(Protocol):
    """Arrangement of one world."""

    def drawing(self) -> Drawing: ...

    def save(self, places: Sequence[DrawnPosition]) -> SavedDrawing:
        """Raises `Misuse` for what is not there, `Refusal` where the description cannot be changed."""
        ...


def _places(value: Any) -> tuple[DrawnPosition, ...]:
    if not isinstance(value, dict) or len(value) > MOST_PLACED:
        raise wrong(value, PLACES.what)
    return tuple(DrawnPosition(check_text(name), *_corner(corner)) for name, corner in value.items())


def _corner(value: Any) -> tuple[int, int]:
    pixels = whole(0, MOST_PX)
    if not isinstance(value, list) or len(value) != 2:
        raise wrong(value, "[x, y]")
    return pixels.read(value[0]), pixels.read(value[1])


PLACES = ValueType(
    '{"NAME": [X, Y], ...}',
    {
        "type": "object",
        "maxProperties": MOST_PLACED,
        "additionalProperties": _CORNER,
        "propertyNames": {"minLength": 1, "maxLength": LONGEST_TEXT},
    },
    _places,
    _to_json,
)


@request(
    "drawing",
    LOOK,
    "Where the page draws axes and elements: x and y of the upper left corner in pixels, by name. Empty: by itself.",
    Drawing,
)
@dataclass(frozen=True, slots=True)
class ReadDrawing:
    pass


@request(
    "save_drawing",
    SERVICE._replace(control=False),
    "Write these places into the description of the world, as [[drawing]], in the place of those there.",
    SavedDrawing,
)
@dataclass(frozen=True, slots=True)
class SaveDrawing:
    places: Annotated[
        tuple[DrawnPosition, ...],
        Meaning("By the names of axes and elements; 'tool path', 'all buttons'. None: it is drawn by itself.", PLACES),
    ]


DrawingRequest: TypeAlias = ReadDrawing | SaveDrawing
