from __future__ import annotations

import pickle

import pytest

from steptwin.errors import Misuse
from steptwin.motion import MotionState, plan_position
from steptwin.motion.divisions import Division, Microstepping, StepTrain
from steptwin.motion.paths import Circular
from steptwin.simulation.scheduler.trace import Trace, TraceRecord, encode

PLAN = plan_position(MotionState(5, 10, 0.0, 0.0), 5000, 1000.0, 2000.0, 800.0)
GRIDS = Microstepping(8, 64, 1500.0)


def test_records_of_several_machines_are_merged_by_time_then_order_of_the_machines_then_sequence() -> None:
    trace = Trace(["b", "a"])
    for time, controller, subject in [(1, "a", "1"), (3, "a", "2"), (3, "a", "3"), (1, "b", "4"), (2, "b", "5"), (3, "b", "6")]:
        trace.add(TraceRecord(time, controller, "event", subject, ""))
    assert [record.subject for record in trace] == ["4", "1", "5", "6", "2", "3"]
    assert [record.subject for record in trace.events("a")] == ["1", "2", "3"]
    assert list(trace.events("no such machine")) == []


def test_records_of_controllers_that_are_advanced_together_are_read_in_the_order_in_which_they_came() -> None:
    """A cause stands before its effect at the same nanosecond, whatever the order of their controllers in the description."""

    def take(trace: Trace, *records: tuple[int, str, str]) -> None:
        for time, controller, subject in records:
            trace.add(TraceRecord(time, controller, "event", subject, ""))

    def subjects(trace: Trace) -> str:
        return "".join(record.subject for record in trace)

    trace = Trace(["effect", "alone", "cause"])
    trace.read_together([("effect", "cause"), ("alone",)])
    take(trace, (5, "alone", "c"), (5, "cause", "a"), (5, "effect", "b"), (9, "cause", "d"))
    assert subjects(trace) == "abcd"
    middle = trace.mark()
    take(trace, (9, "effect", "x"))
    trace.rewind(pickle.loads(pickle.dumps(middle)))
    take(trace, (9, "effect", "e"), (9, "cause", "f"), (7, "alone", "-"))
    assert subjects(trace) == "abc-def"
    assert [record.subject for record in trace.events("cause")] == ["a", "d", "f"]


def test_the_digest_does_not_depend_on_the_order_in_which_independent_controllers_were_advanced() -> None:
    records = [TraceRecord(t, m, "edge", "OUT1", float(t % 2)) for m in ("a", "b") for t in range(5)]
    one, other = Trace(["a", "b"]), Trace(["a", "b"])
    for record in records:
        one.add(record)
    for record in sorted(records, key=lambda r: r.time):
        other.add(record)
    assert one.digest() == other.digest()
    assert list(one) == list(other)


@pytest.mark.parametrize(
    "changed",
    [
        TraceRecord(6, "a", "plan", "1", PLAN),
        TraceRecord(5, "b", "plan", "1", PLAN),
        TraceRecord(5, "a", "edge", "1", PLAN),
        TraceRecord(5, "a", "plan", "2", PLAN),
        TraceRecord(5, "a", "plan", "1", plan_position(MotionState(5, 10, 0.0, 0.0), 5000, 1000.0, 2000.0, 800.0000000000001)),
        TraceRecord(5, "a", "plan", "1", 1.0),
    ],
)
def test_every_part_of_a_record_is_in_the_digest(changed: TraceRecord) -> None:
    one, other = Trace(), Trace()
    one.add(TraceRecord(5, "a", "plan", "1", PLAN))
    other.add(changed)
    assert one.digest() != other.digest()


def test_values_that_look_alike_have_different_bytes() -> None:
    values: list[object] = [1, 1.0, "1", b"1", True, None, "", b"", (), (1,), ((1,),), ("ab",), ("a", "b"), -0.0, 0.0]
    trains = [StepTrain(PLAN, GRIDS, (Division(0, 8),)), StepTrain(PLAN, GRIDS, (Division(0, 64),))]
    values += [PLAN, *trains, (PLAN, *trains)]
    encoded = [encode(TraceRecord(0, "m", "event", "x", value)) for value in values]
    assert len(set(encoded)) == len(values)


def test_the_digest_is_the_same_on_every_machine_and_python() -> None:
    trace = Trace()
    trace.add(TraceRecord(5, "a", "plan", "1", PLAN))
    trace.add(TraceRecord(7, "a", "edge", "OUT1", 1.0))
    trace.add(TraceRecord(7, "b", "frame", "tcp-1/in", b"\x01\x03"))
    trace.add(TraceRecord(8, "b", "event", "limit", "M1 stopped by KL"))
    assert trace.digest() == "5777a38db28e83d00a420ff7938b2fb9"


def test_a_trace_that_keeps_nothing_has_the_same_digest() -> None:
    kept, counted = Trace(), Trace(keep=False)
    for t in range(10):
        for trace in (kept, counted):
            trace.add(TraceRecord(t, "a", "edge", "OUT1", float(t % 2)))
            if t % 4 == 0:
                kept.digest()
    assert counted.digest() == kept.digest()
    assert len(counted) == len(kept) == 10
    assert list(counted) == []


