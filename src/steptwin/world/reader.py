"""Reads tables of TOML against rows that say what is permitted. All problems are told at once, each with file, line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isnan
from typing import Any

from steptwin.diagnostics import Diagnostic, Severity, Source, Span, in_order, render
from steptwin.errors import Misuse
from steptwin.wbc.nearmiss import NearMiss
from steptwin.world.durations import duration
from steptwin.world.names import Unknown
from steptwin.world.tomlplaces import Path, TooMuch, find_places

_MISSING: Any = object()
NAMED = ("line", "mic488", "m1486", "axis", "button")
"""Tables with names that others refer to."""
MOST_FINDINGS = 100
"""After so many nobody reads on."""
_LONGEST_MESSAGE = 400
MOST = 1e300
"""Numbers beyond it would overflow in products."""
_WHOLE = range(-(1 << 63), 1 << 63)


class WorldError(Misuse):
    """A description of a world with errors; the text shows them all."""

    def __init__(self, source: Source, findings: Sequence[Diagnostic]) -> None:
        self.source = source
        self.findings = in_order(findings)
        super().__init__(render(source, self.findings))


class Text:
    """A TOML text that knows where its keys are, and collects what is wrong with them."""

    def __init__(self, name: str, text: str) -> None:
        """Raises `WorldError` for a text that is no TOML."""
        self.source = Source(name, text)
        self.findings: list[Diagnostic] = []
        self._near = NearMiss()
        self._spans: dict[Path, Span] = {}
        self._wrong: set[Path] = set()
        """What is wrong, as it was told; tables of these are not looked at further."""
        self._left_out: set[str] = set()
        try:
            self._spans = find_places(text)
            self.data: dict[str, Any] = tomllib.loads(text)
        except TooMuch as error:
            self.wrong_at(error.span, "D001", str(error))
            raise self.error() from None
        except tomllib.TOMLDecodeError as error:
            place = re.search(r"line (\d+), column (\d+)", str(error))
            start = len(text)
            if place is not None:
                lines = text.splitlines(keepends=True)
                start = min(sum(map(len, lines[: int(place[1]) - 1])) + int(place[2]) - 1, len(text))
            message = str(error).split(" (at ")[0]
            self.wrong_at(Span(start, min(start + 1, len(text))), "D001", f"this is no TOML: {message}")
            raise self.error() from None
        except (RecursionError, ValueError):
            self.wrong_at(Span(0, 0), "D001", "this is no TOML of a world: it is nested too deeply, or a number is too long")
            raise self.error() from None
        self._check_numbers((), self.data)

    def _check_numbers(self, path: Path, value: object) -> None:
        """TOML's whole numbers have 64 bits; `tomllib` takes any."""
        if isinstance(value, dict):
            for name, item in value.items():
                self._check_numbers((*path, name), item)
        elif isinstance(value, list):
            for number, item in enumerate(value):
                self._check_numbers((*path, number), item)
        elif isinstance(value, int) and value not in _WHOLE:
            self.wrong(path, "D001", "a whole number of more than 64 bits")
            raise self.error()

    def wrong_at(self, span: Span, code: str, message: str, hint: str | None = None) -> None:
        """Raises `WorldError` when there is more wrong than anybody reads."""
        if len(message) > _LONGEST_MESSAGE and "\n" not in message:
            message = f"{message[: _LONGEST_MESSAGE - 61]}…{message[-60:]}"
        self.findings.append(Diagnostic(code, Severity.ERROR, span, message, hint))
        if len(self.findings) >= MOST_FINDINGS:
            raise self.error()

    def wrong(self, path: Path, code: str, message: str, hint: str | None = None) -> None:
        """Something is wrong with the value at ``path``, or with what holds it."""
        self._wrong.add(path)
        if (*path, 0) in self._spans and path not in self._spans:
            path = *path, 0
        while path and path not in self._spans:
            path = path[:-1]
        self.wrong_at(self._spans.get(path, Span(0, 0)), code, message, hint)

    def wrong_reference(self, path: Path, error: Misuse, place: str = "") -> None:
        """What is at ``path`` does not fit the rest. Not told where it only follows from something else that is wrong."""
        if not (isinstance(error, Unknown) and self.may_be_broken(error.name)):
            self.wrong(path, "D009", f"{place}{error}")

    def is_wrong(self, path: Path) -> bool:
        """Whether something is wrong with the value at ``path`` or in it."""
        return any(wrong[: len(path)] == path for wrong in self._wrong)

    def is_any_wrong(self, *kinds: str) -> bool:
        """Whether something is wrong with tables of these kinds."""
        return any(wrong[0] in kinds for wrong in self._wrong if wrong)

    def leave_out(self, name: str) -> None:
        """What has this name is not built because of what is wrong elsewhere."""
        self._left_out.add(name)

    def may_be_broken(self, name: str) -> bool:
        """Whether this is the name of a table with something wrong in it, or may be, because such a table has none."""
        if name in self._left_out:
            return True
        for kind, number in {(wrong[0], wrong[1]) for wrong in self._wrong if len(wrong) > 1}:
            tables = self.data.get(str(kind))
            table = tables[number] if isinstance(tables, list) and isinstance(number, int) else None
            found = table.get("name") if isinstance(table, dict) else None
            if found == name or (kind in NAMED and not isinstance(found, str)):
                return True
        return False

    def line(self, path: Path) -> int:
        """The line (from 1) of a value, or of what holds it."""
        while path and path not in self._spans:
            path = path[:-1]
        return self.source.position(self._spans[path].start)[0] if path else 1

    def near(self, word: str, known: Iterable[str]) -> str:
        found = self._near.of(word, known)
        return "" if found is None else f"; did you mean {found!r}?"

    def error(self) -> WorldError:
        return WorldError(self.source, self.findings)

    def check(self) -> None:
        """`WorldError` if anything was wrong."""
        if self.findings:
            raise self.error()


