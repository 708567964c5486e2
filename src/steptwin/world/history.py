"""The past of a world that runs: its state from time to time and what came from outside since, so that it can be brought back to
any moment since the oldest state.

Memory is bounded. Where there are too many states, those go first whose neighbours are close for their age, so that the distance
between two states grows with their age. With the oldest state goes what came from outside before the next one.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.world.actions import size_of
from steptwin.world.plant import Plant, PlantSnapshot, RecordedInput

MOST_STATES = 256
MOST_CONTROLLER_STATES = 4096
"""States of controllers in all: a world of more than 16 controllers keeps fewer states."""
LEAST_STATES = 16
MOST_NEAR = 128
MOST_INPUTS = 100_000
MOST_INPUT_BYTES = 16 << 20
SLICE_NS: Nanos = SECOND // 4
"""Looking back can be interrupted at least so often. [virtual time]"""


def replay(world: Plant, inputs: Iterable[RecordedInput], end: Nanos, slice_ns: Nanos | None = None) -> Iterator[bool]:
    """Bring a world to ``end`` with the inputs that come by then, past moments at which it was stopped.

    Gives whether an input was given, after each of them and each slice of time: the caller may do something else then. Raises
    `Misuse` for an input that does not fit the world.
    """
    for time, what, settled in inputs:
        if time > end:
            break
        for _ in _bring(world, time, slice_ns):
            yield False
        if settled:
            world.advance(time)
        world.apply_input(what)
        yield True
    for _ in _bring(world, end, slice_ns):
        yield False
    world.advance(world.now)
    world.settle_all()


def _bring(world: Plant, moment: Nanos, slice_ns: Nanos | None) -> Iterator[None]:
    while world.now < moment:
        world.go_on()
        world.advance(moment if slice_ns is None else min(moment, world.now + slice_ns))
        if slice_ns is not None:
            world.settle_all()
        yield


class _State(NamedTuple):
    snapshot: PlantSnapshot
    inputs: int
    """How many there had been."""


class History:
    """Of ``world``, from now on. What comes from outside is recorded by itself, a state with `take`.

    Each state has the records of a trace that is kept: let them go (`Trace.let_go`) where a world runs for long.
    """

    def __init__(self, world: Plant) -> None:
        self.world = world
        self.branch = 0
        """Counts how often the world has gone back: what was later is another past then."""
        self._most = max(LEAST_STATES, min(MOST_STATES, MOST_CONTROLLER_STATES // max(1, len(world.machines))))
        self._states: list[_State] = []
        self._inputs: deque[RecordedInput] = deque()
        self._bytes = 0
        self._dropped = 0
        """Inputs before those that are kept."""
        world.input_watchers.append(self._noted)
        self.take()

    def close(self) -> None:
        """Record nothing more."""
        self.world.input_watchers.remove(self._noted)

    def __len__(self) -> int:
        """How many states are kept."""
        return len(self._states)

    @property
    def begin(self) -> Nanos:
        """The oldest moment to which a world can be brought; the present where nothing is kept."""
        return self._states[0].snapshot.now if self._states else self.world.now

    def take(self) -> None:
        """Keep the present state, unless one of this moment is there."""
        if self._states and self._states[-1].snapshot.now == self.world.now:
            return
        self._states.append(_State(self.world.snapshot(with_inputs=False), self.inputs_so_far))
        if len(self._states) > self._most:
            del self._states[self._least_missed()]

    def _least_missed(self) -> int:
        """The state whose neighbours are closest for their age; never the oldest or the newest."""
        times = [state.snapshot.now for state in self._states]
        now = times[-1]
        return min(range(1, len(times) - 1), key=lambda i: (times[i + 1] - times[i - 1]) / (now - times[i]))

    def _noted(self, given: RecordedInput) -> None:
        self._inputs.append(given)
        self._bytes += size_of(given.what)
        while len(self._inputs) > MOST_INPUTS or self._bytes > MOST_INPUT_BYTES:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        if self._states:
            del self._states[0]
        until = self._states[0].inputs if self._states else self.inputs_so_far
        while self._dropped < until:
            self._bytes -= size_of(self._inputs.popleft().what)
            self._dropped += 1

    def gone_back(self) -> None:
        """The world has gone back to its present moment: what came later, or at this moment, has not happened."""
        now = self.world.now
        while self._states and self._states[-1].snapshot.now >= now:
            self._states.pop()
        while self._inputs and self._inputs[-1].time >= now:
            self._bytes -= size_of(self._inputs.pop().what)
        self.branch += 1
        self.take()

    def state_at(self, moment: Nanos) -> tuple[PlantSnapshot, int]:
        """The newest state at or before a moment, and how many inputs there had been. Raises `Misuse` where there is none."""
        index = bisect_right(self._states, moment, key=lambda state: state.snapshot.now)
        if not index:
            raise Misuse(f"to_ns = {moment}: the past is kept from {self.begin} to {self.world.now} ns")
        return self._states[index - 1]

    @property
    def inputs_so_far(self) -> int:
        """How many there have been."""
        return self._dropped + len(self._inputs)

    def keeps_inputs_from(self, number: int) -> bool:
        """Whether the inputs after the first ``number`` are still kept."""
        return number >= self._dropped

    def inputs_from(self, number: int) -> list[RecordedInput]:
        """The inputs after the first ``number``. Raises `Misuse` where they are no longer kept."""
        if not self.keeps_inputs_from(number):
            raise Misuse(f"the past is kept from {self.begin} to {self.world.now} ns")
        newest = list(islice(reversed(self._inputs), self.inputs_so_far - number))
        newest.reverse()
        return newest


class Past:
    """A world without ports, in which a moment of another one's past can be looked at. It costs the memory of another world."""

    def __init__(self, history: History) -> None:
        self._history = history
        world = history.world
        self.world = Plant(world.spec, world.files, keep_trace=world.trace.is_kept, keep_inputs=False)
        if not world.trace.is_recorded:
            self.world.stop_recording()
        self._branch = -1
        self._inputs = 0
        """How many it has had."""
        self._near: deque[_State] = deque(maxlen=MOST_NEAR)
        """States on the way to where it was last: those of the history may be far from there."""

    def forget(self) -> None:
        """Have the next `go` begin with a state: the world has been used for something else."""
        self._branch = -1

    @property
    def is_in_step(self) -> bool:
        """Whether it is at the present moment and has been brought there; inputs of this moment may be missing still."""
        history = self._history
        return self._branch == history.branch and self.world.now == history.world.now

    @property
    def lacks_inputs(self) -> bool:
        """Whether inputs have come since."""
        return self._inputs != self._history.inputs_so_far

    def go(self, moment: Nanos) -> Iterator[None]:
        """Bring it to a moment, in parts between which something else can be done. Raises `Misuse` for a moment that is not kept,
        and for one after the present."""
        history = self._history
        if moment > history.world.now:
            raise Misuse(f"to_ns = {moment}: the past is kept from {history.begin} to {history.world.now} ns")
        if self._branch != history.branch:
            self._near.clear()
        state = self._state_at(moment)
        if (
            not history.keeps_inputs_from(self._inputs)
            or self._branch != history.branch
            or not state.snapshot.now <= self.world.now <= moment
        ):
            self.world.restore(state.snapshot)
            self._branch, self._inputs = history.branch, state.inputs
        kept = state.snapshot.now
        for _ in self.go_on(moment):
            if kept + SLICE_NS <= self.world.now < moment:
                kept = self.world.now
                self._near.append(_State(self.world.snapshot(with_inputs=False), self._inputs))
            yield

    def go_on(self, moment: Nanos) -> Iterator[None]:
        """Bring it from where it is to a later moment; nothing that happens meanwhile is left out."""
        for is_input in replay(self.world, self._history.inputs_from(self._inputs), moment, SLICE_NS):
            self._inputs += is_input
            yield

    def _state_at(self, moment: Nanos) -> _State:
        """The newest state at or before a moment whose inputs are kept. Raises `Misuse` where there is none."""
        kept = _State(*self._history.state_at(moment))
        near = [
            state
            for state in self._near
            if kept.snapshot.now < state.snapshot.now <= moment and self._history.keeps_inputs_from(state.inputs)
        ]
        return max(near, key=lambda state: state.snapshot.now, default=kept)
