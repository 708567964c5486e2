"""A chain of causes, and the rules that hold for each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.messages import Message, MessageText
from steptwin.why.answer import ALL_LINKS, ChainLink, ChainRule, Cover

BESIDES = 5
"""Distance of what had to be so besides, in causes that led to something: it takes the place of no nearer one."""
MOST_FOLLOWED = 40
"""Limit of the causes that are followed on the way to the beginning of a chain beyond those that are shown."""
LAST_SHOWN = 3
"""Number of the causes at the beginning of a long chain that are shown, too."""

BETWEEN = Message("why.between", "({count} causes between are not shown)")
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


def along(first: FoundCause, others: Sequence[FoundCause]) -> Cause | None:
    """A cause along with others, of which each is there once."""
    every = [one for one in (first, *others) if one is not None]
    if not every:
        return None
    return every[0]._replace(along=(*every[0].along, *(one for one in every[1:] if one.link != every[0].link)))


def given(cause: FoundCause) -> FoundCause:
    """A cause that is known already, for `functools.partial`."""
    return cause


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
    """A cause that has not been taken yet. ``distance``: from what is asked for, in causes between; ``leads``: whether each of
    them led to the next one, and none had to be so besides."""

    distance: int
    cause: Cause
    leads: bool


class Chain:
    """The causes of what is so at a place: the nearest ones are taken first, at most ``most``; of a longer chain also those at
    its beginning, if that is near enough, and the nearest roots of what had to be so besides. ``is_whole``: whether nothing was
    before what is known of a moment. One that breaks a rule is left out, and a link says so in its place."""

    def __init__(
        self,
        effect: ChainLink,
        place: Place,
        first: FoundCause,
        *,
        is_whole: Callable[[Nanos], bool],
        is_owed: bool,
        most: int = ALL_LINKS,
    ) -> None:
        self._is_whole = is_whole
        self._most = most
        self._waiting: list[_Waiting] = []
        self._taken: dict[tuple[Place, ChainLink], None] = {}
        self._followed: list[tuple[Place, ChainLink]] = []
        """Those that are farther than what is shown, on the way to the beginning."""
        self._beside: list[tuple[Place, ChainLink]] = []
        """Those that are farther, and had to be so besides."""
        self.is_cut = False
        """Whether something is because of what was before."""
        self.broken: ChainRule | None = None
        self._lead(effect, place, () if first is None else (first, *first.along), 0, is_owed=is_owed)

    @property
    def links(self) -> Sequence[ChainLink]:
        """The latest ones first. What was so several times, as in a loop, is there once; each act from outside is."""
        shown, last = list(self._taken), [one for one in self._followed if one not in self._taken]
        if last and self._next is None:  # the beginning was found
            shown, last = shown[: len(shown) - LAST_SHOWN], last[-LAST_SHOWN:]
            count = len({*self._taken, *self._followed}) - len(shown) - len(last)
            if count <= LAST_SHOWN:
                shown += [one for one in (*self._taken, *self._followed) if one not in shown and one not in last]
            else:
                place, link = last[0]
                last.insert(0, (place._replace(number=place.number + 1), ChainLink(link.time, "", BETWEEN(count=count))))
            shown += last
        shown += [one for one in self._beside if one[1].root is not None][:LAST_SHOWN]
        found: dict[tuple[str, MessageText, Nanos | None], ChainLink] = {}
        for _, link in sorted(shown, key=lambda one: one[0], reverse=True):
            found.setdefault((link.subject, link.text, None if link.root is None else link.time), link)
        return tuple(found.values())

    @property
    def is_over(self) -> bool:
        """Whether no more are taken."""
        return self._next_shown is None and self._next_beside is None

    @property
    def is_followed(self) -> bool:
        """Whether there are no more."""
        return not self._waiting

    @property
    def _is_full(self) -> bool:
        sentences = {(link.subject, link.text) for _, link in self._taken}
        return len(sentences) >= self._most or len(self._taken) >= self._most + MOST_FOLLOWED

    @property
    def _next(self) -> _Waiting | None:
        """The nearest one that waits, of several the latest; beyond what is shown only what led there."""
        is_full = self._is_full
        waiting = (one for one in self._waiting if one.leads or not is_full)
        return max(waiting, key=_nearest, default=None)

    @property
    def _next_shown(self) -> _Waiting | None:
        return self._next if len(self._followed) < MOST_FOLLOWED else None

    @property
    def _next_beside(self) -> _Waiting | None:
        """The nearest one that had to be so besides, beyond what is shown."""
        waiting = (one for one in self._waiting if not one.leads)
        return max(waiting, key=_nearest, default=None) if self._is_full and len(self._beside) < MOST_FOLLOWED else None

    def go_on(self) -> None:
        """Take the next one."""
        taken = self._next_shown or self._next_beside
        if taken is None:
            return
        self._waiting.remove(taken)
        cause, key = taken.cause, (taken.cause.place, taken.cause.link)
        if key in self._taken or key in self._followed or key in self._beside:
            return
        if not self._is_full:
            self._taken[key] = None
        else:
            (self._followed if taken.leads else self._beside).append(key)
        before = cause.before()
        led = () if before is None else (before, *before.along)
        is_owed = before is None and cause.before is not nothing
        self._lead(cause.link, cause.place, led, taken.distance + 1, is_owed=is_owed, leads=taken.leads)
        self._lead(cause.link, cause.place, tuple(cause.besides()), taken.distance + BESIDES, leads=False)

    def _lead(
        self,
        effect: ChainLink,
        place: Place,
        causes: Sequence[Cause],
        distance: int,
        *,
        is_owed: bool = False,
        leads: bool = True,
    ) -> None:
        """Let causes wait that lead to something. ``is_owed``: one more should have been found."""
        rules = [broken(one, place) for one in causes]
        self._waiting += [_Waiting(distance, one, leads) for one, rule in zip(causes, rules, strict=True) if rule is None]
        if not leads and self._is_full:  # it is not shown
            return
        is_rootless = is_owed and self._is_whole(effect.time)
        self.is_cut |= is_owed and not is_rootless
        rule = next((rule for rule in rules if rule), ChainRule.ROOT if is_rootless else None)
        if rule is not None:
            self.broken = self.broken or rule
            self._taken[place._replace(number=place.number - 1), replace(effect, text=NOT_KNOWN(), root=None)] = None


def _nearest(waiting: _Waiting) -> tuple[int, Place]:
    return -waiting.distance, waiting.cause.place
