"""Questions about a world that goes on in real time (`steptwin.why.pastquestions`)."""

from __future__ import annotations

import asyncio
from functools import partial
from time import perf_counter

from steptwin.errors import Refusal, SteptwinError
from steptwin.later import Later
from steptwin.live.timetravel import PART_S
from steptwin.live.world import LiveWorld
from steptwin.messages import Message
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.subject.debugcommands import AskWhy as Wanted
from steptwin.why.pastquestions import PastQuestions
from steptwin.why.question import Asking

MOST_QUESTIONS = 16
"""Questions that wait."""
ANSWER_S = 20.0
"""After so long an answer says what is known by then: a past in which time went fast takes long to be run again. [real time]"""
KEPT_S = 60.0
"""After so long without a question what was noted is dropped, s."""
NO_PAST = Message("live.no-past", "no past is kept here: start the twin with 'steptwin up --past' or in the studio")
TOO_MANY_QUESTIONS = Message("live.too-many-questions", "too many questions: the limit is {most}; wait for an answer")


class LiveWhy:
    """Answers questions about the past of ``live``, one after the other, in parts between which the world is served."""

    def __init__(self, live: LiveWorld) -> None:
        self._live = live
        self._waiting: list[tuple[Wanted, Later[object]]] = []
        self._asking: Asking | None = None
        self._past: tuple[SnapshotLog, PastQuestions] | None = None
        self._timer: asyncio.TimerHandle | None = None

    def ask(self, wanted: Wanted) -> Later[object]:
        """The answer as plain data. Raises `Refusal` where no past is kept, and for too many questions at once."""
        if self._live.snapshots is None:
            raise Refusal(NO_PAST())
        if len(self._waiting) >= MOST_QUESTIONS:
            raise Refusal(TOO_MANY_QUESTIONS(most=MOST_QUESTIONS))
        later = Later[object]()
        self._waiting.append((wanted, later))
        if len(self._waiting) == 1:
            self._part()
        return later

    def _part(self) -> None:
        wanted, later = self._waiting[0]
        until = perf_counter() + PART_S
        try:
            if self._asking is None:
                is_over = partial(_is_past, perf_counter() + ANSWER_S)
                self._asking = self._kept_past().asking(
                    wanted.question, wanted.at, try_without=wanted.try_without, everything=wanted.everything, is_over=is_over
                )
            next(self._asking)
            while perf_counter() < until:
                next(self._asking)
        except StopIteration as end:
            self._end(partial(later.put, end.value.to_json()))
        except SteptwinError as error:
            self._end(partial(later.fail, error))
        else:
            asyncio.get_running_loop().call_later(PART_S, self._part)

    def _end(self, answered: partial[None]) -> None:
        self._asking = None
        del self._waiting[0]
        loop = asyncio.get_running_loop()
        if self._timer is not None:
            self._timer.cancel()
        self._timer = loop.call_later(KEPT_S, self._forget)
        if self._waiting:
            loop.call_soon(self._part)
        answered()

    def _forget(self) -> None:
        if self._asking is None:
            self._past = None

    def _kept_past(self) -> PastQuestions:
        """Raises `Refusal` where no past is kept any more."""
        snapshots = self._live.snapshots
        if snapshots is None:
            raise Refusal(NO_PAST())
        if self._past is None or self._past[0] is not snapshots:
            self._past = snapshots, PastQuestions(snapshots)
        return self._past[1]


def _is_past(moment: float) -> bool:
    return perf_counter() > moment
