"""Questions about the past of a world that keeps its inputs but no states: it is run again once, at full speed, to have these."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.simulation.world.snapshotlog import (
    MOST_SNAPSHOTS,
    ChangedSince,
    LoggedSnapshot,
    SnapshotsByAge,
    outside_past,
    replay,
)
from steptwin.why.answer import Answer
from steptwin.why.log import MOST_NOTED
from steptwin.why.pastquestions import PastQuestions, first_span
from steptwin.why.question import finish

STATES = 16
"""Number of states at equal distances; further ones are near the end, about which most questions are."""


class ReplayedRun:
    """Answers questions about the past until ``end``. ``make`` gives the world at its beginning, ``inputs`` are what came from
    outside since."""

    def __init__(self, make: Callable[[], Simulation], inputs: Sequence[RecordedInput], end: Nanos) -> None:
        self._make = make
        self._inputs = list(inputs)
        self._end = end
        self._questions: PastQuestions | None = None

    def ask(self, question: str, at: Nanos | None = None, *, try_without: bool = False, everything: bool = False) -> Answer:
        """The answer for a moment (ns), the end by default. Options and errors as in `PastQuestions.asking`."""
        if self._questions is None:
            states = SnapshotsOfRun(self._make(), self._inputs, self._end)
            states.run()
            self._questions = PastQuestions(states, MOST_NOTED)
        return finish(self._questions.asking(question, at, try_without=try_without, everything=everything))


class SnapshotsOfRun:
    """States of a world that is run to ``end``. As `steptwin.simulation.world.snapshotlog.SnapshotLog`, with all inputs."""

    branch = 0

    def __init__(self, world: Simulation, inputs: Sequence[RecordedInput], end: Nanos) -> None:
        self.world = world
        self.begin = world.now
        self._inputs = inputs
        self._end = end
        self._states = SnapshotsByAge(MOST_SNAPSHOTS)
        self._states.add(LoggedSnapshot(world.snapshot(with_inputs=False), 0))

    def run(self) -> None:
        """Run the world."""
        self.world.stop_recording()
        changed = ChangedSince(self.world)
        done = 0
        for moment in self._moments():
            done += sum(replay(self.world, self._inputs[done:], moment))
            self._states.add(LoggedSnapshot(self.world.snapshot(with_inputs=False), done, changed.take()))

    def _moments(self) -> Sequence[Nanos]:
        """Those of the states after the first one."""
        whole, span = self._end - self.begin, first_span(self.world)
        moments = {self.begin + whole * number // STATES for number in range(1, STATES + 1)}
        while span < whole:
            moments.add(self._end - span)
            span *= 2
        return sorted(moments)

    def state_at(self, moment: Nanos) -> LoggedSnapshot:
        state = self._states.at(moment)
        if state is None:
            raise Misuse(outside_past(moment, self.begin, self._end))
        return state

    def keeps_inputs_from(self, number: int) -> bool:
        return True

    def inputs_from(self, number: int) -> Sequence[RecordedInput]:
        return self._inputs[number:]
