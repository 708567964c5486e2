"""The exchange engine with a language made up here: it knows no Modbus, no clock and no I/O."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers.exchange import Exchanger, Job, LineLost, NoAnswer, Overtaken, SendNext, SentLate, TooLate
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse, Refusal

TIMEOUT = 300 * MILLISECOND


@dataclass(eq=False)
class Ask:
    text: str
    device: str = "a"
    changes: bool = False

    def __str__(self) -> str:
        return f"device {self.device}: {self.text}"


class Spelling:
    """``x`` is answered by ``x!``, ``x?`` is a refusal, ``x+`` asks for ``more``, ``x#`` breaks the connection."""

    def __init__(self) -> None:
        self.free_ns = 0
        self.held = ""
        self.heard: list[bytes] = []
        self.resets = 0
        self.abandoned = 0
        self.may_wait = True
        self.wary = False

    def start(self, request: Ask, now: int, *, urgent: bool) -> bytes:
        if request.text == "unspeakable":
            raise Misuse(f"{request} cannot be sent")
        self.asked, self.held = request, ""
        return request.text.encode()

    def receive(self, data: bytes, now: int) -> str | SendNext | None:
        self.held += data.decode()
        if self.held.endswith("?"):
            raise Refusal(self.held)
        if self.held.endswith("#"):
            raise LineLost("no sense any more")
        if self.held.endswith("+"):
            self.held = ""
            return SendNext(b"more", self.may_wait)
        return self.held if self.held == f"{self.asked.text}!" else None

    def allowance_ns(self, request: Ask) -> int:
        return len(request.text) * MILLISECOND

    def abandon(self, now: int) -> bytes:
        self.abandoned += 1
        return self.held.encode()

    def stray(self, data: bytes, now: int) -> None:
        self.heard.append(data)

    def reset(self) -> None:
        self.resets += 1


def engine(interval: int = 0) -> Exchanger[Ask, str]:
    return Exchanger(Spelling(), "here", interval)


def submit(e: Exchanger[Ask, str], text: str, device: str = "a", **options: object) -> Job[Ask, str]:
    changes = bool(options.pop("changes", False))
    job: Job[Ask, str] = Job(Ask(text, device, changes), TIMEOUT, **options)  # type: ignore[arg-type]
    e.submit(job)
    return job


def test_an_engine_is_busy_from_the_first_job_to_the_last_answer() -> None:
    e = engine()
    assert (e.busy, e.in_flight) == (False, False)
    submit(e, "one")
    submit(e, "two")
    assert (e.busy, e.in_flight) == (True, False)
    e.step(0)
    assert (e.busy, e.in_flight) == (True, True)
    e.receive(b"one!", 1)
    assert (e.busy, e.in_flight) == (True, False)
    e.step(1)
    assert (e.busy, e.in_flight) == (True, True)
    e.receive(b"two!", 2)
    assert (e.busy, e.in_flight) == (False, False)


def test_a_request_that_cannot_be_begun_fails_and_the_next_one_goes() -> None:
    """Its caller would wait for ever, and the error end in the loop."""
    e = engine()
    wrong, right = submit(e, "unspeakable"), submit(e, "right")
    assert e.step(0) == b"right"
    assert wrong.done
    with pytest.raises(Misuse, match="unspeakable"):
        wrong.result()
    assert not right.done


def test_one_exchange_at_a_time_in_the_order_they_came() -> None:
    e = engine()
    first = submit(e, "one")
    assert (e.busy, e.in_flight) == (True, False)
    second = submit(e, "two")
    assert e.step(0) == b"one"
    assert (e.busy, e.in_flight) == (True, True)
    assert e.step(1) == b""
    e.receive(b"on", 2)
    assert not first.done
    e.receive(b"e!", 3)
    assert first.result() == "one!"
    assert e.step(4) == b"two"
    e.receive(b"two!", 5)
    assert second.result() == "two!"
    assert (e.busy, e.deadline()) == (False, None)


def test_an_urgent_job_is_the_next_on_the_line_whatever_waits() -> None:
    e = engine()
    for text in ("one", "two", "three"):
        submit(e, text)
    e.step(0)
    submit(e, "stop", urgent=True)
    e.receive(b"one!", 1)
    assert e.step(1) == b"stop"


