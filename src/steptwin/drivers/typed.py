"""Values as users type and read them."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.errors import Misuse
from steptwin.mic488.encoding import shortest_real


def number_of(value: str, whole: str) -> float:
    """A number with a point or a comma, or hexadecimal. Raises `Misuse` naming ``whole``."""
    value = value.strip()
    try:
        return int(value, 16) if value.lower().startswith("0x") else float(value.replace(",", "."))
    except ValueError:
        raise Misuse(f"{whole!r}: {value!r} is not a number") from None


def shown(value: object) -> str:
    """ON and OFF, and numbers with no more digits than a REAL has."""
    if isinstance(value, bool):
        return "ON" if value else "OFF"
    return shortest_real(value) if isinstance(value, float) else str(value)


def axis_of(text: str, axes: int) -> int:
    """``1`` or ``M1`` of so many axes. Raises `Misuse`."""
    number = text.strip().upper().removeprefix("M")
    if not number.isdecimal() or not 1 <= int(number) <= axes:
        last = "" if axes == 1 else f" to {axes}"
        raise Misuse(f"{text!r} is not an axis: permitted are 1{last}, or M1{last and f' to M{axes}'}")
    return int(number)


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
