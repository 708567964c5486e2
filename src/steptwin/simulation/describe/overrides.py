"""Parameters of a description that take other values than its text has: ``{"axis.x.pitch": 4.0, "x.motor.load": 0.2}``."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss

Overrides: TypeAlias = Mapping[str, Any]
"""By key with its tables, joined by points. Of several tables of a kind one is chosen by its name, or its number from 0. The kind
can be left out before a name that only one table has."""

NO_OVERRIDES: Overrides = {}
MOST_NAMED = 30
"""Number of names listed in a message."""
_WITH = "with"
"""The table of a use that has the values of its parameters."""


def read_overrides(texts: Iterable[str]) -> Overrides:
    """From texts such as ``x.pitch=4.0``; values as in TOML, others are text. Raises `Misuse`."""
    found: dict[str, Any] = {}
    for text in texts:
        key, sign, value = text.partition("=")
        if not sign or not key.strip():
            raise Misuse(f"--with {text}: expected NAME.KEY=VALUE, such as x.pitch=4.0")
        found[key.strip()] = _value(value.strip())
    return found


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return text


def override(data: dict[str, Any], overrides: Overrides, only: str | None = None) -> Overrides:
    """Put the values into what was read from TOML. Raises `Misuse` for tables that are not there.

    ``only``: those of one kind of table; the others are returned.
    """
    left: dict[str, Any] = {}
    for key, value in overrides.items():
        *tables, last = _whole_path(data, key.split("."), only)
        if only is not None and tables[:1] != [only]:
            left[key] = value
            continue
        inner: Any = data
        for table in tables:
            inner = _inside(inner, table, key)
        if not isinstance(inner, dict) or not tables:
            raise Misuse(f"override {key!r}: expected TABLE.KEY or TABLE.NAME.KEY, such as 'axis.x.pitch'")
        inner[last] = value
    return left


def place_of(data: Mapping[str, Any], key: str) -> tuple[str, ...]:
    """Equal for keys of the same value, in whatever way their tables are chosen."""
    path = key.split(".")
    if path[0] not in data:
        kinds = [kind for kind in data if path[0] in _names(data[kind])]
        path = [*kinds, *path]
    found: list[str] = []
    inner: Any = data
    for part in path[:-1]:
        inner = _known(inner).get(part)
        found.append(inner["name"] if isinstance(inner, dict) and isinstance(inner.get("name"), str) else part)
    return (*found, path[-1])


def _whole_path(data: Mapping[str, Any], path: list[str], only: str | None) -> list[str]:
    """With the kind of table, where it was left out, and with the table of parameters of a use."""
    if path[0] in data or len(path) < 2:
        return path
    kinds = [kind for kind in data if path[0] in _names(data[kind])]
    if len(kinds) > 1:
        raise Misuse(f"override {'.'.join(path)!r}: {path[0]!r} is in {' and '.join(kinds)}: begin with one of these")
    if kinds == [only]:
        use = _inside(data[kinds[0]], path[0], ".".join(path))
        use.setdefault(_WITH, {})
        return [kinds[0], path[0], *([] if path[1] == _WITH else [_WITH]), *path[1:]]
    return [*kinds, *path]


def _names(tables: object) -> Iterator[str]:
    for table in tables if isinstance(tables, list) else ():
        if isinstance(table, dict) and isinstance(table.get("name"), str):
            yield table["name"]


def _some(names: Iterable[str]) -> str:
    """Names for a message, not more than fit into one."""
    shown = list(names)
    return f"{', '.join(shown[:MOST_NAMED])}{' and others' if len(shown) > MOST_NAMED else ''}"


def _inside(holder: Any, wanted: str, key: str) -> Any:
    known = _known(holder)
    if wanted not in known:
        names = known if holder is not known else {**known, **dict.fromkeys(name for of in known.values() for name in _names(of))}
        hint = NearMiss().hint(wanted, names) or (f"; there are {_some(names)}" if names else "")
        raise Misuse(f"override {key!r}: there is no {wanted!r}{hint}")
    return known[wanted]


def _known(holder: Any) -> Mapping[str, Any]:
    """Members of a table, or the tables of a list by their numbers and names."""
    if isinstance(holder, dict):
        return holder
    known: dict[str, Any] = {str(number): table for number, table in enumerate(holder if isinstance(holder, list) else ())}
    return known | {
        table["name"]: table for table in known.values() if isinstance(table, dict) and isinstance(table.get("name"), str)
    }