def test_a_job_that_is_tried_again_lets_an_urgent_one_pass() -> None:
    e = engine()
    job = submit(e, "one", most_attempts=2)
    e.step(0)
    submit(e, "stop", urgent=True)
    deadline = TIMEOUT + 3 * MILLISECOND
    assert e.deadline() == deadline
    assert e.step(deadline) == b"stop"
    e.receive(b"stop!", deadline + 1)
    assert e.step(deadline + 1) == b"one"
    e.receive(b"one!", deadline + 2)
    assert job.result() == "one!"


def test_no_answer_says_how_often_how_long_and_what_was_heard() -> None:
    e = engine()
    job = submit(e, "one", most_attempts=2, changes=True)
    e.step(0)
    second = e.deadline()
    assert second is not None
    assert e.step(second) == b"one"
    e.receive(b"on", second)
    third = e.deadline()
    assert third is not None
    assert e.step(third) == b""
    with pytest.raises(NoAnswer) as caught:
        job.result()
    assert str(caught.value) == (
        "here: no answer to 'device a: one' within 0.3 s, tried 2 times; only 6f 6e was received, which is not an answer; "
        "it is unknown whether the device has executed it"
    )
    assert (caught.value.uncertain, caught.value.attempts, caught.value.received) == (True, 2, b"on")


def test_no_answer_to_what_only_reads_leaves_no_doubt() -> None:
    e = engine()
    job = submit(e, "one")
    e.step(0)
    e.step(e.deadline() or 0)
    with pytest.raises(NoAnswer) as caught:
        job.result()
    assert str(caught.value) == "here: no answer to 'device a: one' within 0.3 s; nothing was received"
    assert not caught.value.uncertain


def test_a_refusal_is_an_answer_and_not_tried_again() -> None:
    e = engine()
    job = submit(e, "one", most_attempts=3)
    e.step(0)
    e.receive(b"one?", 1)
    with pytest.raises(Refusal, match=r"one\?"):
        job.result()
    assert not e.busy


def test_what_is_sent_refused_and_lost_is_counted() -> None:
    e = engine()
    submit(e, "one")
    e.step(0)
    e.receive(b"one!", 1)
    assert e.counts == (1, 0)
    submit(e, "two", most_attempts=2)
    e.step(1)
    e.step(1 + 10 * TIMEOUT)
    e.receive(b"two!", 2 + 10 * TIMEOUT)
    assert e.counts == (3, 1)


def test_each_device_has_its_pace_and_others_go_first_meanwhile() -> None:
    e = engine(interval=10 * MILLISECOND)
    for text, device in (("a1", "a"), ("a2", "a"), ("b1", "b")):
        submit(e, text, device)
    assert e.step(0) == b"a1"
    e.receive(b"a1!", 2)
    assert e.step(2) == b"b1"
    e.receive(b"b1!", 4)
    assert e.step(4) == b""
    assert e.deadline() == 10 * MILLISECOND
    assert e.step(10 * MILLISECOND) == b"a2"
    e.receive(b"a2!", 11 * MILLISECOND)
    assert e.step(11 * MILLISECOND) == b""
    assert e.deadline() is None, "nothing is to be done any more"


@pytest.mark.parametrize("waiting", ["ab", "ba"])
def test_the_device_that_may_be_asked_first_is_asked_first(waiting: str) -> None:
    e = engine(interval=10 * MILLISECOND)
    for at, device in ((0, "a"), (4, "b")):
        submit(e, device, device)
        assert e.step(at) == device.encode()
        e.receive(f"{device}!".encode(), at)
    for device in waiting:
        submit(e, device, device)
    assert (e.step(5), e.deadline()) == (b"", 10 * MILLISECOND)
    assert e.step(10 * MILLISECOND) == b"a"


def test_behind_an_urgent_job_that_nobody_wants_any_more_the_others_go_on() -> None:
    e = engine()
    e.withdraw(submit(e, "stop", urgent=True))
    submit(e, "one")
    assert (e.step(7), e.deadline()) == (b"", 7)
    assert e.step(7) == b"one"


def test_nothing_goes_before_an_urgent_job_that_waits_for_its_pace() -> None:
    e = engine(interval=10 * MILLISECOND)
    submit(e, "a1", "a")
    e.step(0)
    e.receive(b"a1!", 1)
    submit(e, "b1", "b")
    submit(e, "stop", "a", urgent=True)
    assert e.step(2) == b""
    assert e.deadline() == 10 * MILLISECOND
    assert e.step(10 * MILLISECOND) == b"stop"


