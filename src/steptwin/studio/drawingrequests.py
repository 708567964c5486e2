"""Requests for the arrangement of the machine panel: where axes and elements are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.fields import LONGEST_TEXT, Meaning, Schema, ValueType, check_text, whole, wrong
from steptwin.jsonvalues import TEXT, members, or_null
from steptwin.simulation.describe.arrangement import MOST_PLACED, MOST_PX, DrawnPosition
from steptwin.studio.requesttype import request


class Arrangement(Protocol):
    """Arrangement of one world."""

    def to_json(self) -> Mapping[str, object]:
        """As `_DRAWING`."""
        ...

    def save(self, places: Sequence[DrawnPosition]) -> Mapping[str, object]:
        """As `_SAVED`. Raises `Misuse` for what is not there, `Refusal` where the description cannot be changed."""
        ...


_PIXELS: Schema = {"type": "integer", "minimum": 0, "maximum": MOST_PX}
_CORNER: Schema = {"type": "array", "items": _PIXELS, "minItems": 2, "maxItems": 2}


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
    lambda places: {of: [x, y] for of, x, y in places},
)

_FILE: Schema = {**or_null(TEXT), "description": "Of the description; null: it is in none."}
_DRAWING = members({"places": {"type": "object", "additionalProperties": _CORNER}, "file": _FILE})
_SAVED = members(
    {
        "file": {**_FILE, "description": "What has been written; null: it cannot be written."},
        "name": {**TEXT, "description": "For a file."},
        "text": {**TEXT, "description": "The description with these places."},
    }
)


@request(
    "drawing",
    LOOK,
    "Where the page draws axes and elements: x and y of the upper left corner in pixels, by name. Empty: by itself.",
    _DRAWING,
)
@dataclass(frozen=True, slots=True)
class ReadDrawing:
    pass


@request(
    "save_drawing",
    SERVICE._replace(control=False),
    "Write these places into the description of the world, as [[drawing]], in the place of those there.",
    _SAVED,
)
@dataclass(frozen=True, slots=True)
class SaveDrawing:
    places: Annotated[
        tuple[DrawnPosition, ...],
        Meaning("By the names of axes and elements; 'tool path', 'all buttons'. None: it is drawn by itself.", PLACES),
    ]


DrawingRequest: TypeAlias = ReadDrawing | SaveDrawing