def test_what_a_trace_does_not_take() -> None:
    trace = Trace()
    trace.add(TraceRecord(5, "a", "event", "x", ""))
    with pytest.raises(Misuse, match="a: a record of 4 ns after one of 5 ns"):
        trace.add(TraceRecord(4, "a", "event", "x", ""))
    with pytest.raises(Misuse, match="no kind of record 'edges': kinds are plan, load, free, coordinate, edge"):
        trace.of("edges")
    trace.add(TraceRecord(5, "a", "event", "x", [1]))
    with pytest.raises(Misuse, match=r"\[1\] cannot be in a trace"):
        trace.digest()


@pytest.mark.parametrize("keep", [True, False])
def test_a_trace_goes_back_to_a_mark_and_forward_again(keep: bool) -> None:
    def take(trace: Trace, *times: int) -> str:
        for time in times:
            trace.add(TraceRecord(time, "a", "edge", "OUT1", float(time)))
            trace.add(TraceRecord(time, "b", "event", "code", "text"))
        return trace.digest()

    trace, plain = Trace(["a"], keep=keep), Trace(["a"], keep=keep)
    start = trace.mark()
    early = take(trace, 1, 2)
    middle = trace.mark()
    late = take(trace, 3, 4)
    end = trace.mark()
    trace.rewind(middle)
    assert (trace.digest(), len(trace)) == (early, 4)
    other = take(trace, 3, 5)
    assert other != late
    trace.rewind(end)
    assert (trace.digest(), len(trace)) == (late, 8)
    trace.rewind(start)
    assert take(trace, 1, 2, 3, 4) == late == take(plain, 1, 2, 3, 4)


def test_every_number_of_an_arc_is_in_the_digest() -> None:
    """Motion along a circle, of which an axis has one coordinate (`steptwin.motion.paths`)."""

    def digest(*, centre_p: float = 100.0, radius_p: float = 500.0, angle_q: float = 0.25, turn_q: float = 0.001) -> str:
        way = plan_position(MotionState(5, 0, 0.0, 0.0), 700, 1000.0, 2000.0, 800.0)
        trace = Trace(["a"])
        trace.add(TraceRecord(5, "a", "plan", "1", Circular(centre_p, radius_p, angle_q, turn_q).profile(way, 600, None)))
        return trace.digest()

    digests = [digest(), digest(centre_p=101.0), digest(radius_p=501.0), digest(angle_q=0.26), digest(turn_q=-0.001)]
    assert len(set(digests)) == len(digests)
    # Recordings that were recorded keep their digests.
    assert digests[0] == "9842b60c5b6366a442434f84b1e4c49b"


def test_records_by_kind() -> None:
    trace = Trace(["a", "b"])
    kinds = ("plan", "coordinate", "load", "edge", "frame", "statement", "event", "input", "fault")
    for time, kind in enumerate(kinds):
        trace.add(TraceRecord(time, "b" if kind == "input" else "a", kind, kind, ""))
        trace.add(TraceRecord(time, "c", kind, f"{kind} of c", ""))
    views = (trace.loads, trace.edges, trace.frames, trace.statements, trace.events, trace.inputs, trace.faults)
    assert [[record.subject for record in view()] for view in views] == [[kind, f"{kind} of c"] for kind in kinds[2:]]
    assert [[record.subject for record in view("c")] for view in views] == [[f"{kind} of c"] for kind in kinds[2:]]
    assert [record.subject for record in trace.plans("c")] == ["plan of c"]
    assert [record.subject for record in trace.inputs("b")] == ["input"]
    assert list(trace.inputs("a")) == list(trace.edges("b")) == []


def test_a_world_of_which_nothing_is_recorded_has_no_digest() -> None:
    trace = Trace(["a"])
    trace.add(TraceRecord(1, "a", "edge", "OUT1", 1.0))
    trace.stop()
    assert list(trace) == []
    with pytest.raises(Misuse, match="nothing is recorded of this world: it has no digest"):
        trace.digest()


def test_the_value_of_a_record_is_that_of_its_kind() -> None:
    train = StepTrain(PLAN, GRIDS, (Division(0, 8),))
    plan, edge = TraceRecord(1, "a", "plan", "1", PLAN), TraceRecord(2, "a", "edge", "IN1", 1.0)
    frame = TraceRecord(3, "a", "frame", "tcp-1/in", b"x")
    assert (plan.plan(), plan._replace(value=train).plan(), edge.level(), frame.data()) == (PLAN, train, 1.0, b"x")
    for read, kind in ((edge.plan, "plan"), (plan.level, "edge"), (edge.data, "frame")):
        with pytest.raises(TypeError, match=f"a record of kind (plan|edge) with the value .*: expected a {kind}$"):
            read()


def test_a_kept_trace_that_takes_the_past_of_one_that_was_let_go_has_its_digest() -> None:
    records = [TraceRecord(t, "a", "edge", "OUT1", float(t % 2)) for t in range(6)]
    gone, whole, other = Trace(["a"]), Trace(["a"]), Trace(["a"])
    for record in records[:3]:
        gone.add(record)
    gone.let_go()
    other.rewind(gone.mark())
    for trace, added in ((whole, records), (other, records[3:])):
        for record in added:
            trace.add(record)
    assert other.digest() == whole.digest()
