"""Values as users type and read them."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.errors import Misuse
from steptwin.mic488.encoding import shortest_real
from steptwin.numerals import read_number, read_whole


def number_of(value: str, whole: str) -> float:
    """A number as `read_number` reads it. Raises `Misuse` naming ``whole``."""
    try:
        return read_number(value)
    except Misuse as error:
        raise Misuse(f"{whole!r}: {error}") from None


def format_value(value: object) -> str:
    """ON and OFF, and numbers with no more digits than a REAL has."""
    if isinstance(value, bool):
        return "ON" if value else "OFF"
    return shortest_real(value) if isinstance(value, float) else str(value)


def axis_of(text: str, axes: int) -> int:
    """``1`` or ``M1`` of so many axes. Raises `Misuse`."""
    number = read_whole(text.strip().upper().removeprefix("M"))
    if number is None or not 1 <= number <= axes:
        last = "" if axes == 1 else f" to {axes}"
        raise Misuse(f"{text!r} is not an axis: permitted are 1{last}, or M1{last and f' to M{axes}'}")
    return number


def tied(texts: Sequence[str], axes: int) -> dict[int, float]:
    """``1=12.5 M2=-3`` as numbers by axis. Raises `Misuse`."""
    values: dict[int, float] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise Misuse(f"{text!r}: expected AXIS=NUMBER, such as 1=12.5 or M1=12.5")
        axis = axis_of(name, axes)
        if axis in values:
            raise Misuse(f"{text!r}: M{axis} is given twice")
        values[axis] = number_of(value, text)
    return values


def changes_of(texts: Sequence[str], example: str) -> list[tuple[str, str, str]]:
    """Name, value and whole text of each ``NAME=VALUE``. Raises `Misuse`."""
    found = []
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise Misuse(f"{text!r}: expected NAME=VALUE, such as {example}")
        found.append((name.strip(), value.strip(), text))
    return found