# ---------------------------------------------------------------------- rows


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a table: how its value is read (raising `Misuse` with what is permitted), and what holds without it."""

    name: str
    read: Callable[[Any], Any]
    meaning: str
    default: Any = _MISSING
    attribute: str = ""
    """The attribute it becomes, where that is not its name."""

    @property
    def is_required(self) -> bool:
        return self.default is _MISSING


def read_table(text: Text, path: Path, value: object, keys: Sequence[Key], also: Iterable[str] = ()) -> dict[str, Any]:
    """The values of a table by attribute; what is wrong is told to ``text``. Keys in ``also`` are read elsewhere."""
    values: dict[str, Any] = {key.attribute or key.name: key.default for key in keys if not key.is_required}
    what = _what(path)
    if not isinstance(value, Mapping):
        text.wrong(path, "D002", f"{what} is {value!r}", "expected a table")
        return values
    known = {key.name: key for key in keys}
    permitted = [*known, *also]
    for name, given in value.items():
        key = known.get(name)
        if key is not None:
            try:
                values[key.attribute or key.name] = key.read(given)
            except Misuse as error:
                text.wrong((*path, name), "D003", f"{what}: {name}: {error}", key.meaning)
        elif name not in also:
            near = text.near(name, permitted)
            text.wrong((*path, name), "D004", f"{what} has no {name!r}{near}", f"permitted: {_listed(known, also)}")
    for key in keys:
        if key.is_required and key.name not in value:
            text.wrong(path, "D005", f"{what}: {key.name} is missing", key.meaning)
    return values


_MANY = 5


def _listed(known: Iterable[str], also: Iterable[str]) -> str:
    """Keys for people; of the many numbered tables of a controller the first and last."""
    others = list(also)
    names = {name.rstrip("0123456789") for name in others}
    if len(others) > _MANY:
        ends = [[other for other in others if other.rstrip("0123456789") == name] for name in sorted(names)]
        others = [f"{group[0]} to {group[-1]}" for group in ends]
    return ", ".join([*known, *others])


def _what(path: Path) -> str:
    names = [str(part) for part in path if isinstance(part, str)]
    return f"[{'.'.join(names)}]" if names else "the file"


# ---------------------------------------------------------------------- kinds of values


def text_value(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise Misuse(f"{value!r}: expected a text{' that is not empty' if isinstance(value, str) else ''}")
    return value


_NAME = re.compile(r"[A-Za-z_][\w-]*\Z", re.ASCII)


def name_value(value: Any) -> str:
    if not isinstance(value, str) or not _NAME.match(value):
        raise Misuse(f"{value!r} is no name: expected a letter from A to Z, then letters, digits, '-' and '_'")
    return value


def flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise Misuse(f"{value!r}: expected true or false")
    return value


def number(least: float | None = None, most: float | None = None, *, above: bool = False) -> Callable[[Any], float]:
    """A number from ``least`` (not itself with ``above``) to ``most``."""

    def read(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or (isinstance(value, float) and isnan(value)):
            raise Misuse(f"{value!r}: expected a number")
        if abs(value) > MOST:
            raise Misuse(f"{value!r}: permitted are numbers from {-MOST:g} to {MOST:g}")
        low = least is not None and (value <= least if above else value < least)
        if low or (most is not None and value > most):
            bounds = (f"above {least:g}" if above else f"from {least:g}") if least is not None else ""
            raise Misuse(f"{value!r}: permitted are numbers {bounds}{f' to {most:g}' if most is not None else ''}")
        return float(value)

    return read


def whole(least: int, most: int) -> Callable[[Any], int]:
    def read(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise Misuse(f"{value!r}: permitted are whole numbers from {least} to {most}")
        return value

    return read


def word(*words: str) -> Callable[[Any], str]:
    def read(value: Any) -> str:
        if value not in words:
            near = NearMiss().of(value, words) if isinstance(value, str) else None
            raise Misuse(f"{value!r}: permitted are {', '.join(words)}{'' if near is None else f'; did you mean {near!r}?'}")
        return value

    return read


def time_value(value: Any) -> int:
    return duration(value)


def positive_time(value: Any) -> int:
    found = duration(value)
    if found == 0:
        raise Misuse(f"{value!r}: must be more than 0")
    return found


def banks_value(value: Any) -> tuple[tuple[int, str], ...]:
    """Files by bank: a text is for bank 0, a list for 0, 1 …, a table names the banks."""
    if isinstance(value, str):
        return ((0, text_value(value)),)
    if isinstance(value, list):
        return tuple((bank, text_value(name)) for bank, name in enumerate(value))
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected a file, a list of files, or files by bank such as {{ 3 = 'file' }}")
    for bank in value:
        if not (bank.isascii() and bank.isdecimal() and len(bank) < 4) or (len(bank) > 1 and bank[0] == "0"):
            raise Misuse(f"{bank!r} is no bank: expected a number from 0 on")
    return tuple(sorted((int(bank), text_value(name)) for bank, name in value.items()))


def pair(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [low, high]")
    low, high = (number()(item) for item in value)
    if low >= high:
        raise Misuse(f"{value!r}: the first must be below the second")
    return low, high


def points(value: Any) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not value or any(not isinstance(item, list) or len(item) != 2 for item in value):
        raise Misuse(f"{value!r}: expected [[x, y], [x, y], ...]")
    found = tuple((number()(x), number()(y)) for x, y in value)
    if any(a[0] >= b[0] for a, b in pairwise(found)):
        raise Misuse(f"{value!r}: the first numbers must grow")
    return found


def pin_name(value: Any) -> tuple[str, str]:
    """``MACHINE.PIN``."""
    machine, dot, pin = value.partition(".") if isinstance(value, str) else ("", "", "")
    if not dot or not machine or not pin:
        raise Misuse(f"{value!r}: expected MACHINE.PIN, such as 'table.IN3'")
    return machine, pin.upper()
