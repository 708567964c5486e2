"""Branches of a world share what is constant, and nothing that changes."""

from __future__ import annotations

import gc
import sys
from array import array
from collections import deque
from collections.abc import Iterator
from types import FunctionType, ModuleType

import pytest
from toy import lamp
from whole_world import everything

from steptwin.messages import MessageText
from steptwin.motion.elastic import Response
from steptwin.motion.profile import Profile
from steptwin.simulation.logic.contacts import Zone
from steptwin.simulation.mechanics.trajectory import Trajectory
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.world.simulation import Simulation
from steptwin.state import Stateful


@pytest.fixture(scope="module", autouse=True)
def lamps() -> Iterator[None]:
    """An element that the source does not know."""
    with lamp.registered():
        yield


@pytest.fixture(scope="module")
def whole_trace() -> list[object]:
    world = everything()
    world.run(for_=1.6)
    return list(world.trace)


def test_a_branch_does_not_change_what_happens_in_another(whole_trace: list[object]) -> None:
    one = everything()
    one.run(for_=0.3)
    snapshot = one.snapshot()
    other, third = one.branch(snapshot), one.branch(snapshot)
    for device in other.mic488.values():
        device.write("USER_REGISTER[3]", 7.0)
    other.fault("supply-drop machine=table at_s=0.35 for_s=0.1")
    for step in range(1, 14):
        other.run(until=0.3 + step * 0.1)
        third.run(until=0.3 + step * 0.1)
    assert list(third.trace) == whole_trace
    assert list(other.trace) != whole_trace
    one.run(until=1.6)
    assert list(one.trace) == whole_trace


def test_a_branch_does_not_compute_again_when_switches_change(whole_trace: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    one = everything()
    one.run(for_=0.3)
    computed = []
    edges = Zone.edges
    monkeypatch.setattr(Zone, "edges", lambda zone, *given, **more: computed.append(zone) or edges(zone, *given, **more))
    other = one.branch()
    assert computed == []
    other.run(until=1.6)
    assert computed
    assert list(other.trace) == whole_trace


VALUES = (Profile, Trajectory, Response, MessageText)
"""Immutable, although they keep what they have computed of their trajectory, or their values."""
CHANGING = (list, dict, set, deque, bytearray, array, Stateful, Scheduler, Simulation)


def reached(*roots: object, beyond: frozenset[int] = frozenset()) -> dict[int, object]:
    """Everything that can be reached from ``roots``, but not what is in classes, modules and ``beyond``."""
    seen: dict[int, object] = {}
    todo = list(roots)
    while todo:
        thing = todo.pop()
        if id(thing) in seen or id(thing) in beyond or isinstance(thing, (type, ModuleType, *VALUES)):
            continue
        seen[id(thing)] = thing
        if isinstance(thing, FunctionType):
            todo += [thing.__closure__, thing.__defaults__, thing.__kwdefaults__]
        else:
            todo += gc.get_referents(thing)
    return seen


def test_branches_share_nothing_that_changes() -> None:
    one = everything()
    one.run(for_=0.3)
    other, third = one.branch(), one.branch()
    for world in (other, third):
        world.run(for_=0.1)
        assert all((world.mic488, world.m1486, world.axis, world.line))
    product = [vars(module) for name, module in sys.modules.items() if name.startswith(("steptwin.", "tests."))]
    constant = frozenset(reached(*(value for names in product for value in names.values()), one.blueprint))
    mine, its = reached(other, beyond=constant), reached(third, beyond=constant)
    assert len(mine) > 1000
    assert [found for key, found in mine.items() if key in its and isinstance(found, CHANGING)] == []


def test_worlds_leave_their_blueprint_as_it_is() -> None:
    one = everything()
    one.run(for_=0.3)
    one.branch()
    whole = reached(one.blueprint)
    before = {key: list(thing) for key, thing in whole.items() if isinstance(thing, list | dict | set | deque)}
    for world in (one, one.branch()):
        world.run(until=1.6)
    assert not [thing for thing in whole.values() if isinstance(thing, Stateful | Scheduler | Simulation)]
    assert before == {key: list(thing) for key, thing in whole.items() if isinstance(thing, list | dict | set | deque)}
