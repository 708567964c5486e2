"""Where results of a campaign are kept: what all such places do, and the memory of this process."""

from __future__ import annotations

import json
from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol

from steptwin.campaign.case import Case, CaseResult
from steptwin.coverage.counts import Coverage


class StoredCase(NamedTuple):
    case: Case
    result: CaseResult

    def to_text(self) -> str:
        """As JSON."""
        return _text([self.case.to_json(), self.result.to_json()])

    @classmethod
    def from_text(cls, text: str) -> StoredCase:
        case, result = json.loads(text)
        return cls(Case.from_json(case), CaseResult.from_json(result))


_text = json.JSONEncoder(ensure_ascii=False, separators=(",", ":")).encode


class ResultStore(Protocol):
    """The results of one campaign."""

    def add(self, found: Sequence[StoredCase], coverage: Coverage | None = None) -> None:
        """Keep results, all or none of them. A case that is there stays as it is: its results would be the same. ``coverage``:
        all that has been counted so far."""
        ...

    def numbers(self) -> array[int]:
        """The numbers of the cases that are there, in order."""
        ...

    def results(self, before: int | None = None, *, failed: bool | None = None) -> Iterator[StoredCase]:
        """In the order of their numbers, ``before`` a number. ``failed``: only such as did, or did not."""
        ...

    def failed(self) -> int:
        """How many of the cases failed."""
        ...

    def first_failure(self) -> int | None:
        """The lowest number of a case that failed."""
        ...

    def coverage(self) -> tuple[Coverage, int]:
        """Counts, and the number of their cases."""
        ...

    def close(self) -> None: ...


class MemoryStore:
    """Results that last as long as this process, as texts: these take less room."""

    def __init__(self) -> None:
        self._texts: dict[int, str] = {}
        self._failed: set[int] = set()
        self._coverage: list[Any] = []
        self._covered = 0

    def add(self, found: Sequence[StoredCase], coverage: Coverage | None = None) -> None:
        for one in found:
            if self._texts.setdefault(one.case.number, text := one.to_text()) is text and one.result.failed:
                self._failed.add(one.case.number)
        if coverage is not None:
            self._coverage = coverage.to_json()
            self._covered += len(found)

    def numbers(self) -> array[int]:
        return array("q", sorted(self._texts))

    def results(self, before: int | None = None, *, failed: bool | None = None) -> Iterator[StoredCase]:
        for number in self.numbers():
            if before is not None and number >= before:
                return
            if failed is None or (number in self._failed) == failed:
                yield StoredCase.from_text(self._texts[number])

    def failed(self) -> int:
        return len(self._failed)

    def first_failure(self) -> int | None:
        return min(self._failed, default=None)

    def coverage(self) -> tuple[Coverage, int]:
        return Coverage.from_json(self._coverage), self._covered

    def close(self) -> None:
        """Nothing."""


def gaps(done: Sequence[int], count: int | None) -> Iterator[int]:
    """The numbers from 0 to below ``count`` that are not in ``done``, which is in order; without a count they go on for ever."""
    place, number = 0, 0
    while count is None or number < count:
        if place < len(done) and done[place] == number:
            place += 1
        else:
            yield number
        number += 1


def export_rows(found: Iterable[StoredCase]) -> Iterator[dict[str, Any]]:
    """Flat rows, for tables: numbers, values, measures and the robustness of each property."""
    for case, result in found:
        yield {
            "number": case.number,
            "failed": result.failed,
            "error": result.error,
            "digest": result.digest,
            "end_s": result.end_ns / 1e9,
            **{f"value {name}": value for name, value in case.values.items()},
            **{f"measure {name}": value for name, value in result.measures.items()},
            **{f"robustness {one.name}": one.robustness for one in result.verdicts},
            **{f"holds {one.name}": one.holds for one in result.verdicts},
        }
