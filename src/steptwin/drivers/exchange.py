"""One line with one exchange at a time: order of jobs, sending, matching of answers, time-outs. No I/O, no clock.

A shell (`steptwin.drivers.threads`, `steptwin.drivers.tasks`) has the bytes and the time. It calls `step` at each `deadline`
and after each new job, sends the bytes that `step` returns, calls `written`, and passes received bytes to `receive`.

Order of jobs: an urgent job (a stop) is always next. Other jobs are served in order of arrival; during the pause that a
device needs after an exchange, jobs for other devices may be served. Nothing is sent during an exchange.

The protocol of a line is in its `Discipline`; nothing here knows Modbus.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from typing import Generic, NamedTuple, Protocol, TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Refusal, SteptwinError
from steptwin.messages import Message, text_of


class LineRequest(Protocol):
    """A request. Its text is for people: ``unit 1: read M1_POS_ACT``."""

    @property
    def device(self) -> Hashable:
        """The device it is for: each device on a line has its own pauses."""
        ...

    @property
    def changes(self) -> bool:
        """Whether the device acts on it, so that after a lost answer it is unknown whether it did."""
        ...


Q = TypeVar("Q", bound=LineRequest)
A = TypeVar("A")
Q_contra = TypeVar("Q_contra", bound=LineRequest, contravariant=True)
A_co = TypeVar("A_co", covariant=True)


class SendNext(NamedTuple):
    """The next bytes to send in an exchange.

    ``may_wait``: an urgent job may be served before; the exchange then starts again.
    """

    data: bytes
    may_wait: bool


class ExchangeCounts(NamedTuple):
    """Counts of a line since it was made: ``requests`` that were sent, also again, and those that were refused or failed."""

    requests: int
    errors: int


class Discipline(Protocol[Q_contra, A_co]):
    """The protocol of a line: encoding of requests, matching of answers, resynchronisation."""

    @property
    def free_ns(self) -> Nanos:
        """The time before which nothing may be sent, ns."""
        ...

    @property
    def wary(self) -> bool:
        """Whether a late answer may still arrive, so that bytes received between exchanges must be discarded first."""
        ...

    def start(self, request: Q_contra, now: Nanos, *, urgent: bool) -> bytes:
        """Begin an exchange; returns the bytes to send."""
        ...

    def receive(self, data: bytes, now: Nanos) -> A_co | SendNext | None:
        """Take bytes received during the exchange; returns its answer, the next bytes to send, or None while more are needed.

        Raises `Refusal` if the device refused, `LineLost` if the connection cannot be used any longer, another `LineFailure` if
        the exchange failed.
        """
        ...

    def allowance_ns(self, request: Q_contra) -> Nanos:
        """Time that request and answer take on the wire, added to the time-out, ns."""
        ...

    def abandon(self, now: Nanos) -> bytes:
        """Give up waiting for the answer; returns the bytes received so far."""
        ...

    def stray(self, data: bytes, now: Nanos) -> None:
        """Take bytes received between exchanges."""
        ...

    def reset(self) -> None:
        """Forget the state of the old connection; no earlier answer can arrive on the new one."""
        ...


TRIED = Message("drivers.tried", ", tried {count} times")
ONLY_RECEIVED = Message("drivers.only-received", "only {received} was received, which is not an answer")
NOTHING_RECEIVED = Message("drivers.nothing-received", "nothing was received")
EXECUTED_OR_NOT = Message("drivers.executed-or-not", "; it is unknown whether the device has executed it")
NO_ANSWER = Message("drivers.no-answer", "{place}: no answer to '{request}' within {timeout_s:g} s{tries}; {what}{doubt}")
STOPPED_BEFORE_SENT = Message("drivers.stopped-before-sent", "'{request}' was not sent: a stop was requested meanwhile")
STOPPED_BEFORE_REPEATED = Message(
    "drivers.stopped-before-repeated", "'{request}' was not sent again: a stop was requested meanwhile"
)
TOO_LATE = Message(
    "drivers.too-late",
    "'{request}' was not sent: it was requested more than {patience_s:g} s ago; the program was suspended, "
    "or the line was busy. Repeat it",
)
SENT_LATE = Message(
    "drivers.sent-late",
    "'{request}' was sent more than {patience_s:g} s after it was requested, because the program was "
    "suspended at that moment; a motion that it began was stopped",
)
LOST_MEANWHILE = Message("drivers.lost-meanwhile", "{problem}; it is unknown whether '{request}' was executed")


class NoAnswer(LineFailure):
    """No valid answer in all permitted attempts.

    ``uncertain``: the device may have executed the request nevertheless.
    """

    def __init__(self, place: str, request: LineRequest, attempts: int, timeout_ns: Nanos, received: bytes) -> None:
        self.attempts = attempts
        self.received = received
        self.uncertain = request.changes
        tries = "" if attempts == 1 else TRIED(count=attempts)
        what = ONLY_RECEIVED(received=received.hex(" ")) if received else NOTHING_RECEIVED()
        doubt = EXECUTED_OR_NOT() if self.uncertain else ""
        timeout_s = timeout_ns / SECOND
        super().__init__(NO_ANSWER(place=place, request=request, timeout_s=timeout_s, tries=tries, what=what, doubt=doubt))


class LineLost(LineFailure):
    """The port or connection was lost or could not be opened."""


class Overtaken(Refusal):
    """A motion was not begun because a stop of its axis was requested meanwhile."""

    def __init__(self, request: object, attempts: int) -> None:
        super().__init__(STOPPED_BEFORE_REPEATED(request=request) if attempts else STOPPED_BEFORE_SENT(request=request))


class TooLate(Refusal):
    """A request was not sent: too much time had passed since the call, for example because the program was suspended."""

    def __init__(self, request: object, patience_ns: Nanos) -> None:
        super().__init__(TOO_LATE(request=request, patience_s=patience_ns / SECOND))


class SentLate(LineFailure):
    """A request was sent too late after the call: the program was suspended during the sending."""

    uncertain = True

    def __init__(self, request: object, patience_ns: Nanos) -> None:
        super().__init__(SENT_LATE(request=request, patience_s=patience_ns / SECOND))


class Job(Generic[Q, A]):
    """A request in the queue of a line, and its result.

    ``most``: how often it may be sent; more than once only if repeating it cannot move anything twice. ``permission`` is
    checked before anything of it is sent. ``on_done`` is called at the end.
    """

    __slots__ = (
        "_answer", "_error", "attempts", "done", "is_late", "missed", "most_attempts", "on_done", "permission", "request",
        "timeout_ns", "urgent",
    )  # fmt: skip

    def __init__(
        self,
        request: Q,
        timeout_ns: Nanos,
        *,
        most_attempts: int = 1,
        urgent: bool = False,
        permission: Permission | None = None,
    ) -> None:
        self.request = request
        self.timeout_ns = timeout_ns
        self.most_attempts = most_attempts
        self.urgent = urgent
        self.permission = permission
        self.attempts = 0
        """Number of failed attempts."""
        self.missed: LineFailure | None = None
        """Why the last attempt failed."""
        self.is_late = False
        """Whether it was sent after its permission had expired: the program was suspended between check and sending."""
        self.done = False
        self.on_done: Callable[[], object] | None = None
        self._answer: tuple[A, ...] = ()
        """Empty until there is one."""
        self._error: SteptwinError | None = None

    def result(self) -> A:
        """The answer of a finished job. Raises its error."""
        if self._error is not None:
            raise self._error
        (answer,) = self._answer
        return answer

    def refusal(self) -> SteptwinError | None:
        """The reason why it must not be sent now; None if it may be."""
        permission = self.permission
        if permission is None:
            return None
        if permission.is_stopped():
            return Overtaken(self.request, self.attempts)
        if permission.has_expired():
            return self.missed or TooLate(self.request, permission.patience_ns)
        return None

    def succeed(self, answer: A) -> None:
        if self.is_late and self.permission is not None:
            self.fail(SentLate(self.request, self.permission.patience_ns))
            return
        self._answer = (answer,)
        self.done = True
        if self.on_done is not None:
            self.on_done()

    def fail(self, error: SteptwinError) -> None:
        self._error = error
        self.done = True
        if self.on_done is not None:
            self.on_done()


class Exchanger(Generic[Q, A]):
    """Executes the jobs of one line. ``interval_ns``: the shortest time between two frames to the same device."""

    __slots__ = (
        "_current",
        "_deadline",
        "_due",
        "_errors",
        "_interval_ns",
        "_more",
        "_next",
        "_requests",
        "_urgent",
        "_waiting",
        "discipline",
        "on_missed",
        "place",
    )

    def __init__(self, discipline: Discipline[Q, A], place: str, interval_ns: Nanos = 0) -> None:
        self.discipline = discipline
        self.place = place
        self._interval_ns = interval_ns
        self._urgent: deque[Job[Q, A]] = deque()
        self._waiting: deque[Job[Q, A]] = deque()
        self._current: Job[Q, A] | None = None
        self._more: SendNext | None = None  # what the current exchange has still to send
        self._deadline: Nanos  # of the current exchange
        self._due: Nanos | None = None  # when the next one may begin
        self._next: dict[Hashable, Nanos] = {}  # when a device may be asked again
        self._requests = self._errors = 0
        self.on_missed: Callable[[Q, LineFailure], object] | None = None
        """Called with each attempt that failed, and why."""

    @property
    def counts(self) -> ExchangeCounts:
        return ExchangeCounts(self._requests, self._errors)

    @property
    def in_flight(self) -> bool:
        """Whether an exchange is in progress."""
        return self._current is not None

    @property
    def busy(self) -> bool:
        """Whether an exchange is in progress or jobs wait."""
        return self._current is not None or bool(self._urgent) or bool(self._waiting)

    def deadline(self) -> Nanos | None:
        """The time of the next call of `step`, ns, if no job or byte arrives before; None: none."""
        return self._deadline if self._current is not None else self._due

    # ------------------------------------------------------------------ waiting callers

    def submit(self, job: Job[Q, A]) -> None:
        (self._urgent if job.urgent else self._waiting).append(job)

    def withdraw(self, job: Job[Q, A]) -> None:
        """Cancel a job: it is not sent any more. An exchange in progress runs to its end."""
        job.done = True

    def fail_all(self, error: SteptwinError) -> None:
        """End all jobs with an error, because the line cannot be used."""
        jobs = [*self._urgent, *self._waiting]
        self._urgent.clear()
        self._waiting.clear()
        self._due = None
        for job in jobs:
            if not job.done:
                job.fail(error)

    # ------------------------------------------------------------------ time

    def step(self, now: Nanos) -> bytes:
        """The bytes to send at ``now``; empty during an exchange or without jobs."""
        current = self._current
        if current is not None:
            if now < self._deadline:
                return b""
            if self._more is not None:
                return self._go_on(current, now)
            received = self.discipline.abandon(now)
            self._current = None
            self._missed(current, NoAnswer(self.place, current.request, current.attempts + 1, current.timeout_ns, received))
        return self._begin(now)

    def _begin(self, now: Nanos) -> bytes:
        self._due = None
        queue = self._urgent
        if not queue:
            queue = self._waiting
            if not queue:
                return b""
        job = self._choose(queue, now)
        if job is None:
            return b""
        request = job.request
        try:
            data = self.discipline.start(request, now, urgent=job.urgent)
        except SteptwinError as error:  # whoever waits for it learns that, not the loop or the thread that happens to be here
            job.fail(error)
            return self._begin(now)
        self._requests += 1
        self._current = job
        self._sent(job, now)
        return data

    def _choose(self, queue: deque[Job[Q, A]], now: Nanos) -> Job[Q, A] | None:
        """Take the next job out of ``queue``, or compute when one may be sent."""
        due: Nanos | None = None
        free = self.discipline.free_ns
        for job in list(queue) if len(queue) > 1 else (queue[0],):
            if job.done:
                queue.remove(job)
                continue
            refusal = job.refusal()
            if refusal is not None:
                queue.remove(job)
                job.fail(refusal)
                continue
            begin = self._next.get(job.request.device, 0)
            begin = max(begin, free)
            if begin <= now:
                queue.remove(job)
                return job
            if due is None or begin < due:
                due = begin
            if job.urgent:
                break
        if due is None and self._waiting:
            due = now  # urgent jobs were refused: others may be behind them
        self._due = due
        return None

    def _go_on(self, job: Job[Q, A], now: Nanos) -> bytes:
        more = self._more
        self._more = None
        refusal = job.refusal()
        if refusal is not None or (job.done and job.permission is not None):
            self.discipline.abandon(now)
            self._current = None
            if refusal is not None and not job.done:
                job.fail(refusal)
            return self._begin(now)
        self._sent(job, now)
        return b"" if more is None else more.data

    def written(self) -> None:
        """Register that the bytes of `step` were sent. The program may have been suspended before."""
        job = self._current
        if job is not None and job.permission is not None and job.permission.has_expired():
            job.is_late = True

    def _sent(self, job: Job[Q, A], now: Nanos) -> None:
        self._deadline = now + job.timeout_ns + self.discipline.allowance_ns(job.request)
        if self._interval_ns:
            self._next[job.request.device] = now + self._interval_ns

    def _missed(self, job: Job[Q, A], error: LineFailure) -> None:
        """Handle a failed attempt: repeat it before jobs of the same rank, or give up."""
        self._errors += 1
        if self.on_missed is not None:
            self.on_missed(job.request, error)
        job.attempts += 1
        job.missed = error
        if job.done:
            return
        if job.is_late and job.permission is not None:
            job.fail(SentLate(job.request, job.permission.patience_ns))
        elif job.attempts < job.most_attempts:
            (self._urgent if job.urgent else self._waiting).appendleft(job)
        else:
            job.fail(error)

    # ------------------------------------------------------------------ bytes

    def receive(self, data: bytes, now: Nanos) -> None:
        """Take received bytes. Raises `LineLost` if the connection must be closed; the shell then calls `lost`."""
        job = self._current
        if job is None or self._more is not None:
            self.discipline.stray(data, now)
            return
        try:
            answer = self.discipline.receive(data, now)
        except LineLost:
            raise
        except (Refusal, LineFailure) as error:
            self._errors += 1
            self._current = None
            if self.on_missed is not None and isinstance(error, LineFailure):
                self.on_missed(job.request, error)
            if not job.done:
                job.fail(error)
            return
        if answer is None:
            return
        if isinstance(answer, SendNext):
            self._continue(job, answer, now)
            return
        self._current = None
        if not job.done:
            job.succeed(answer)

    def _continue(self, job: Job[Q, A], more: SendNext, now: Nanos) -> None:
        if more.may_wait and (job.done or (self._urgent and not job.urgent)):
            self._current = None
            if not job.done:
                self._waiting.appendleft(job)
            return
        self._more = more
        self._deadline = max(now, self.discipline.free_ns, self._next.get(job.request.device, 0))

    def lost(self, error: LineLost) -> None:
        """Handle a lost connection. The exchange in progress is repeated on the next one if that is permitted."""
        self.discipline.reset()
        job, self._current, self._more = self._current, None, None
        if job is not None:
            failure = LineLost(LOST_MEANWHILE(problem=text_of(error), request=job.request)) if job.request.changes else error
            failure.uncertain = job.request.changes
            self._missed(job, failure)
