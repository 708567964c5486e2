"""Requests for places in the description: of elements in space, and of strips in the machine panel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.fields import LONGEST_TEXT, Meaning, Schema, ValueType, check_text, number, whole, wrong
from steptwin.jsonvalues import JsonForm
from steptwin.simulation.components.mount import FARTHEST_MM
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
    """The description of a world with places that were changed."""

    file: Annotated[str | None, "What has been written; null: it cannot be written."]
    name: Annotated[str, "For a file."]
    text: Annotated[str, "The description with these places."]


@dataclass(frozen=True, slots=True)
class WrittenPlace:
    """The place of an element in the text of the description, and another one."""

    at: Annotated[tuple[float, float, float], "Where the description has it on what carries it, without the change [mm]"]
    line: Annotated[int, "Of the description"]
    old: Annotated[str, "What is there; empty: there is no such key"]
    new: Annotated[str, "What is to be there"]
    problems: Annotated[tuple[str, ...], "What would be found wrong with the description that is not now"]
    saved: Annotated[SavedDrawing | None, "null: nothing was to be written"]


class Arrangement(Protocol):
    """Places in the description of one world."""

    def drawing(self) -> Drawing: ...

    def save(self, places: Sequence[DrawnPosition]) -> SavedDrawing:
        """Raises `Misuse` for what is not there, `Refusal` where the description cannot be changed."""
        ...

    def place(self, name: str, at: Sequence[float] | None, *, write: bool) -> WrittenPlace:
        """Raises as `save`."""
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


_MM = number(-FARTHEST_MM, FARTHEST_MM)


def _point(value: Any) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise wrong(value, POINT.what)
    return tuple(map(_MM.read, value))


POINT = ValueType("[x, y, z]", {"type": "array", "items": _MM.schema, "minItems": 3, "maxItems": 3}, _point, list)


@request(
    "place",
    SERVICE._replace(control=False),
    "Put an element elsewhere in the description, of which only numbers are changed. The world itself stays as it is.",
    WrittenPlace,
)
@dataclass(frozen=True, slots=True)
class Place:
    name: Annotated[str, Meaning("Of the element.")]
    at: Annotated[tuple[float, ...] | None, Meaning("On what carries it; without it: where it is.", POINT, unit="mm")] = None
    write: Annotated[bool, Meaning("Without it, it is only said what would be written, and what would be wrong then.")] = False


DrawingRequest: TypeAlias = ReadDrawing | SaveDrawing | Place
