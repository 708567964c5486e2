"""Looking at one controller of many: the others are left alone, and nothing follows from it."""

from __future__ import annotations

from steptwin import World
from steptwin.controller import SECOND
from steptwin.simulation.script.steps import Note
from steptwin.subject import commands as command
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject


def subject_of(count: int) -> WorldSubject:
    return WorldSubject(World.from_toml("".join(f'[[mic488]]\nname = "t{number}"\n' for number in range(count))))


def test_only_what_is_looked_at_comes_to_the_present() -> None:
    subject = subject_of(3)
    subject.subscribe(filter_of(None), 100)
    world = subject.world
    world.now = SECOND
    subject.do(command.ReadState("t1"))
    assert [world.objects.scheduler_of[name].now for name in ("t0", "t1", "t2")] == [0, SECOND, 0]
    subject.do(command.ReadPoints(("t2.M1.position",)))
    assert [world.objects.scheduler_of[name].now for name in ("t0", "t1", "t2")] == [0, SECOND, SECOND]
    subject.do(command.Time())
    assert world.objects.scheduler_of["t0"].now == SECOND


def test_a_look_has_a_number_and_is_no_cause() -> None:
    subject = subject_of(1)
    subscription = subject.subscribe(filter_of(["note"]), 100)
    first = subject.do(command.ReadState("t0"))
    second = subject.do(Note("shift begins"))
    assert second.number == first.number + 1
    (event,) = subscription.take().events
    assert event.cause == second.number
