"""States of a world that are kept, and what is seen when it goes back to one."""

from __future__ import annotations

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.simulation.script.steps import Note, Set
from steptwin.subject.commands import (
    Advance,
    DropSnapshot,
    Enable,
    ListSnapshots,
    Move,
    ReadState,
    RestoreSnapshot,
    TakeSnapshot,
)
from steptwin.subject.motion import Motions
from steptwin.subject.payloads import PlanPayload, RestoredPayload
from steptwin.subject.snapshots import MOST_SNAPSHOTS
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

TEXT = '[[mic488]]\nname = "m"\n[mic488.M1]\nunit = "mm"\ngear = 100.0\nacc = 100.0\ndec = 100.0\nvel = 40.0\n'


def moving() -> WorldSubject:
    return moving_in(World.from_toml(TEXT))


def moving_in(world: World) -> WorldSubject:
    subject = WorldSubject(world)
    subject.do(Enable("m", 1))
    subject.do(Move("m", 1, to=500.0))
    subject.do(Advance(duration=SECOND))
    return subject


def test_what_happened_since_is_undone_and_goes_on_alike() -> None:
    world = World.from_toml(TEXT)
    subject = moving_in(world)
    assert subject.do(TakeSnapshot()).value == {"name": "1", "time_ns": "1000000000"}
    before = subject.do(ReadState("m")).value
    subject.do(Advance(duration=SECOND))
    after, digest = subject.do(ReadState("m")).value, recording_of(world).digest
    subject.do(Set((("m", "IN3", 1.0),)))
    subject.do(Advance(duration=SECOND))
    result = subject.do(RestoreSnapshot("1"))
    assert (result.time, result.value["time_ns"], result.value["paused"]) == (SECOND, "1000000000", True)
    assert subject.do(ReadState("m")).value == before != after
    subject.do(Advance(duration=SECOND))
    assert subject.do(ReadState("m")).value == after
    # What was set since is no part of the recording.
    assert recording_of(world).digest == digest == recording_of(world).replay().trace.digest()


def test_followers_are_told_and_get_the_plans() -> None:
    subject = moving()
    part = subject.description.controllers[0]
    subject.do(TakeSnapshot("start"))
    subject.do(Advance(duration=100 * SECOND))
    subscription = subject.subscribe(filter_of(["restored", "plan"]), 100)
    motions = Motions(part, subject.plans(filter_of(["plan"])))
    assert motions.position("1", subject.world.now) == 500.0
    number = subject.do(RestoreSnapshot("start")).number
    restored, *plans = subscription.take().events
    assert (restored.payload, restored.time, restored.cause) == (RestoredPayload("start"), SECOND, number)
    assert {plan.cause for plan in plans} == {number}
    assert [plan.payload.axis for plan in plans if isinstance(plan.payload, PlanPayload)] == ["1", "2", "3", "4"]
    for plan in plans:
        motions.take(plan)
    subject.do(Advance(duration=SECOND))
    position = motions.position("1", subject.world.now)
    assert position == subject.read("m.M1.position")[0].value
    assert 0.0 < position < 500.0
    subject.do(Move("m", 1, to=0.0))
    (plan,) = subscription.take().events
    assert (plan.kind, plan.time) == ("plan", 2 * SECOND)
    assert plan.number > plans[-1].number > number


def test_a_cause_of_the_time_that_was_undone_is_none_any_more() -> None:
    subject = WorldSubject(World.from_toml(TEXT))
    subject.do(TakeSnapshot("a"))
    subscription = subject.subscribe(filter_of(["input", "note", "edge"]), 100)
    subject.do(Set((("m", "IN1", 1.0),)))
    subject.do(RestoreSnapshot("a"))
    number = subject.do(Note("again")).number
    events = subscription.take().events
    assert events[-1].cause == number
    assert subject.read("m.IN1")[0].value == 0.0


def test_they_are_listed_replaced_dropped_and_bounded() -> None:
    subject = moving()
    for _ in range(MOST_SNAPSHOTS):
        subject.do(TakeSnapshot())
    with pytest.raises(Misuse, match="32 snapshots are kept, as many as may be: drop one: 1, 2, "):
        subject.do(TakeSnapshot())
    subject.do(Advance(duration=SECOND))
    subject.do(TakeSnapshot("7"))
    assert subject.do(ListSnapshots()).value[-1] == {"name": "7", "time_ns": "2000000000"}
    subject.do(DropSnapshot("7"))
    assert len(subject.do(ListSnapshots()).value) == MOST_SNAPSHOTS - 1
    assert subject.do(TakeSnapshot()).value["name"] == "7"
    with pytest.raises(Misuse, match="no snapshot is called '77'; there are 1, 2, "):
        subject.do(RestoreSnapshot("77"))
    with pytest.raises(Misuse, match="no snapshot is called 'x'"):
        subject.do(DropSnapshot("x"))