def test_nothing_is_sent_before_the_line_is_free() -> None:
    e = engine()
    e.discipline.free_ns = 50  # type: ignore[misc]
    submit(e, "one")
    assert e.step(49) == b""
    assert e.deadline() == 50
    assert e.step(50) == b"one"


def test_what_is_not_allowed_any_more_is_not_sent() -> None:
    e = engine()
    allowed = [True]
    submit(e, "one")
    job = submit(e, "two", permission=Permission(lambda: 0, 1, lambda: not allowed[0]))
    later = submit(e, "three")
    e.step(0)
    allowed[0] = False
    e.receive(b"one!", 1)
    assert e.step(1) + e.step(1) == b"three"
    with pytest.raises(Overtaken, match=r"'device a: two' was not sent: a stop was requested meanwhile"):
        job.result()
    assert not later.done


def test_a_repetition_that_is_not_allowed_any_more_is_told_as_such() -> None:
    e = engine()
    allowed = [True]
    job = submit(e, "one", most_attempts=3, permission=Permission(lambda: 0, 1, lambda: not allowed[0]))
    e.step(0)
    allowed[0] = False
    assert e.step(e.deadline() or 0) == b""
    with pytest.raises(Overtaken, match="not sent again"):
        job.result()


def test_a_withdrawn_job_is_not_sent_and_one_on_the_line_runs_to_its_end() -> None:
    e = engine()
    first, second = submit(e, "one"), submit(e, "two")
    e.step(0)
    e.withdraw(first)
    e.withdraw(second)
    third = submit(e, "three")
    assert e.step(1) == b""
    e.receive(b"one!", 2)
    assert e.step(2) == b"three"
    e.receive(b"three!", 3)
    assert third.result() == "three!"
    assert not e.busy, "nothing of it is kept"


def test_bytes_without_exchange_are_stray() -> None:
    e = engine()
    e.receive(b"xyz", 0)
    assert e.discipline.heard == [b"xyz"]  # type: ignore[attr-defined]


def test_an_exchange_of_several_steps_is_paced_and_has_its_time_anew() -> None:
    e = engine(interval=10 * MILLISECOND)
    job = submit(e, "one")
    e.step(0)
    e.receive(b"one+", MILLISECOND)
    assert e.step(2 * MILLISECOND) == b""
    assert e.deadline() == 10 * MILLISECOND
    assert e.step(10 * MILLISECOND) == b"more"
    assert e.deadline() == 10 * MILLISECOND + TIMEOUT + 3 * MILLISECOND
    e.receive(b"one!", 11 * MILLISECOND)
    assert job.result() == "one!"


@pytest.mark.parametrize("is_withdrawn", [True, False])
def test_an_exchange_that_is_not_allowed_any_more_ends_between_its_steps(is_withdrawn: bool) -> None:
    e = engine()
    allowed = [True]
    job = submit(e, "one", permission=Permission(lambda: 0, 1, lambda: not allowed[0]))
    e.step(0)
    e.receive(b"one+", 1)
    if is_withdrawn:
        e.withdraw(job)
    else:
        allowed[0] = False
    assert e.step(1) == b""
    assert (e.in_flight, e.busy, e.deadline(), e.discipline.abandoned) == (False, False, None, 1)  # type: ignore[attr-defined]
    if not is_withdrawn:
        with pytest.raises(Overtaken, match="'device a: one' was not sent"):
            job.result()
    submit(e, "two")
    assert e.step(2) == b"two"


@pytest.mark.parametrize("may_wait", [True, False])
def test_between_steps_an_urgent_job_passes_where_that_is_possible(may_wait: bool) -> None:
    e = engine()
    e.discipline.may_wait = may_wait  # type: ignore[attr-defined]
    submit(e, "one")
    e.step(0)
    submit(e, "stop", urgent=True)
    e.receive(b"one+", 1)
    assert e.step(1) == (b"stop" if may_wait else b"more")


def test_a_lost_connection_begins_the_exchange_anew_if_that_is_allowed() -> None:
    e = engine()
    job = submit(e, "one", most_attempts=2)
    e.step(0)
    e.lost(LineLost("unplugged"))
    assert (e.in_flight, e.discipline.resets) == (False, 1)  # type: ignore[attr-defined]
    assert e.step(1) == b"one"
    e.lost(LineLost("unplugged"))
    with pytest.raises(LineLost, match=r"\Aunplugged\Z"):
        job.result()


