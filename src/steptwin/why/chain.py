"""A chain of causes, and the rules that hold for each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.why.answer import ChainLink, ChainRule, Cover

NOT_KNOWN = Message("why.not-known", "what caused this is not known from here")


class Place(NamedTuple):
    """Position of something in time. ``order``: among all that was noted, of which a cause stands before its effect of the same
    nanosecond. ``number``: among what stands between the same two records, such as the statements of a program."""

    time: Nanos
    order: int = -1
    number: int = 0


class Cause(NamedTuple):
    """A link with its place, and what finds the cause of it. ``cover``: what lasts until its effect, if anything does."""

    link: ChainLink
    place: Place
    before: Callable[[], Cause | None]
    cover: Cover | None = None


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


class BrokenRule(NamedTuple):
    """``number``: of the causes that hold."""

    number: int
    rule: ChainRule


def broken(chain: Sequence[Cause], effect: Place, *, is_followed: bool) -> BrokenRule | None:
    """The first rule that a chain of causes of ``effect`` breaks; None for one that breaks none. ``is_followed``: whether nothing
    was found before the last one."""
    for number, cause in enumerate(chain):
        if cause.link.time != cause.place.time or cause.place >= effect:
            return BrokenRule(number, ChainRule.ORDER)
        if cause.place.time < effect.time and cause.cover is None:
            return BrokenRule(number, ChainRule.COVER)
        effect = cause.place
    if is_followed and (not chain or chain[-1].before is not nothing):
        return BrokenRule(len(chain), ChainRule.ROOT)
    return None
