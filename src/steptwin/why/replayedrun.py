"""Questions about the past of a world that keeps its inputs, answered from states of it: those that were kept while it ran; where
there are none, it is run again once, at full speed."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.simulation.world.snapshotlog import Changed, LoggedSnapshot, outside_past, replay
from steptwin.why.answer import Answer
from steptwin.why.keptstates import KeptStates
from steptwin.why.log import MOST_NOTED
from steptwin.why.pastquestions import PastQuestions, first_span, second_world
from steptwin.why.question import finish

STATES = 16
"""Number of states at equal distances; further ones are near the end, about which most questions are."""


class ReplayedRun:
    """Answers questions about the past until ``end``. ``make`` gives the world at its beginning, ``inputs`` are what came from
    outside since. ``kept``: states from its beginning on that were kept while it ran."""

    def __init__(
        self, make: Callable[[], Simulation], inputs: Sequence[RecordedInput], end: Nanos, kept: KeptStates | None = None
    ) -> None:
        self._make = make
        self._inputs = list(inputs)
        self._end = end
        self._kept = kept
        self._questions: PastQuestions | None = None

    def ask(self, question: str, at: Nanos | None = None, *, try_without: bool = False, everything: bool = False) -> Answer:
        """The answer for a moment (ns), the end by default. Options and errors as in `PastQuestions.asking`."""
        if self._questions is None:
            self._questions = PastQuestions(SnapshotsOfRun(self._kept or self._run(), self._inputs, self._end), MOST_NOTED)
        moment = self._end if at is None else at
        return finish(self._questions.asking(question, moment, try_without=try_without, everything=everything))

    def _run(self) -> KeptStates:
        """States of the world that is run again."""
        world = self._make()
        kept, done = KeptStates(world), 0
        world.stop_recording()
        for moment in moments_of(world, kept.begin, self._end)[1:]:
            done += sum(replay(world, self._inputs[done:], moment))
            kept.take(done)
        return kept


class SnapshotsOfRun:
    """States of a run until ``end`` at the same moments, whichever were kept: so each answer is the same. As
    `steptwin.simulation.world.snapshotlog.SnapshotLog`, with all inputs."""

    branch = 0

    def __init__(self, kept: KeptStates, inputs: Sequence[RecordedInput], end: Nanos) -> None:
        self.world = kept.world
        self.begin = kept.begin
        self._kept = kept
        self._inputs = inputs
        self._end = end
        self._moments = moments_of(kept.world, kept.begin, end)
        self._states: dict[Nanos, LoggedSnapshot] = {}

    def state_at(self, moment: Nanos) -> LoggedSnapshot:
        number = bisect_right(self._moments, moment) - 1
        if number < 0:
            raise Misuse(outside_past(moment, self.begin, self._end))
        at = self._moments[number]
        if at not in self._states:
            changed = self._kept.changed(self._moments[number - 1], at) if number else frozenset()
            self._states[at] = self._state(at, changed)
        return self._states[at]

    def _state(self, at: Nanos, changed: frozenset[Changed]) -> LoggedSnapshot:
        """The state of a moment, from the one kept last."""
        snapshot, inputs, _ = self._kept.at(at)
        if snapshot.now == at:
            return LoggedSnapshot(snapshot, inputs, changed)
        world = second_world(self.world, snapshot)
        inputs += sum(replay(world, self._inputs[inputs:], at))
        return LoggedSnapshot(world.snapshot(with_inputs=False), inputs, changed)

    def keeps_inputs_from(self, number: int) -> bool:
        return True

    def inputs_from(self, number: int) -> Sequence[RecordedInput]:
        return self._inputs[number:]


def moments_of(world: Simulation, begin: Nanos, end: Nanos) -> Sequence[Nanos]:
    """Those of the states that are searched, the beginning first."""
    whole, span = end - begin, first_span(world)
    moments = {begin + whole * number // STATES for number in range(STATES + 1)}
    while span < whole:
        moments.add(end - span)
        span *= 2
    return sorted(moments)
