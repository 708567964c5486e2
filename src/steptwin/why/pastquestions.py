"""Questions about the past of a world, answered from its snapshots and inputs (`steptwin.simulation.world.snapshotlog`).

What may be a cause is noted in a second world, which runs through the past: from the newest state that is old enough, and from
older ones where the causes are older. It stays for further questions, which only need what happened since.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce
from typing import Protocol, TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.world.actions import is_release
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot
from steptwin.simulation.world.snapshotlog import SLICE_NS, LoggedSnapshot, outside_past
from steptwin.why.answer import ALL_LINKS, MOST_LINKS, Answer, ChainLink, Effect, Trial
from steptwin.why.causes import AND, Causes
from steptwin.why.lacking import Found, Lacking
from steptwin.why.log import LAST, in_parts
from steptwin.why.notedpast import NotedPast
from steptwin.why.question import PROGRAM_IS, Asking, Why
from steptwin.why.roots import Act, Root, SetFault
from steptwin.why.scripts import acted
from steptwin.why.search import Asked, LastChanges, Snapshots
from steptwin.why.whynot import what_lacks
from steptwin.why.without import NOT_TRIED, Trying, trying_without

FIRST_SPAN_NS: Nanos = 5 * SECOND
"""So much of the past is searched first, and `FURTHER` times as much where the causes are older."""
FIRST_STATEMENTS = 5500
"""Most statements of a program at first: some more than the last ones, among which the one that decided is looked for."""
FURTHER = 8
SEARCHED_SHARE = 16
"""Part of what is before the log, one of so many, that is searched before all of it is noted instead."""
STANDS_NS: Nanos = SECOND
"""Time after which a state may be because of any fault that has acted before, whatever it would be a moment earlier or later."""
MOST_SUSPECTS = 4
"""Limit of the faults that are tried for one question, the last ones first."""
LONGEST_TRIED_NS: Nanos = 300 * SECOND
"""Longest time that is run again without the last actions."""
WITHOUT_IT = Message("why.without-it", "{what}; without it: {state}")
WITHOUT_THEM = Message("why.without-them", "{what}; without it and {others}: {state}")
MOST_NOTED = 500_000
"""Limit of the records and statements that are noted: some 100 MB."""
TIME_IS_OVER = Message("why.time-is-over", "there was no time to run the past again without it")


_T = TypeVar("_T")


class SnapshotsAndInputs(Snapshots, Protocol):
    """The past of a world in `steptwin.simulation.world.snapshotlog.SnapshotLog`."""

    def keeps_inputs_from(self, number: int) -> bool: ...
    def inputs_from(self, number: int) -> Sequence[RecordedInput]: ...


class PastQuestions:
    """Answers questions about the past in ``snapshots``. ``most``: limit of what is noted."""

    def __init__(self, snapshots: SnapshotsAndInputs, most: int | None = None) -> None:
        self._snapshots = snapshots
        self._most = MOST_NOTED if most is None else most
        self._logs: list[_Known] = []
        """The one with the moment that was asked about last, and parts of the past before it in which causes were."""
        self._lacking = Lacking()
        self._kept_to: set[Nanos] = set()
        """Beginnings of logs that cannot be longer."""
        self._searched = 0
        """Slices of the past that were run again for the question besides the log."""
        self._most_links = MOST_LINKS
        self._is_over: Callable[[], bool] = lambda: False
        self._gives_up = False
        """Whether what is asked now is answered with what is known."""
        self._changes = LastChanges(snapshots, second_world)

    def asking(
        self,
        question: str,
        at: Nanos | None = None,
        *,
        try_without: bool = False,
        everything: bool = False,
        is_over: Callable[[], bool] = lambda: False,
    ) -> Asking:
        """The answer for a moment, by default the present, with ``everything`` that is found. ``try_without``: the same, and what
        would be without each of its roots. Where ``is_over`` the answer is given with what is known by then. Raises `Misuse` for
        what is no question here."""
        self._is_over = is_over
        self._most_links = ALL_LINKS if everything or try_without else MOST_LINKS
        snapshots = self._snapshots
        now = snapshots.world.now
        at = now if at is None else at
        if not snapshots.begin <= at <= now:
            raise Misuse(outside_past(at, snapshots.begin, now))
        span = first_span(snapshots.world)
        if not self._logs or not self._logs[0].fits(at, now - span):
            self._lacking.forget()
            self._logs = [(yield from self._note_near(max(snapshots.begin, at - span)))]
        self._kept_to.clear()
        self._searched = 0
        answer = yield from self._settled(lambda known: self._answer(known, question, at))
        answer = yield from self._with_held(answer)
        lacking = yield from self._settled(lambda known: what_lacks(known.past, question, at))
        answer = answer._replace(links=(*lacking, *answer.links))
        tried: list[Trial] = []
        held_back: list[Trial] = []
        suspects = self._suspects(answer)
        programs = yield from self._standing(answer if suspects else answer._replace(links=()))
        for name in suspects:
            first, *others = yield from self._without_fault(name, (answer, *programs))
            if _decides(first, answer):
                tried.append(first)
            else:
                held_back += [one for one, stand in zip(others, programs, strict=True) if _decides(one, stand)][:1]
        masked = () if tried or held_back or not suspects else (yield from self._masking(suspects, answer))
        tried += yield from self._deciding_acts(answer, is_rootless=not (tried or held_back or masked))
        links = _between(_with(answer.links[len(lacking) :], (*tried, *held_back)), masked)
        answer = answer._replace(links=tuple(dict.fromkeys((*lacking, *links))))
        if not try_without:
            return answer
        trials: list[Trial] = []
        for link in answer.links:
            if link.root is not None:
                known = next((one for one in tried if one.link.root == link.root), None)
                trials.append(known or (yield from self._trying(link, (answer,)))[0])
        return answer._replace(trials=tuple(trials))

    def _suspects(self, answer: Answer) -> Sequence[str]:
        """The faults that may be why something is so, as far as the chain does not have them, the last ones first."""
        faults, at = self._logs[0].past.log.world.objects.faults, answer.at
        there = {link.root.name for link in answer.links if isinstance(link.root, SetFault)}
        acted = [
            (acts.last, name)
            for name, acts in faults.acts.items()
            if name not in there
            and acts.first <= at
            and (self._is_near(name, answer) or self._logs[0].why.values.asked(answer.question) is not None)
        ]
        return [name for _, name in sorted(acted, reverse=True)][:MOST_SUSPECTS]

    def _is_near(self, name: str, answer: Answer) -> bool:
        """Whether something has been so for `STANDS_NS`, or a fault does something at the moment, or has since it is so."""
        faults, since = self._logs[0].past.log.world.objects.faults, answer.known_from if answer.since is None else answer.since
        one = faults.find(name)
        return answer.at - since >= STANDS_NS or faults.acts[name].last >= since or bool(one is not None and one.doing)

    def _standing(self, answer: Answer) -> Generator[None, None, Sequence[Answer]]:
        """Answers about where the programs stand that an answer names."""
        names = (link.subject for link in answer.links if link.is_stand)
        found: dict[str, Answer] = {}
        for name in dict.fromkeys(names):
            found[name] = yield from self._settled(lambda known, name=name: self._answer(known, name, answer.at))
        return [*found.values()]

    def _deciding_acts(self, answer: Answer, *, is_rootless: bool) -> Generator[None, None, list[Trial]]:
        """The runs without each of the last acts of scripts and from outside, as far as something is so because of them: acts
        after all causes, which cannot say why it still is; any, where a whole chain has no root, unless nothing drives it."""
        is_rootless &= answer.is_complete and not any(link.root for link in answer.links)
        if is_rootless and self._logs[0].why.is_undriven(answer.question):
            return []
        after = -1 if is_rootless else max((link.time for link in answer.links if link.time < answer.at), default=-1)
        there = yield from self._settled(lambda known: known.past.world_at(answer.at))
        since = answer.known_from if answer.since is None else answer.since
        roots = [link.root[:3] for link in answer.links if isinstance(link.root, Act)]
        acts = [one for one in there.acts if one.time > after and one not in roots and not is_release(one.script)]
        near = [one for one in acts if one.time >= since or answer.at - since >= STANDS_NS]
        near = [one for one in near if answer.at - one.time <= LONGEST_TRIED_NS][-MOST_SUSPECTS:]
        found: list[Trial] = []
        for one in near:
            link = acted(Act(one.time, one.script, one.what, order=LAST, by=one.script)).link
            (trial,) = yield from self._trying(link, (answer,))
            found += [trial] if _decides(trial, answer) else []
        return found

    def _without_fault(self, name: str, answers: Sequence[Answer]) -> Generator[None, None, Sequence[Trial]]:
        """The run without a fault, for each of some answers. The first one, of what was asked, counts also for `STANDS_NS` before
        and after, where the fault was long before: it may be later or earlier without it."""
        link = yield from self._settled(lambda known: known.find(lambda why: why.fault_link(name, answers[0].at)))
        around = 0 if self._is_near(name, answers[0]) else STANDS_NS
        return (yield from self._trying(link, answers, around))

    def _trying(self, link: ChainLink, answers: Sequence[Answer], around: Nanos = 0, others: Sequence[Root] = ()) -> Trying:
        trying = trying_without(self._snapshots, link, answers, self._most, around=around, others=others)
        found = yield from self._in_time(trying)
        return found or [Trial(link, Effect.UNKNOWN, NOT_TRIED(problem=TIME_IS_OVER())) for _ in answers]

    def _in_time(self, work: Generator[None, None, _T]) -> Generator[None, None, _T | None]:
        """Its result; None where the time is over before."""
        while not self._is_over():
            try:
                next(work)
            except StopIteration as end:
                return end.value
            yield
        work.close()
        return None

    def _masking(self, suspects: Sequence[str], answer: Answer) -> Generator[None, None, Sequence[ChainLink]]:
        """Those of the suspects, of the faults that hold signals, and of those that are set but could not act yet, of which each
        is enough: without one something is the same, without all it is otherwise."""
        faults = {link.root.name: link for link in answer.links if isinstance(link.root, SetFault)}
        log, at = self._logs[0].past.log, answer.at
        active = (one for one in log.world.objects.faults.active if one.begin <= at and (one.end is None or at < one.end))
        acts = log.world.objects.faults.acts
        idle = (one.name for one in active if one.name not in acts or acts[one.name].first > at)
        others = {*log.holding(at), *idle}
        suspects = [*suspects, *sorted(others - {*faults, *suspects})[:MOST_SUSPECTS]]
        for name in suspects:
            faults[name] = yield from self._settled(
                lambda known, name=name: known.find(lambda why: why.fault_link(name, answer.at))
            )
        if len(faults) == 1:
            return ()
        without_all = yield from self._without_all([*faults.values()], answer)
        if without_all.effect is not Effect.OTHERWISE:
            return ()
        for name in suspects:
            others = [link for other, link in faults.items() if other != name]
            if (yield from self._without_all(others, answer)).effect is Effect.OTHERWISE:
                del faults[name]
        if len(faults) == 1 or self._is_over():  # what was not tried in time may have no part
            return ()
        found: list[ChainLink] = []
        for name in suspects:
            if name in faults:
                others = reduce(lambda one, other: AND(one=one, other=other), [one for one in faults if one != name])
                text = WITHOUT_THEM(what=faults[name].text, others=others, state=without_all.text)
                found.append(replace(faults[name], text=text))
        return found

    def _without_all(self, links: Sequence[ChainLink], answer: Answer) -> Generator[None, None, Trial]:
        """The run without the roots of links."""
        others = [link.root for link in links[1:] if link.root is not None]
        return (yield from self._trying(links[0], (answer,), others=others))[0]

    def _with_held(self, answer: Answer) -> Asking:
        """An answer with what the programs stand at, or are held by, that could have changed what it is about since."""
        standing = yield from self._settled(lambda known: known.find(lambda why: why.standing(answer)))
        links = answer.links
        for controller, is_held in standing.items():
            stands = yield from self._settled(lambda known, controller=controller: self._answer(known, controller, answer.at))
            time, text = answer.at if stands.since is None else stands.since, stands.state.message("held") or stands.state
            is_over = stands.state.id == PROGRAM_IS.id and time > (answer.since or 0)
            led = stands.links if is_held or is_over else [link for link in stands.links if link.time == answer.at]
            known = {(link.subject, link.text) for link in links}
            if (controller, text) not in known:
                every = (ChainLink(time, controller, text, is_stand=not is_held), *led)
                links = _between(links, [link for link in every if (link.subject, link.text) not in known])
        return answer._replace(links=links)

    def _answer(self, known: _Known, question: str, at: Nanos) -> Asking:
        """The answer, cut where something lacks."""
        answer = yield from known.asking(question, at, self._most_links)
        begins = self._lacking.begins if not self._gives_up else self._lacking.everything(known.past.log.begin)
        is_cut, known_from = bool(begins), max(begins, default=self._snapshots.begin)
        asked = None if answer.since is not None else known.why.values.asked(question)
        if asked is not None:
            known_from = known.past.log.before(asked.text).known_from
            is_cut = known_from > 0
        if self._gives_up and begins:
            is_cut, known_from = True, max(known_from, *begins)
        return answer._replace(is_cut=is_cut, known_from=known_from, is_complete=answer.is_complete and not begins)

    def _settled(self, ask: Callable[[_Known], Generator[None, None, _T]]) -> Generator[None, None, _T]:
        """Result when nothing lacks for it that can be had."""
        while True:
            self._lacking.begin()
            self._gives_up = self._is_over()
            found = yield from ask(self._logs[0])
            if self._gives_up or not (yield from self._have_more()):
                return found

    def _have_more(self) -> Generator[None, None, bool]:
        """Have some of what lacks; whether there was something to be had."""
        moments, changes = sorted(self._lacking.moments), dict(self._lacking.changes)
        for moment in moments:
            self._searched += (moment - self._snapshots.state_at(max(0, moment - 1)).snapshot.now) // SLICE_NS
            if self._is_longer_cheaper():
                yield from self._have_longer(self._logs[0].past.log.begin)
                return True
            yield from self._note_about(moment)
        for moment in set(changes.values()):
            texts = [text for text, before in changes.items() if before == moment]
            asked = [one for text in texts if (one := self._logs[0].why.values.asked(text)) is not None]
            found = yield from self._searching(asked, moment)
            if found is None and self._is_over():
                return True
            if found is None:
                yield from self._have_longer(self._logs[0].past.log.begin)
                return True
            for text in texts:
                self._lacking.learn(text, moment, found.get(text, Found(None, moment)))
        if moments or changes:
            return True
        begins = self._lacking.begins - self._kept_to
        for begin in begins:
            yield from self._have_longer(begin)
        return bool(begins)

    def _searching(self, asked: Sequence[Asked], moment: Nanos) -> Generator[None, None, Mapping[str, Found] | None]:
        """The last changes before a moment; None as soon as a longer log is cheaper."""
        searching = self._changes.before(asked, moment)
        while not self._is_longer_cheaper() and not self._is_over():
            try:
                next(searching)
            except StopIteration as end:
                return end.value
            self._searched += 1
            yield
        searching.close()
        return None

    def _is_longer_cheaper(self) -> bool:
        """Whether the next longer log has the whole past, and a good part of that was searched already, which is for one question
        only."""
        log, begin = self._logs[0].past.log, self._snapshots.begin
        is_enough = self._searched > (log.begin - begin) // (SEARCHED_SHARE * SLICE_NS)
        return is_enough and log.begin > begin and log.begin not in self._kept_to and self._logs[0].older() == begin

    def _note(self, moment: Nanos) -> _Known:
        """A log from the newest state at or before a moment."""
        return self._note_from(self._snapshots.state_at(moment))

    def _note_from(self, state: LoggedSnapshot) -> _Known:
        return _Known(self._snapshots, state, self._most, self._lacking, self._causes_of)

    def _note_near(self, moment: Nanos) -> Generator[None, None, _Known]:
        """A log from a moment on, to which the past is run again from the newest state before it: where time has gone fast that
        may be so long before that there would be too much to note."""
        state, number = self._snapshots.state_at(moment), 0
        if moment - state.snapshot.now > FURTHER * FIRST_SPAN_NS:
            world = second_world(self._snapshots.world, state.snapshot)
            for is_input in in_parts(world, self._snapshots.inputs_from(state.inputs), moment):
                number += is_input
                yield
            state = LoggedSnapshot(world.snapshot(), state.inputs + number)
        return self._note_from(state)

    def _causes_of(self, moment: Nanos) -> Causes | None:
        """Causes of what was at a moment, if that is noted."""
        for part in self._logs:
            if part.past.log.covers(moment):
                return part.past.causes
        if self._snapshots.begin and moment <= self._snapshots.begin:
            self._lacking.lack(self._snapshots.begin)
        else:
            self._lacking.moments.add(moment)
        return None

    def _note_about(self, moment: Nanos) -> Generator[None, None, None]:
        """Note a part of the past up to a moment."""
        state = self._snapshots.state_at(max(0, moment - 1))
        part = next((one for one in self._logs[1:] if one.past.log.begin == state.snapshot.now), None)
        if part is None:
            part = self._note(state.snapshot.now)
            self._logs.append(part)
        yield from self._in_time(part.running(moment))

    def _have_longer(self, begin: Nanos) -> Generator[None, None, None]:
        """Have a log from before its beginning on."""
        part = next((one for one in self._logs if one.past.log.begin == begin), None)
        older = None if part is None else part.older()
        if part is None or older is None:
            self._kept_to.add(begin)
            return
        try:
            longer = self._note(older)
            yield from self._in_time(longer.running(part.past.end))
        except Misuse:
            self._kept_to.add(begin)
            return
        if longer.has_run:
            self._logs[self._logs.index(part)] = longer


class _Known:
    """Log of the past from a state of it on."""

    def __init__(
        self,
        snapshots: SnapshotsAndInputs,
        state: LoggedSnapshot,
        most: int,
        lacking: Lacking,
        others: Callable[[Nanos], Causes | None],
    ) -> None:
        self._taken = state.inputs
        self._snapshots = snapshots
        self._branch = snapshots.branch
        self._most = most
        make = partial(second_world, snapshots.world, state.snapshot)
        self.past = NotedPast(make, (), state.snapshot.now, most, lacking, others)
        self.why = Why(self.past)

    def fits(self, at: Nanos, not_before: Nanos) -> bool:
        """Whether a question about a moment can be answered from it. ``not_before``: up to when it must have come."""
        snapshots, log = self._snapshots, self.past.log
        is_same = snapshots.branch == self._branch and snapshots.keeps_inputs_from(self._taken)
        has_room = log.noted < self._most // 2 or at <= self.past.end
        return is_same and log.begin <= at and not_before <= self.past.end and has_room

    def asking(self, question: str, at: Nanos, most_links: int) -> Asking:
        self._go_on(at)
        return (yield from self.why.asking(question, at, most_links))

    def find(self, what: Callable[[Why], _T]) -> Generator[None, None, _T]:
        """Result of something that is found in one part."""
        yield
        return what(self.why)

    def running(self, moment: Nanos) -> Generator[None, None, None]:
        """Note what happened up to a moment."""
        self._go_on(moment)
        return self.past.running()

    @property
    def has_run(self) -> bool:
        """Whether everything up to its end is noted."""
        return self.past.log.covers(self.past.end)

    def _go_on(self, moment: Nanos) -> None:
        inputs = self._snapshots.inputs_from(self._taken)
        self._taken += len(inputs)
        self.past.go_on(inputs, max(moment, self.past.end))

    def older(self) -> Nanos | None:
        """Where a longer search would begin; None if nothing older is kept, or too much has happened since."""
        snapshots, log, end = self._snapshots, self.past.log, self.past.end
        span = FURTHER * max(end - log.begin, 1)
        if log.noted:
            span = min(span, self._most * (end - log.begin) // (2 * log.noted))
        moment = max(snapshots.begin, end - span)
        return moment if moment < log.begin and snapshots.state_at(moment)[0].now < log.begin else None


def _between(links: Sequence[ChainLink], others: Iterable[ChainLink]) -> tuple[ChainLink, ...]:
    """Links with others, each before the first one that was earlier."""
    found = list(links)
    for other in others:
        place = next((number for number, link in enumerate(found) if link.time < other.time), len(found))
        found.insert(place, other)
    return tuple(found)


def _decides(trial: Trial, answer: Answer) -> bool:
    """Whether something is so because of a fault: without it, it would be otherwise; or over meanwhile, and so again only since
    later, as a wait of a machine that goes on in its cycle."""
    later = None if trial.since is None or answer.since is None else trial.since - answer.since
    return trial.effect is Effect.OTHERWISE or (later is not None and later >= STANDS_NS)


def _with(links: Sequence[ChainLink], trials: Iterable[Trial]) -> tuple[ChainLink, ...]:
    """Links with those of trials."""
    return _between(links, (replace(one.link, text=WITHOUT_IT(what=one.link.text, state=one.text)) for one in trials))


def first_span(world: Simulation) -> Nanos:
    """How much of the past of a world is searched first: less where statements take less time."""
    times = [programs.statement_time for programs in world.programs.values() if programs.statement_time]
    return min([FIRST_SPAN_NS, *(FIRST_STATEMENTS * time for time in times)])


def second_world(world: Simulation, snapshot: SimulationSnapshot) -> Simulation:
    """Another one like it, at a snapshot, which records nothing."""
    second = Simulation(world.blueprint, keep_trace=False, keep_inputs=False, at=snapshot)
    second.trace.stop()
    return second
