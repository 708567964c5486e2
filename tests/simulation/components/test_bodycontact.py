"""Contacts of two bodies: when they are searched for, and from which moment on."""

from __future__ import annotations

import pytest
from space_scenes import motion_of

from steptwin.controller import SECOND
from steptwin.motion.profile import Profile, cruise
from steptwin.simulation.components.bodycontact import BodyContact
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.contacts import NEVER, Look, Pair
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint
from steptwin.simulation.space.sweeps import SweptBody

BOX = Box((10, 10, 10))


def contact(post_at: int) -> BodyContact:
    """A slider that goes from 0 to 2000 nm in 2 s, and a post."""
    plan = Profile(0, 0, (cruise(0.0, 2.0, 0.0, 1000.0),), 2000.0)
    slider = Body("slider", Frame("x", FLOOR, (0, 0, 0), Joint(motion_of(plan), Direction(0, 1))), BOX)
    return BodyContact(SweptBody(slider), SweptBody(Body("post", Frame("p", FLOOR, (post_at, 0, 0)), BOX)))


def test_what_does_not_come_near_is_not_searched_for(monkeypatch: pytest.MonkeyPatch) -> None:
    searched: list[int] = []

    def next_change(pair: Pair, now: int, *, overlap: bool) -> Look:
        searched.append(now)
        return NEVER

    monkeypatch.setattr(Pair, "next_change", next_change)
    assert contact(2100).change(0) is None
    assert not searched
    assert contact(1500).change(0) is None
    assert searched == [0]


def test_after_a_snapshot_was_restored_it_is_searched_for_from_its_moment_on() -> None:
    meeting = contact(500)
    assert meeting.change(SECOND) is None
    meeting.forget()
    assert meeting.change(0) == pytest.approx(0.48 * SECOND, abs=1e6)
