"""An answer: what is true since when, and the chain of causes, each with its moment, subject and sentence."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message, MessageText, read_message_text, with_messages
from steptwin.why.roots import Root

SINCE_BEFORE = Message("why.since-before", "since before {time:.6f} s")
FROM_THE_BEGINNING = Message("why.from-the-beginning", "from the beginning")

WITHOUT = Message("why.without", "the run again without each of its roots:")

MOST_LINKS = 16
"""Limit of the links of an answer, unless all are asked for."""
ALL_LINKS = 1000
"""Limit where all are asked for."""


class ChainRule(enum.Enum):
    """A rule that a chain can break."""

    ORDER = "a cause comes before its effect"
    """So a chain never returns to what it has named."""
    COVER = "something lasts from a cause until its effect, if that comes later"
    ROOT = "what changed has a cause, unless it comes from outside or holds from the beginning"


class Cover(enum.Enum):
    """Cover from a cause until its effect, if that comes later."""

    LEVEL = "a signal, variable or register keeps its value"
    DELAY = "a delay of an element or wire"
    ACTION = "an element acts, such as a cylinder that moves"
    BOUNCE = "a contact bounces"
    MOTION = "an axis moves"
    PROGRAM = "a program executes statements"
    WAIT = "a statement waits, or what it began lasts"
    FRAME = "a frame is on the line"
    FAULT = "a fault holds a level"


@dataclass(frozen=True, slots=True)
class ChainLink:
    """One cause. ``subject``: the controller, element, line or script it happened to."""

    time: Nanos
    subject: str
    text: MessageText
    root: Root | None = field(default=None, compare=False)
    """The input, act, request or fault that the run can be repeated without, if it is one."""
    is_stand: bool = field(default=False, compare=False)
    """Whether it says at which wait or loop the program of its subject stands."""

    def to_json(self) -> dict[str, Any]:
        return with_messages({"time_ns": str(self.time), "subject": self.subject, "text": self.text})


class Effect(enum.StrEnum):
    """Effect of the run without a root on what was asked for."""

    OTHERWISE = "otherwise"
    OTHER_TIME = "other time"
    """It would be the same, but since another moment."""
    SAME = "same"
    """Something else is enough for it: the root alone does not decide."""
    UNKNOWN = "unknown"
    """The run could not be repeated without it."""


class Trial(NamedTuple):
    """The run repeated without the root of ``link``. ``text``: what would be then; ``since``: since when the same would be so."""

    link: ChainLink
    effect: Effect
    text: MessageText
    since: Nanos | None = None

    def to_json(self) -> dict[str, Any]:
        return with_messages({**self.link.to_json(), "effect": self.effect.value, "without": self.text})


class Answer(NamedTuple):
    """``links`` go from the effect to its causes. ``since``: the last change; None if there was none."""

    question: str
    at: Nanos
    state: MessageText
    since: Nanos | None
    links: tuple[ChainLink, ...]
    is_complete: bool
    """Whether the chain has been followed to its end."""
    known_from: Nanos = 0
    """The moment from which on the past was searched."""
    is_cut: bool = False
    """Whether the chain ends there, because of something before that moment."""
    trials: tuple[Trial, ...] = ()
    """The runs without each of the roots, if that was asked for."""
    broken: ChainRule | None = None
    """The rule that what was found next would have broken: the chain was ended there, and its last link says so."""
    has_all_states: bool = True
    """Whether it has the present states of all on which what was asked about depends."""

    def text(self, more: str = ": --all shows more") -> str:
        """The answer in lines. ``more``: how further ones are shown, behind that there are any."""
        begin = since_before(self.known_from) if self.since is None else f"since {self.since / SECOND:.6f} s"
        lines = [f"{self.state}, {begin} (at {self.at / SECOND:g} s)"]
        lines += map(_line, self.links)
        if self.is_cut:
            lines.append(f"{'':12}    (what was before {self.known_from / SECOND:.6f} s is not known)")
        left_out = ["present states"] * (not self.has_all_states) + ["causes"] * (not self.is_complete and not self.is_cut)
        if left_out:
            lines.append(f"{'':12}    (further {' and '.join(left_out)} are not shown{more})")
        lines += [WITHOUT(), *(f"{_line(trial.link)} -> {trial.text}" for trial in self.trials)] if self.trials else []
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """The answer as plain data, for JSON; moments in ns, as text."""
        data = {
            "question": self.question,
            "at_ns": str(self.at),
            "state": self.state,
            "since_ns": None if self.since is None else str(self.since),
            "links": [link.to_json() for link in self.links],
            "complete": self.is_complete and self.has_all_states,
            "known_from_ns": str(self.known_from),
            "cut": self.is_cut,
            "trials": [trial.to_json() for trial in self.trials],
            "text": self.text(),
        }
        return with_messages(data)


def read_answer(data: Mapping[str, Any]) -> Answer:
    """An answer from its plain data."""
    links = tuple(map(_read_link, data["links"]))
    since = None if data["since_ns"] is None else int(data["since_ns"])
    known_from = int(data["known_from_ns"])
    return Answer(
        data["question"],
        int(data["at_ns"]),
        read_message_text(data, "state"),
        since,
        links,
        data["complete"],
        known_from,
        data["cut"],
        tuple(_read_trial(one) for one in data["trials"]),
    )


def _line(link: ChainLink) -> str:
    return f"{link.time / SECOND:12.6f} s  {link.subject:<10} {link.text}"


def _read_link(data: Mapping[str, Any]) -> ChainLink:
    return ChainLink(int(data["time_ns"]), data["subject"], read_message_text(data, "text"))


def _read_trial(data: Mapping[str, Any]) -> Trial:
    return Trial(_read_link(data), Effect(data["effect"]), read_message_text(data, "without"))


def since_before(begin: Nanos) -> MessageText:
    """Sentence about what has not changed in a past that is known from a moment on."""
    return SINCE_BEFORE(time=begin / SECOND) if begin else FROM_THE_BEGINNING()