def test_a_lost_connection_leaves_a_change_in_doubt() -> None:
    e = engine()
    job, waiting = submit(e, "one", changes=True), submit(e, "two")
    e.step(0)
    e.lost(LineLost("unplugged"))
    with pytest.raises(LineLost, match="unplugged; it is unknown whether 'device a: one' was executed") as caught:
        job.result()
    assert caught.value.uncertain
    assert not waiting.done
    e.fail_all(LineLost("no port"))
    with pytest.raises(LineFailure, match="no port"):
        waiting.result()
    assert not e.busy


def test_a_broken_connection_is_the_shells_affair() -> None:
    e = engine()
    submit(e, "one")
    e.step(0)
    with pytest.raises(LineLost):
        e.receive(b"#", 1)


def test_everybody_is_told_once() -> None:
    e = engine()
    told: list[str] = []
    for text in ("one", "two"):
        submit(e, text).on_done = lambda text=text: told.append(text)
    e.step(0)
    e.receive(b"one!", 1)
    e.fail_all(LineLost("gone"))
    assert told == ["one", "two"]


def test_of_jobs_that_were_all_told_none_is_due() -> None:
    e = engine(interval=10 * MILLISECOND)
    submit(e, "one")
    e.step(0)
    e.receive(b"one!", 1)
    submit(e, "two")
    assert (e.step(2), e.deadline()) == (b"", 10 * MILLISECOND)
    e.fail_all(LineLost("gone"))
    assert e.deadline() is None


# ---------------------------------------------------------------------- permissions


class Time:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        return self.now


def permitted(e: Exchanger[Ask, str], time: Time, *, most_attempts: int = 1) -> Job[Ask, str]:
    return submit(e, "one", changes=True, most_attempts=most_attempts, permission=Permission(time, SECOND))


def test_what_was_asked_for_too_long_ago_is_not_sent() -> None:
    e, time = engine(), Time()
    job = permitted(e, time)
    time.now = SECOND + 1
    assert e.step(time.now) == b""
    with pytest.raises(
        TooLate, match="'device a: one' was not sent: it was requested more than 1 s ago; the program was suspended"
    ):
        job.result()


def test_what_was_sent_once_and_is_too_late_to_be_repeated_is_in_doubt() -> None:
    e, time = engine(), Time()
    job = permitted(e, time, most_attempts=3)
    assert e.step(0) == b"one"
    time.now = SECOND + 1
    assert e.step(time.now) == b""
    with pytest.raises(NoAnswer, match="it is unknown whether the device has executed it"):
        job.result()


def test_the_second_part_of_an_exchange_is_not_sent_too_late() -> None:
    e, time = engine(), Time()
    job, waiting = permitted(e, time), submit(e, "two")
    e.step(0)
    e.receive(b"one+", 1)
    time.now = SECOND + 1
    assert e.step(time.now) == b"two"
    assert e.discipline.abandoned == 1, "what is said on the line is told that the exchange has ended"  # type: ignore[attr-defined]
    e.receive(b"two!", time.now + 1)
    assert waiting.result() == "two!"
    with pytest.raises(TooLate):
        job.result()


def test_the_second_part_of_an_exchange_that_nobody_waits_for_is_not_sent_where_it_acts() -> None:
    """As after Ctrl-C between an M1486 command and its CR."""
    e, time = engine(), Time()
    job = permitted(e, time)
    e.step(0)
    e.withdraw(job)
    e.receive(b"one+", 1)
    assert e.step(2) == b""
    assert not e.busy


@pytest.mark.parametrize("answer", [b"one!", b""])
def test_what_was_sent_too_late_is_told(answer: bytes) -> None:
    """The program was suspended between the last look at the clock and the sending."""
    e, time = engine(), Time()
    job = permitted(e, time)
    told: list[bool] = []
    job.on_done = lambda: told.append(job.done)
    assert e.step(0) == b"one"
    time.now = 2 * SECOND
    e.written()
    if answer:
        e.receive(answer, time.now + 1)
    else:
        e.step(time.now + 1)
    with pytest.raises(SentLate, match="'device a: one' was sent more than 1 s after it was requested") as caught:
        job.result()
    assert caught.value.uncertain
    assert told == [True], "once"


def test_a_permission_is_extended_by_progress_but_never_revived() -> None:
    time = Time()
    permission = Permission(time, SECOND)
    for _ in range(5):
        time.now += SECOND
        permission.extend()
        assert not permission.has_expired()
    time.now += SECOND + 1
    permission.extend()
    assert permission.has_expired()
    time.now -= SECOND
    assert permission.has_expired()
