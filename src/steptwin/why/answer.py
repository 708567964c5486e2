"""An answer: what is true since when, and the chain of causes, each with its moment, subject and sentence."""

from __future__ import annotations

from typing import Any, NamedTuple

from steptwin.machine import SECOND, Nanos

MOST_LINKS = 8


class Link(NamedTuple):
    """One cause. ``subject``: the controller, element, line or script it happened to."""

    time: Nanos
    subject: str
    text: str


class Answer(NamedTuple):
    """``links`` go from the effect to its causes. ``since``: the last change; None if there was none."""

    question: str
    at: Nanos
    state: str
    since: Nanos | None
    links: tuple[Link, ...]
    is_complete: bool
    """Whether the chain has been followed to its end."""

    def text(self) -> str:
        """The answer in lines."""
        begin = "from the beginning" if self.since is None else f"since {self.since / SECOND:.6f} s"
        lines = [f"{self.state}, {begin} (at {self.at / SECOND:g} s)"]
        lines += [f"{link.time / SECOND:12.6f} s  {link.subject:<10} {link.text}" for link in self.links]
        if not self.is_complete:
            lines.append(f"{'':12}    (earlier causes are not shown)")
        return "\n".join(lines)

    def plain(self) -> dict[str, Any]:
        """The answer as plain data, for JSON; moments in ns."""
        return {
            "question": self.question,
            "at_ns": self.at,
            "state": self.state,
            "since_ns": self.since,
            "links": [{"time_ns": link.time, "subject": link.subject, "text": link.text} for link in self.links],
            "complete": self.is_complete,
        }
