"""Suggestions for misspelt names."""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.messages import Message

DID_YOU_MEAN = Message("nearmiss.did-you-mean", " (did you mean {name!r}?)")

_BUDGET = 40
"""Most words looked up for one text: a text of unknown words only must not take quadratic time."""
LIKE = 0.6
"""The share of equal characters from which names are alike."""


class NearMiss:
    """Finds the candidate that was probably meant. Spellings are compared in upper case and returned as listed."""

    def __init__(self) -> None:
        self._known: dict[str, str | None] = {}

    def of(self, word: str, candidates: Iterable[str]) -> str | None:
        """The candidate with the fewest typing mistakes (one in short words, two in long ones), or None."""
        key = word.upper()
        if key not in self._known:
            if len(self._known) >= _BUDGET or len(key) > 40:
                return None
            self._known[key] = _nearest(key, candidates)
        return self._known[key]

    def hint(self, word: str, candidates: Iterable[str]) -> str:
        """`` (did you mean 'pause'?)``, to follow the word, or nothing."""
        found = self.of(word, candidates)
        return "" if found is None else DID_YOU_MEAN(name=found)


def alike(word: str, candidates: Iterable[str], most: int = 3) -> list[str]:
    """The candidates that are similar to a word as a whole, the most similar first: for names of several parts."""
    from difflib import SequenceMatcher

    likeness = {candidate: SequenceMatcher(None, word, candidate).ratio() for candidate in candidates}
    return sorted((name for name in likeness if likeness[name] > LIKE), key=lambda name: (-likeness[name], name))[:most]


def _nearest(key: str, candidates: Iterable[str]) -> str | None:
    if len(key) < 3:
        return None
    limit = 1 if len(key) < 6 else 2
    letters = frozenset(key)
    best: str | None = None
    for candidate in candidates:
        other = candidate.upper()
        if other == key or abs(len(other) - len(key)) > limit:
            continue
        # A mistake adds at most one letter that the other word lacks.
        if len(letters.difference(other)) > limit:
            continue
        distance = _mistakes(key, other, limit)
        if distance <= limit:
            best, limit = candidate, distance - 1
            if limit == 0:
                break
    return best


def _mistakes(a: str, b: str, limit: int) -> int:
    """Characters inserted, left out, replaced or swapped with their neighbour; anything above ``limit`` may be too low."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        older, before, row = before, row, [i]
        for j, y in enumerate(b, 1):
            cost = min(before[j] + 1, row[-1] + 1, before[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, older[j - 2] + 1)
            row.append(cost)
        if min(row) > limit:
            return limit + 1
    return row[-1]
