"""A chain of causes, and the rules that hold for each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.messages import Message, MessageText
from steptwin.why.answer import ChainLink, ChainRule, Cover

NOT_KNOWN = Message("why.not-known", "what caused this is not known from here")


class Place(NamedTuple):
    """Position of something in time. ``order``: among all that was noted, of which a cause stands before its effect of the same
    nanosecond. ``number``: among what stands between the same two records, such as the statements of a program."""

    time: Nanos
    order: int = -1
    number: int = 0


class Cause(NamedTuple):
    """A link with its place, and what finds the causes of it: ``before``, and ``besides`` what else had to be so. ``cover``: what
    lasts until its effect, if anything does."""

    link: ChainLink
    place: Place
    before: Callable[[], Cause | None]
    cover: Cover | None = None
    besides: Callable[[], Iterable[Cause]] = tuple
    along: tuple[Cause, ...] = ()
    """Other causes of the same effect."""


FoundCause: TypeAlias = "Cause | None"


def covered(cause: FoundCause, by: Cover | None) -> FoundCause:
    """A cause whose effect comes later by what lasts."""
    return cause if cause is None or by is None else cause._replace(cover=by)


def nothing() -> FoundCause:
    """The end of a chain: what comes from outside or holds from the beginning."""
    return None


def unknown() -> FoundCause:
    """The end of a chain whose cause was before the log."""
    return None


def broken(cause: Cause, effect: Place) -> ChainRule | None:
    """The rule that a cause breaks; None for one that breaks none."""
    if cause.link.time != cause.place.time or cause.place >= effect:
        return ChainRule.ORDER
    return ChainRule.COVER if cause.place.time < effect.time and cause.cover is None else None


class _Waiting(NamedTuple):
    """A cause that has not been taken yet. ``distance``: number of causes between it and what is asked for."""

    distance: int
    cause: Cause


class Chain:
    """The causes of what is so at a place: the nearest ones are taken first. ``is_whole``: whether nothing was before what is
    known of a moment. One that breaks a rule is left out, and a link says so in its place."""

    def __init__(
        self, effect: ChainLink, place: Place, first: FoundCause, *, is_whole: Callable[[Nanos], bool], is_owed: bool
    ) -> None:
        self._is_whole = is_whole
        self._waiting: list[_Waiting] = []
        self._taken: dict[tuple[Place, ChainLink], None] = {}
        self.is_cut = False
        """Whether something is because of what was before."""
        self.broken: ChainRule | None = None
        self._lead(effect, place, () if first is None else (first, *first.along), 0, is_owed=is_owed)

    def __len__(self) -> int:
        return len(self._taken)

    @property
    def links(self) -> Sequence[ChainLink]:
        """The latest ones first. What was so several times, as in a loop, is there once."""
        found: dict[tuple[str, MessageText], ChainLink] = {}
        for _, link in sorted(self._taken, key=lambda one: one[0], reverse=True):
            found.setdefault((link.subject, link.text), link)
        return tuple(found.values())

    @property
    def is_followed(self) -> bool:
        """Whether there are no more."""
        return not self._waiting

    def go_on(self) -> None:
        """Take the nearest one that waits, of several the latest."""
        taken = max(self._waiting, key=lambda one: (-one.distance, one.cause.place))
        self._waiting.remove(taken)
        cause = taken.cause
        if (cause.place, cause.link) not in self._taken:
            self._taken[cause.place, cause.link] = None
            before = cause.before()
            found = (*(() if before is None else (before, *before.along)), *cause.besides())
            is_owed = before is None and cause.before is not nothing
            self._lead(cause.link, cause.place, found, taken.distance + 1, is_owed=is_owed)

    def _lead(self, effect: ChainLink, place: Place, causes: Sequence[Cause], distance: int, *, is_owed: bool) -> None:
        """Let causes wait that lead to something. ``is_owed``: one more should have been found."""
        rules = [broken(one, place) for one in causes]
        self._waiting += [_Waiting(distance, one) for one, rule in zip(causes, rules, strict=True) if rule is None]
        is_rootless = is_owed and self._is_whole(effect.time)
        self.is_cut |= is_owed and not is_rootless
        rule = next((rule for rule in rules if rule), ChainRule.ROOT if is_rootless else None)
        if rule is not None:
            self.broken = self.broken or rule
            self._taken[place._replace(number=place.number - 1), replace(effect, text=NOT_KNOWN(), root=None)] = None
