"""Records of a trace in words, and which of them are shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from steptwin.controller import SECOND, Fact
from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.scheduler.trace import TraceRecord

_NAMED = ("note", "expectation", "overdue")
"""Events whose texts need their code in front."""
PROGRAM = "program"
SHOWN = {
    PROGRAM: "what a program of a MIC488 does",
    "status": "what controllers and elements report, and the commands of an M1486",
    "note": "notes of scripts",
    "report": "expectations that failed, and waits that timed out",
    "button": "buttons",
    "input": "inputs from outside",
    "fault": "faults",
}
"""Kinds of what is shown to a user."""
WORLD = "world"
"""Who reports what scripts do."""
MOST_NAMED = 20


def is_shown(record: TraceRecord) -> bool:
    """Whether a record is shown to a user. Requests are not: they are as frequent as frames."""
    return record.kind in ("event", "fault", "input") and record.subject != "request"


def shown_kind(record: TraceRecord) -> str:
    """The kind, one of `SHOWN`, of a record that is shown."""
    if record.kind == "input" and record.value in ("pressed", "released"):
        return "button"
    if record.kind != "event":
        return record.kind
    return {"note": "note", "expectation": "report", "overdue": "report"}.get(record.subject, "status")


@dataclass(frozen=True, slots=True)
class Selection:
    """Selection of what a user wants to see: of some controllers, elements and lines, and some kinds; None: all."""

    names: frozenset[str] | None = None
    kinds: frozenset[str] | None = None

    def takes(self, kind: str, names: Iterable[str]) -> bool:
        """Whether something of a kind is wanted that is about one of these names, or about a part of it (``clamp.position``)."""
        return (self.kinds is None or kind in self.kinds) and self.takes_of(*names)

    def takes_of(self, *names: str) -> bool:
        return self.names is None or any(one in self.names or one.partition(".")[0] in self.names for one in names)

    def shows(self, record: TraceRecord) -> bool:
        return is_shown(record) and self.takes(shown_kind(record), names_of(record))


def names_of(record: TraceRecord) -> Iterator[str]:
    """Names of what a record is about: who reports it, the button or pin of an input, what its facts name."""
    yield owner_of(record.controller, record.facts)
    if record.kind == "input":
        yield record.subject
    yield from (fact for _, fact in record.facts if isinstance(fact, str))


ALL = Selection()


def read_selection(
    names: Sequence[str], kinds: Sequence[str], there: Iterable[str], known: Sequence[str] = tuple(SHOWN)
) -> Selection:
    """From texts with names and kinds, between commas. ``there``: what there is in the world. Raises `Misuse`."""
    return Selection(_chosen("--of", names, [*there, WORLD]), _chosen("--show", kinds, known))


def _chosen(option: str, texts: Sequence[str], known: Sequence[str]) -> frozenset[str] | None:
    wanted = [one.strip() for text in texts for one in text.split(",") if one.strip()]
    for one in wanted:
        if one not in known:
            shown = ", ".join(known[:MOST_NAMED]) + (f" and {len(known) - MOST_NAMED} more" if len(known) > MOST_NAMED else "")
            raise Misuse(f"{option} {one}{NearMiss().hint(one, known)}: there are {shown}")
    return frozenset(wanted) or None


def named_in(objects: BuiltObjects) -> Iterable[str]:
    """The names of what reports anything in a world."""
    return (*objects.controllers, *objects.lines, *objects.element_names)


def owner_of(controller: str, facts: Iterable[Fact]) -> str:
    """Who reports an event: the element that its facts name, which is recorded under a controller that it is connected to."""
    return str(dict(facts).get("element", controller))


def describe(record: TraceRecord) -> str:
    """Describe a record in one line."""
    owner = owner_of(record.controller, record.facts)
    is_named = (record.kind != "event" or record.subject in _NAMED) and record.subject != owner
    what = f"{record.subject}: " if is_named else ""
    value = record.value.hex(" ") if isinstance(record.value, bytes) else record.value
    return f"{record.time / SECOND:12.6f} s  {owner:<10} {what}{value}".rstrip()
