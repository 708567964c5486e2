"""Snippets in descriptions of worlds: tables with the keys that they need, keys and steps with a place for the value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import count
from typing import Any

from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.values import ValueReader, Word, flag

_TEXTS = ("x", "x.M1", "x.IN1", "x.OUT1", "x > 1", "1 s")
"""One of them is read by every key that takes text."""
_LEVELS = {"x.IN1": 1}
_LISTS: tuple[Any, ...] = ([0, 0, 0], [1, 1, 1], [1, 1], ["x"], ["x", "x"], [["x", "x"]], ["+x", "+y"])
"""The first of them that is read by a key of a list with a fixed length."""


def table_snippet(written: str, keys: Sequence[Key]) -> str:
    """A table with the keys that it needs, each with a tab stop, and the last stop below them."""
    lines = [f"{key.name} = {value_snippet(key, number)}" for number, key in enumerate(keys, 1) if key.is_required]
    return "\n".join([written, *lines, "$0"])


@cache
def value_snippet(key: Key, stop: int) -> str:
    """A tab stop for the value of a key: between quotation marks if it takes text, with the words that it can be; one for each
    item of a list whose length is known."""
    words = _words(key)
    if words:
        return f'"${{{stop}|{",".join(words)}|}}"'
    if key.read is flag:
        return f"${{{stop}|true,false|}}"
    if any(_takes(key, text) for text in _TEXTS):
        return f'"${stop}"'
    if _takes(key, _LEVELS):
        return f'{{ "${stop}" = ${{{stop + 1}:1}} }}'
    if not any(_takes(key, other) for other in (1, [0])):
        found = next((one for one in _LISTS if _takes(key, one)), None)
        if found is not None:
            return _list_snippet(found, count(stop))
    return f"${stop}"


def _words(key: Key) -> tuple[str, ...]:
    """Those of which a key takes one."""
    words = key.read.words if isinstance(key.read, Word | ValueReader) else ()
    return words if words and _takes(key, words[0]) else ()


def _list_snippet(value: Any, stops: Iterator[int]) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_list_snippet(one, stops) for one in value)}]"
    return f'"${next(stops)}"' if isinstance(value, str) else f"${{{next(stops)}:{value}}}"


def _takes(key: Key, value: Any) -> bool:
    try:
        key.read(value)
    except (Misuse, TypeError, AttributeError):
        return False
    return True
