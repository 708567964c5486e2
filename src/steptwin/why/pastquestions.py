"""Questions about the past of a world, answered from its snapshots and inputs (`steptwin.simulation.world.snapshotlog`).

What may be a cause is noted in a second world, which runs through the past: from the newest state that is old enough, and from
older ones where the causes are older. It stays for further questions, which only need what happened since.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.faults.active import Faults
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot
from steptwin.simulation.world.snapshotlog import outside_past
from steptwin.why.answer import ALL_LINKS, MOST_LINKS, Answer, ChainLink, Effect, Trial
from steptwin.why.question import Asking, Lacking, Why
from steptwin.why.roots import SetFault
from steptwin.why.search import Asked, LastChanges, Snapshots
from steptwin.why.without import trying_without

FIRST_SPAN_NS: Nanos = 5 * SECOND
"""So much of the past is searched first, and `FURTHER` times as much where the causes are older."""
FIRST_STATEMENTS = 5500
"""Most statements of a program at first: some more than the last ones, among which the one that decided is looked for."""
FURTHER = 8
STANDS_NS: Nanos = SECOND
"""Time after which a state may be because of any fault that has acted before, whatever it would be a moment earlier or later."""
MOST_SUSPECTS = 4
"""Limit of the faults that are tried for one question, the last ones first."""
WITHOUT_IT = Message("why.without-it", "{what}; without it: {state}")
MOST_NOTED = 500_000
"""Limit of the records and statements that are noted: some 100 MB."""


class SnapshotsAndInputs(Snapshots, Protocol):
    """The past of a world in `steptwin.simulation.world.snapshotlog.SnapshotLog`."""

    def keeps_inputs_from(self, number: int) -> bool: ...
    def inputs_from(self, number: int) -> Sequence[RecordedInput]: ...


class PastQuestions:
    """Answers questions about the past in ``snapshots``. ``most``: limit of what is noted."""

    def __init__(self, snapshots: SnapshotsAndInputs, most: int | None = None) -> None:
        self._snapshots = snapshots
        self._most = MOST_NOTED if most is None else most
        self._known: _Known | None = None
        self._most_links = MOST_LINKS
        self._changes = LastChanges(snapshots, second_world)

    def asking(self, question: str, at: Nanos | None = None, *, try_without: bool = False, everything: bool = False) -> Asking:
        """The answer for a moment, by default the present, with ``everything`` that is found. ``try_without``: the same, and what
        would be without each of its roots. Raises `Misuse` for what is no question here."""
        self._most_links = ALL_LINKS if everything or try_without else MOST_LINKS
        answer = yield from self._asking(question, at)
        tried: dict[str, Trial] = {}
        for name in self._suspects(answer):
            trial = yield from self._without_fault(name, answer)
            if trial is not None:
                tried[name] = trial
        lacking = () if self._known is None else (yield from self._known.lacking(question, answer.at))
        answer = answer._replace(links=tuple(dict.fromkeys((*lacking, *_with(answer.links, tried.values())))))
        if not try_without:
            return answer
        trials: list[Trial] = []
        for link in answer.links:
            if link.root is not None:
                known = tried.get(link.root.name) if isinstance(link.root, SetFault) else None
                trials.append(known or (yield from trying_without(self._snapshots, link, answer, self._most)))
        return answer._replace(trials=tuple(trials))

    def _suspects(self, answer: Answer) -> Sequence[str]:
        """The faults that may be why something is so, as far as the chain does not have them, the last ones first."""
        if self._known is None:
            return ()
        faults, at = self._known.faults, answer.at
        there = {link.root.name for link in answer.links if isinstance(link.root, SetFault)}
        acted = [
            (acts.last, name)
            for name, acts in faults.acts.items()
            if name not in there
            and acts.first <= at
            and (self._is_near(name, answer) or self._known.changes_at_once(answer.question))
        ]
        return [name for _, name in sorted(acted, reverse=True)][:MOST_SUSPECTS]

    def _is_near(self, name: str, answer: Answer) -> bool:
        """Whether something has been so for `STANDS_NS`, or a fault does something at the moment, or has since it is so."""
        if self._known is None:
            return False
        faults, since = self._known.faults, answer.known_from if answer.since is None else answer.since
        one = faults.find(name)
        return answer.at - since >= STANDS_NS or faults.acts[name].last >= since or bool(one is not None and one.doing)

    def _without_fault(self, name: str, answer: Answer) -> Generator[None, None, Trial | None]:
        """The run without a fault, if what was asked for is otherwise then; where the fault was long before, also for
        `STANDS_NS` before and after: it may be later or earlier without it."""
        if self._known is None:
            return None
        link = self._known.fault_link(name, answer.at)
        around = 0 if self._is_near(name, answer) else STANDS_NS
        trial = yield from trying_without(self._snapshots, link, answer, self._most, around=around)
        return trial if trial.effect is Effect.OTHERWISE else None

    def _asking(self, question: str, at: Nanos | None) -> Asking:
        snapshots = self._snapshots
        now = snapshots.world.now
        at = now if at is None else at
        if not snapshots.begin <= at <= now:
            raise Misuse(outside_past(at, snapshots.begin, now))
        known, span = self._known, first_span(snapshots.world)
        if known is None or not known.fits(at, now - span):
            known = self._known = _Known(snapshots, max(snapshots.begin, at - span), self._most)
        answer = yield from known.asking(question, at, self._most_links)
        if answer.is_cut and answer.since is None and (asked := known.asked(question)) is not None:
            found = yield from self._changes.before(asked, known.begin)
            if answer.links and snapshots.begin <= answer.links[0].time < known.begin:  # a fault has held it since then
                answer = (yield from self._then(question, answer.links[0].time))._replace(at=at, since=None)
            if found.since is None:
                begin = found.known_from
                if begin == 0 and known.rests(question, at):
                    return (yield from self._further(known, question, at, answer))._replace(known_from=begin)
                return answer._replace(
                    links=known.since(answer, asked.signals, begin), known_from=begin, is_cut=begin > 0, is_complete=begin == 0
                )
            before = yield from self._then(question, found.since, further=True)
            if before.since == found.since:
                return _joined(answer, before, self._most_links)
        return (yield from self._further(known, question, at, answer))

    def _then(self, question: str, at: Nanos, *, further: bool = False) -> Asking:
        """The answer for a moment from what is noted near it; ``further``: and from older states, as `_further`."""
        snapshots = self._snapshots
        known = _Known(snapshots, max(snapshots.begin, at - first_span(snapshots.world)), self._most)
        return (yield from self._further(known, question, at) if further else known.asking(question, at, self._most_links))

    def _further(self, known: _Known, question: str, at: Nanos, answer: Answer | None = None) -> Asking:
        """The answer from what is known, and from older states as long as causes are older."""
        is_near = known is self._known
        answer = (yield from known.asking(question, at, self._most_links)) if answer is None else answer
        while answer.is_cut and (older := known.older(at)) is not None:
            yield
            try:
                known = _Known(self._snapshots, older, self._most)
                answer = yield from known.asking(question, at, self._most_links)
            except Misuse:
                break
            if is_near:
                self._known = known
        return answer


class _Known:
    """Log of the past from a state of it on. ``moment``: from the newest state at or before it."""

    def __init__(self, snapshots: SnapshotsAndInputs, moment: Nanos, most: int) -> None:
        state = snapshots.state_at(moment)
        self._taken = state.inputs
        self._snapshots = snapshots
        self._branch = snapshots.branch
        self._most = most
        self._why = Why(partial(second_world, snapshots.world, state.snapshot), (), state.snapshot.now, most)

    def fits(self, at: Nanos, not_before: Nanos) -> bool:
        """Whether a question about a moment can be answered from it. ``not_before``: up to when it must have come."""
        snapshots, log = self._snapshots, self._why.log
        is_same = snapshots.branch == self._branch and snapshots.keeps_inputs_from(self._taken)
        has_room = log.noted < self._most // 2 or at <= self._why.end
        return is_same and log.begin <= at and not_before <= self._why.end and has_room

    @property
    def faults(self) -> Faults:
        """Those of the world at the end of what is known."""
        return self._why.log.world.objects.faults

    def changes_at_once(self, question: str) -> bool:
        """Whether a question is about a level or condition, not about a program or a quantity that moves."""
        return self._why.asked(question) is not None

    def lacking(self, question: str, at: Nanos) -> Lacking:
        """See `Why.lacking`."""
        return self._why.lacking(question, at)

    def fault_link(self, name: str, until: Nanos) -> ChainLink:
        """A fault as a cause, by a moment."""
        return self._why.fault_link(name, until)

    @property
    def begin(self) -> Nanos:
        """From when on it is known."""
        return self._why.log.begin

    def since(self, answer: Answer, signals: Iterable[str], begin: Nanos) -> tuple[ChainLink, ...]:
        """See `Why.since`."""
        return self._why.since(answer, signals, begin)

    def rests(self, question: str, at: Nanos) -> bool:
        """See `Why.rests`."""
        return self._why.rests(question, at)

    def asked(self, question: str) -> Asked | None:
        """See `Why.asked`."""
        return self._why.asked(question)

    def asking(self, question: str, at: Nanos, most_links: int) -> Asking:
        inputs = self._snapshots.inputs_from(self._taken)
        self._taken += len(inputs)
        self._why.go_on(inputs, max(at, self._why.end))
        return (yield from self._why.asking(question, at, most_links))

    def older(self, at: Nanos) -> Nanos | None:
        """Where a longer search would begin; None if nothing older is kept, or too much has happened since."""
        snapshots, log, end = self._snapshots, self._why.log, self._why.end
        span = FURTHER * max(at - log.begin, 1)
        if log.noted:
            span = min(span, self._most * (end - log.begin) // (2 * log.noted) - (end - at))
        moment = max(snapshots.begin, at - span)
        return moment if moment < log.begin and snapshots.state_at(moment)[0].now < log.begin else None


def _with(links: Sequence[ChainLink], trials: Iterable[Trial]) -> tuple[ChainLink, ...]:
    """Links with those of trials, each before the first one that was earlier."""
    found = list(links)
    for trial in trials:
        place = next((number for number, link in enumerate(found) if link.time < trial.link.time), len(found))
        found.insert(place, replace(trial.link, text=WITHOUT_IT(what=trial.link.text, state=trial.text)))
    return tuple(found)


def _joined(answer: Answer, before: Answer, most_links: int) -> Answer:
    """``before``: the answer for the moment of the last change, before all that is known of the later one; what has held it
    since comes first."""
    held = [link for link in answer.links if link not in before.links] if answer.links and answer.links[0].root else []
    links = (*(held if held and held[0].time > (before.since or 0) else ()), *before.links)
    is_all = len(links) <= most_links
    return before._replace(
        at=answer.at, links=links[:most_links], is_complete=before.is_complete and is_all, is_cut=before.is_cut and is_all
    )


def first_span(world: Simulation) -> Nanos:
    """How much of the past of a world is searched first: less where statements take less time."""
    times = [programs.statement_time for programs in world.programs.values() if programs.statement_time]
    return min([FIRST_SPAN_NS, *(FIRST_STATEMENTS * time for time in times)])


def second_world(world: Simulation, snapshot: SimulationSnapshot) -> Simulation:
    """Another one like it, at a snapshot, which records nothing."""
    second = Simulation(world.blueprint, keep_trace=False, keep_inputs=False, at=snapshot)
    second.trace.stop()
    return second
