"""``[[drawing]]``: where the machine panel of the studio draws axes and elements. The studio writes these tables on request."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from steptwin.errors import Misuse, Refusal
from steptwin.simulation.toml.names import Unknown
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import permitting, text_value, whole

DRAWING = "drawing"
OTHERS = ("tool path", "all buttons")
"""Drawn parts besides axes and elements. With a space, which no name has."""
MOST_PX = 20_000
MOST_PLACED = 1000
_PIXELS = whole(0, MOST_PX)


class DrawnPosition(NamedTuple):
    """``x`` and ``y`` of the upper left corner, from that of the panel. [pixels of CSS]"""

    of: str
    x: int
    y: int


@permitting("[x, y], whole numbers")
def _corner(value: Any) -> tuple[int, int]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [x, y]")
    x, y = map(_PIXELS, value)
    return x, y


@table(f"[[{DRAWING}]]")
class DrawingSpec(TableSpec):
    of: str = key(text_value, f"an axis, an element, {' or '.join(map(repr, OTHERS))}")
    at: tuple[int, int] = key(
        _corner, "its upper left corner in the machine panel of the studio, [x, y] in pixels; the studio writes it"
    )


def check_drawing(text: TomlText, positions: Iterable[DrawingSpec], names: Iterable[str]) -> None:
    """Report places of what is not there, and second ones. ``names``: of axes and elements."""
    known, seen = {*names, *OTHERS}, set[str]()
    for one in positions:
        of, path = one.of, (*one.path, "of")
        if of not in known:
            near = text.near(of, known)
            text.wrong_reference(path, Unknown(of, f"no axis or element is called {of!r}{near}"))
        elif of in seen:
            text.wrong(path, "D006", f"there is a [[{DRAWING}]] of {of!r} already")
        seen.add(of)


_HEAD = re.compile(r"\s*\[\[\s*drawing\s*\]\]\s*(#.*)?$")
_KEY = re.compile(r"\s*(of|at)\s*=")


def arranged(text: str, positions: Sequence[DrawnPosition]) -> str:
    """A description with these places instead of its own; all else stays as it is.

    Raises `Refusal` where its own are written in a way that is not recognized.
    """
    end = "\r\n" if "\r\n" in text else "\n"
    kept = "".join(_without(text.splitlines(keepends=True))).rstrip()
    tables = [[f"[[{DRAWING}]]", f"of = {json.dumps(of, ensure_ascii=False)}", f"at = [{x}, {y}]"] for of, x, y in positions]
    found = end.join([kept, *("" if not lines else end + end.join(lines) for lines in tables)]) + end
    wanted = {**tomllib.loads(text), DRAWING: [{"of": of, "at": [x, y]} for of, x, y in positions]}
    if _values({DRAWING: []}, found) != wanted:
        raise Refusal(f"the [[{DRAWING}]] tables of the description are written in another form: remove them first")
    return found


def _values(default: Mapping[str, Any], text: str) -> Mapping[str, Any] | None:
    with suppress(tomllib.TOMLDecodeError):
        return {**default, **tomllib.loads(text)}
    return None


def _without(lines: Iterable[str]) -> Iterator[str]:
    """Without the tables of places. Other lines among them, such as comments, stay."""
    is_inside = False
    for line in lines:
        if _HEAD.match(line):
            is_inside = True
        elif line.lstrip().startswith("["):
            is_inside = False
            yield line
        elif not (is_inside and _KEY.match(line)):
            yield line
