"""The search for devices on lines, for the command line and the studio."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from steptwin.drivers.kind import AnyDriverKind, DeviceSearch, FoundDevice
from steptwin.drivers.kinds import DRIVERS, clear_line
from steptwin.errors import LineFailure, Misuse
from steptwin.live.twins import address_of
from steptwin.numerals import read_whole

ANY = "any"
SearchProgress: TypeAlias = Callable[[str, int, str], AbstractContextManager[Callable[[int], object]]]
"""Called with what is searched for, how many there are to try, and the format of their numbers; then with each number that is
tried. An exception of it ends the search."""


@dataclass(frozen=True, slots=True)
class FoundAt:
    """A device at an address; ``baud`` is None on a network."""

    place: str
    baud: int | None
    kind: AnyDriverKind
    found: FoundDevice

    @property
    def device(self) -> str:
        """Its address, as ``--device`` takes it."""
        how = self.kind.selection
        baud = "" if self.baud is None else f",baud={self.baud}"
        return f"{self.place}{baud},{how.option}={how.show(self.found.number)}"

    def text(self) -> tuple[str, ...]:
        how = self.kind.selection
        return self.place, f"{self.baud or ''}", f"{how.option} {how.show(self.found.number)}", self.found.what

    def data(self) -> dict[str, Any]:
        how, found = self.kind.selection, self.found
        where = {"address": self.place, "baud": self.baud, "kind": self.kind.name}
        return {**where, how.option: found.number, how.variant: found.variant, "what": found.what}


def kinds_named(name: str, option: str) -> list[AnyDriverKind]:
    """The kinds to be searched, in this order: first those whose search disturbs no others. ``name``: one of them, or any.

    Raises `Misuse`.
    """
    searched = {kind.name: kind for kind in DRIVERS.values() if kind.search is not None}
    if name != ANY and name not in searched:
        raise Misuse(f"{option} {name}: permitted are {ANY}, {', '.join(searched)}")
    wanted = searched.values() if name == ANY else [searched[name]]
    return sorted(wanted, key=lambda kind: kind.search is not None and kind.search.disturbs)


def found_at(
    place: str,
    kinds: list[AnyDriverKind],
    numbers: list[int],
    bauds: list[int] | None,
    timeout: float,
    *,
    progress: SearchProgress,
    report: Callable[[str], object],
) -> list[FoundAt]:
    """The devices that respond at an address, of the first kind that does. An address that cannot be opened is reported and
    gives none. ``HOST:PORT`` is what it is for ``--device``."""
    try:
        place = address_of(place)
    except LineFailure as failure:
        report(str(failure))
        return []
    searches = [(kind, kind.search, _rates(place, bauds or list(kind.search.bauds))) for kind in kinds if kind.search]
    rows: list[FoundAt] = []
    try:
        for kind, search, rates in searches:
            rows = rows or _searched(place, kind, search, rates, numbers, timeout, progress)
    except LineFailure as failure:
        report(str(failure))
    finally:
        if not rows:
            for kind, search, rates in searches:
                _leave(place, kind, search, rates, kinds)
    return rows


def _searched(
    place: str,
    kind: AnyDriverKind,
    search: DeviceSearch,
    rates: list[int],
    numbers: list[int],
    timeout: float,
    progress: SearchProgress,
) -> list[FoundAt]:
    for baud in rates:
        with progress(f"{_title(place, baud)} {search.title}", search.numbers or len(numbers), search.form) as step:
            found = search.find(place, baud, numbers, timeout, step)
        if found:  # a line has one baud rate
            return [FoundAt(place, None if "://" in place else baud, kind, one) for one in found]
    return []


def _leave(place: str, kind: AnyDriverKind, search: DeviceSearch, rates: list[int], searched: list[AnyDriverKind]) -> None:
    """Nothing was found: leave the line as it was. The most likely rate is last, because characters at other rates are noise
    at it."""
    for baud in reversed(rates):
        search.leave(place, baud)
    if search.disturbs and searched == [kind]:
        for baud in rates:
            clear_line(kind, place, baud)


def _rates(place: str, bauds: list[int]) -> list[int]:
    """The rates to try: all on serial ports, local or RFC 2217; otherwise one, because the rate has no effect."""
    if place.startswith("rfc2217://") or not ("://" in place or str(Path(place).resolve()).startswith("/dev/pts/")):
        return bauds
    return bauds[:1]


def _title(place: str, baud: int) -> str:
    return place if "://" in place else f"{place} {baud}"


def numbers_of(text: str, option: str, least: int, most: int) -> list[int]:
    """``1-5,9`` as numbers. Raises `Misuse`."""
    numbers: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        begin, end = read_whole(first), read_whole(last or first)
        if begin is None or end is None or (dash and not last):
            raise Misuse(f"{option} {text}: {part.strip()!r} is neither a number nor a range such as 1-16")
        if not least <= begin <= end <= most:
            raise Misuse(f"{option} {text}: {part.strip()} is outside {least} to {most}")
        numbers |= dict.fromkeys(range(begin, end + 1))
    return list(numbers)
