"""The past run again without one of the roots of a chain, to see whether what was asked for would be otherwise.

A run is deterministic: what differs then, differs because of that root.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Protocol, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse, SteptwinError
from steptwin.messages import Message, text_of
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot
from steptwin.why.answer import Answer, ChainLink, Effect, Trial
from steptwin.why.notedpast import NotedPast
from steptwin.why.question import NOTHING_EXECUTED, SCRIPT_DOES_NOT_WAIT, Asking, Why
from steptwin.why.roots import Act, Root, Sent, SetFault
from steptwin.why.search import Snapshots

WOULD_BE_SINCE = Message("why.would-be-since", "the same, but since {time:.6f} s")
WOULD_BE_SINCE_BEFORE = Message("why.would-be-since-before", "the same, but since before {time:.6f} s")
WOULD_BE_THE_SAME = Message("why.would-be-the-same", "the same: something else is enough for it")
NOT_TRIED = Message("why.not-tried", "not known: {problem}")
PAST_BEFORE_IT_IS_NOT_KEPT = Message("why.past-before-it-is-not-kept", "the past before it is not kept")
NOT_FOUND_AGAIN = Message("why.not-found-again", "it is not found again in the past that is kept")

LONGEST_FRAME_NS: Nanos = 2 * SECOND
"""How long before the end of a request its bytes may have come."""

Trying: TypeAlias = Generator[None, None, Sequence[Trial]]


class SnapshotsWithInputs(Snapshots, Protocol):
    """The past of a world."""

    def inputs_from(self, number: int) -> Sequence[RecordedInput]: ...


def trying_without(
    snapshots: SnapshotsWithInputs,
    link: ChainLink,
    answers: Sequence[Answer],
    most: int,
    *,
    around: Nanos = 0,
    others: Sequence[Root] = (),
) -> Trying:
    """Whether each of some answers about one moment would be otherwise without the root of a link, and ``others``, in parts.
    ``most``: limit of what is noted; ``around``: how long before and after the moment the first one must be otherwise."""
    try:
        return (yield from _trying(snapshots, link, answers, most, around, others))
    except SteptwinError as error:
        return [Trial(link, Effect.UNKNOWN, NOT_TRIED(problem=text_of(error))) for _ in answers]


def _trying(
    snapshots: SnapshotsWithInputs,
    link: ChainLink,
    answers: Sequence[Answer],
    most: int,
    around: Nanos,
    others: Sequence[Root],
) -> Trying:
    if link.root is None:
        raise Misuse(NOT_FOUND_AGAIN())
    roots = (link.root, *others)
    begin = max(snapshots.begin, min(_began(snapshots, root) for root in roots) - 1)
    found = yield from _trying_from(snapshots, begin, link, answers, most, around, roots)
    if begin > snapshots.begin and any(one.text.id == NOTHING_EXECUTED.id for one in found):  # what it executed was before
        found = yield from _trying_from(snapshots, snapshots.begin, link, answers, most, around, roots)
    return found


def _trying_from(
    snapshots: SnapshotsWithInputs,
    begin: Nanos,
    link: ChainLink,
    answers: Sequence[Answer],
    most: int,
    around: Nanos,
    roots: Sequence[Root],
) -> Trying:
    state = snapshots.state_at(begin)
    if state.snapshot.now > min(root.time for root in roots):
        raise Misuse(PAST_BEFORE_IT_IS_NOT_KEPT())
    run = _RunWithout(snapshots.world, state.snapshot, roots)
    at = answers[0].at + around
    inputs = run.inputs([one for one in snapshots.inputs_from(state.inputs) if one.time <= at])
    other = Why(NotedPast(run.make, inputs, at, most))
    found: list[Trial] = []
    for answer in answers:
        wide = around if answer is answers[0] else 0
        then = yield from _asking(other, answer.question, answer.at + wide)
        if not run.is_without:
            raise Misuse(NOT_FOUND_AGAIN())
        found.append(_compared(link, answer, then, state.snapshot.now, wide))
    return found


def _asking(other: Why, question: str, at: Nanos) -> Asking:
    """The answer in a run; about a script that waits for nothing then, just that."""
    try:
        return (yield from other.asking(question, at))
    except Misuse as error:
        text = text_of(error)
        if getattr(text, "id", None) != SCRIPT_DOES_NOT_WAIT.id:
            raise
        return Answer(question, at, text, None, (), is_complete=True)


def _compared(link: ChainLink, answer: Answer, other: Answer, begin: Nanos, around: Nanos) -> Trial:
    """The effect of a run from ``begin`` on, in which the answer is another one."""
    if other.state != answer.state and (other.since is None or not around or other.since <= answer.at - around):
        return Trial(link, Effect.OTHERWISE, other.state)
    since = answer.since if answer.since is not None and answer.since > begin else None
    if other.since == since:
        return Trial(link, Effect.SAME, WOULD_BE_THE_SAME())
    told = WOULD_BE_SINCE_BEFORE(time=begin / SECOND) if other.since is None else WOULD_BE_SINCE(time=other.since / SECOND)
    return Trial(link, Effect.OTHER_TIME, told, other.since)


def _began(snapshots: SnapshotsWithInputs, root: Root) -> Nanos:
    """When a root came: a request on a line with timing came before it was whole."""
    if not isinstance(root, Sent):
        return root.time
    state = snapshots.state_at(max(snapshots.begin, root.time - LONGEST_FRAME_NS))
    sent = [one.time for one in snapshots.inputs_from(state.inputs) if one.time <= root.time and _is_of(one, root)]
    return max(sent, default=root.time)


def _is_of(given: RecordedInput, root: Sent) -> bool:
    return isinstance(given.what, Bytes) and given.what[:2] == (root.line, root.place)


class _RunWithout:
    """Makes worlds like ``world`` at a snapshot in which ``roots`` never come."""

    def __init__(self, world: Simulation, snapshot: SimulationSnapshot, roots: Sequence[Root]) -> None:
        self._blueprint = world.blueprint
        self._snapshot = snapshot
        self._roots = roots
        self._without: list[Root] = []
        """Those that have been left out."""

    @property
    def is_without(self) -> bool:
        """Whether all roots have been left out."""
        return all(root in self._without for root in self._roots)

    def make(self) -> Simulation:
        """A world in which they are left out."""
        world = Simulation(self._blueprint, keep_trace=False, keep_inputs=False, at=self._snapshot)
        world.trace.stop()
        leaves_out: list[Callable[[str, do.Step], bool]] = []
        for root in self._roots:
            if isinstance(root, SetFault) and world.objects.faults.find(root.name) is not None:
                world.perform(do.ClearFault(root.name))
                self._without.append(root)
            act = root if isinstance(root, Act) else root.by if isinstance(root, SetFault) else None
            fault = root.name if isinstance(root, SetFault) else "" if act is None else act.fault
            if fault:  # others keep the names that they have
                world.objects.faults.reserved.add(fault)
            if fault or (act is not None and act.script):
                leaves_out.append(partial(self._is_left_out, world, root, act, do.ClearFault(fault)))
        if leaves_out:
            world.leave_out(lambda script, step: True in [one(script, step) for one in leaves_out])
        return world

    def _is_left_out(
        self, world: Simulation, root: Root, act: Act | None, clears: do.ClearFault, script: str, step: do.Step
    ) -> bool:
        is_left_out = act is not None and (world.now, script, step) == act[:3]
        if step == clears and clears.name in world.objects.faults.reserved:
            world.objects.faults.reserved.remove(clears.name)
            return True
        if is_left_out:
            self._without.append(root)
        return is_left_out

    def inputs(self, inputs: Sequence[RecordedInput]) -> list[RecordedInput]:
        """Inputs from outside, without them."""
        found: list[RecordedInput] = []
        for root in self._roots:
            left_out = self._inputs_of(root, inputs)
            found += left_out
            if left_out:
                self._without.append(root)
        return [one for one in inputs if not any(one is other for other in found)]

    @staticmethod
    def _inputs_of(root: Root, inputs: Sequence[RecordedInput]) -> list[RecordedInput]:
        """Those by which a root comes, and those that end it."""
        match root:
            case Sent(time):
                return [one for one in reversed(inputs) if _is_of(one, root) and one.time <= time][:1]
            case Act(time, "", what, fault=fault):
                given = [one for one in inputs if (one.time, one.what) == (time, what)][:1]
                return [*given, *(one for one in inputs if one.what == do.ClearFault(fault))]
            case SetFault(_, name, by):
                act = (by.time, by.what) if by is not None and not by.script else None
                return [one for one in inputs if (one.time, one.what) == act or one.what == do.ClearFault(name)]
        return []
