"""What is told of a running world besides its signals: lines in words, commands over them, and its past."""

from __future__ import annotations

from functools import partial

from steptwin.files.world import World
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.kinds.lines import LineWrite
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.records import describe, is_shown, names_of, shown_kind
from steptwin.wire.frameline import FrameLine


class Listener:
    """Hears of ``world`` from now on until `close`."""

    def __init__(self, world: World) -> None:
        self.found: list[str] = []
        self._world = world
        self._words = {}
        self._ends = []
        for spec in world.spec.lines:
            line, kind = world.lines[spec.name], line_kinds()[spec.kind]
            words = self._words[spec.name] = kind.words(line, f"{spec.name}/", self._say)
            line.follow_frames(words)
            self._ends.append(partial(line.unfollow_frames, words))
            if kind.writes is not None:
                self._ends.append(kind.writes(line, self._say))
        world.trace.watchers.append(self._record)

    def _say(self, what: FrameLine | LineWrite) -> None:
        self.found.append(repr(what))

    def _record(self, record: TraceRecord) -> None:
        for words in self._words.values():
            words.recorded(record)
        if record.kind == "frame":
            place, _, direction = record.subject.rpartition("/")
            if direction == "in" and record.data():
                self.found.append(repr(sorted(self._words[record.machine].changes(place, record.data()))))
        elif is_shown(record):
            self.found.append(f"{shown_kind(record)} {sorted(set(names_of(record)))} {describe(record)}")

    def close(self) -> None:
        self._world.trace.watchers.remove(self._record)
        for end in self._ends:
            end()


def faults_as_text(world: World) -> list[str]:
    """Those of its description; what is read from a text is the same fault."""
    texts = [str(fault) for fault in world.spec.faults]
    return texts + [f"{text} is another one when it is read" for text in texts if str(read_fault(text)) != text]
