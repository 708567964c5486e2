"""Questions about what is in no trace are answered from states on the way, as from the whole past."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest
from why_worlds import PROGRAM, WAITS

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.why import log, points, replayed, states
from steptwin.why.notedpast import NotedPast
from steptwin.why.question import Why

COUNTS = "n = 0\n$I5 = 0\nMAIN:\n    n = n + 1\n    $I4 = n\n    DELAY 0.3\n    IF n = 7\n        $I5 = 1\n    ENDIF\nJUMP MAIN\n"
WORLD = '[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\n'
QUESTIONS = ("m.USER_REGISTER[4] > 3", "m.USER_REGISTER[4]", "m.USER_REGISTER[5] == 1", "m.USER_REGISTER[5]", "time > 1.5")


def whole_past(world: World) -> Why:
    """What is noted of the whole past at once."""
    return Why(NotedPast(lambda: World(world.blueprint), world.inputs, world.now))


def counting() -> Why:
    world = World.from_toml(WORLD, {"m.prg": COUNTS.encode()})
    world.run(1.7)
    world.apply_input(do.Write((("m", "USER_REGISTER[4]", 90.0),)))
    world.run(for_=6.0)
    return whole_past(world)


@pytest.mark.parametrize("question", QUESTIONS)
def test_answers_are_those_of_a_run_from_the_beginning(question: str, monkeypatch: pytest.MonkeyPatch) -> None:
    past = counting()
    moments = [number * 450 * MILLISECOND for number in range(1, 17)]
    found = [past.ask(question, at) for at in moments]
    monkeypatch.setattr(states, "LEAST_DISTANCE_NS", 3600 * SECOND)
    whole = counting()
    assert found == [whole.ask(question, at) for at in moments]
    assert len({answer.since for answer in found}) > 1


@pytest.mark.parametrize("begin", [0, 6 * SECOND, 6_100 * MILLISECOND])
def test_what_came_from_outside_at_the_moment_of_a_state_is_a_change(begin: int) -> None:
    world = World.from_toml(WORLD, {"m.prg": b"M1 = ON\nPABS M1 500\nWAITPOS\n"})
    world.run_to(begin)
    state = world.snapshot()
    world.run_to(10 * SECOND)  # many times the distance of states after the first one
    world.apply_input(do.Write((("m", "M1_POS_ACT", 77.0),)))
    world.run(for_=1.0)
    past = Why(NotedPast(lambda: World(world.blueprint, at=state), world.inputs, world.now))
    answer = past.ask("m.M1.position")
    assert (answer.since, answer.links[0].text) == (10 * SECOND, "from outside: writes m.M1_POS_ACT = 77")


def test_as_many_states_are_kept_as_may_be() -> None:
    world = World.from_toml(WAITS, {"p.prg": PROGRAM.encode()})
    kept = states.StatesOnTheWay(world)
    for second in range(1, 1000):
        world.run_to(second * SECOND)
        kept.pass_by(0)
    moments = [state.snapshot.now for state in kept.until(700 * SECOND)]
    assert len(moments) < states.MOST_KEPT
    assert moments == sorted(moments, reverse=True)
    assert moments[0] > 680 * SECOND
    assert moments[-1] == 0


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The ends of the parts of the past that are run again."""
    found: list[int] = []

    def in_parts(world: Simulation, inputs: Sequence[RecordedInput], end: int) -> Iterator[bool]:
        found.append(end)
        return log.in_parts(world, inputs, end)

    monkeypatch.setattr(replayed, "in_parts", in_parts)
    return found


@pytest.mark.parametrize(
    ("first", "then", "lacking"),
    [
        ("time > 1.5", "time > 1.5", 0),
        ("m.OUT1", "m.USER_REGISTER[6] > 5", 0),
        ("m.OUT1", "m.M1_ACC == 1000 and m.M4.status == 0", 0),
    ],
)
def test_what_a_question_showed_is_remembered(first: str, then: str, lacking: int, runs: list[int]) -> None:
    expected = counting().ask(then)
    past = counting()
    past.ask(first)
    runs.clear()
    assert past.ask(then) == expected
    assert len(runs) == lacking


def test_what_is_remembered_is_bounded(runs: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    past = counting()
    monkeypatch.setattr(replayed, "MOST_REMEMBERED", 5)
    first = past.ask("time > 9000")
    needed = len(runs)
    assert needed == 5  # of 16 intervals: 1, 1, 2, 4 and the rest
    assert past.ask("time > 9000") == first
    assert len(runs) == 2 * needed


SEEN = [
    *("m.USER_REGISTER[4]", "m.USER_REGISTER[4]:dint", "m.USER_REGISTER[5] == 1 and m.M1.status == 0"),
    *("m.M1_VMAX", "m.M1.status", "m.program", "m.hr:10020", "m.M2_ACC"),
]
MOVES = (
    "M1 = ON\nMAIN:\n    VMAXM1 = 300\n    PABS M1 100\n    WAITPOS\n    VMAXM1 = 200\n    PABS M1 0\n    WAITPOS\nJUMP MAIN\n"
)


@pytest.mark.parametrize("program", [COUNTS, MOVES])
@pytest.mark.parametrize("wired", ["", '[[button]]\nname = "go"\nto = "m.IN1"\n'])
def test_what_is_noted_of_points_is_what_a_run_shows(program: str, wired: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both alone and with others in the scheduler; where too much changes, the past is run again instead."""
    world = World.from_toml(WORLD + wired, {"m.prg": program.encode()})
    world.run(1.7)
    world.apply_input(do.Write((("m", "USER_REGISTER[4]", 90.0), ("m", "M2_ACC", 500.0))))
    world.run(for_=3.0)
    moments = [number * 310 * MILLISECOND for number in range(1, 16)]
    past = whole_past(world)
    noted = [past.ask(question, at)[:4] for question in SEEN for at in moments]
    monkeypatch.setattr(points, "MOST_CHANGES", 0)
    past = whole_past(world)
    assert noted == [past.ask(question, at)[:4] for question in SEEN for at in moments]
    assert past.log.points.series("m.M2_ACC") is None
    assert len({since for *_, since in noted}) > 5


def test_a_condition_of_a_pin_and_a_register() -> None:
    world = World.from_toml(
        WORLD + '[[button]]\nname = "go"\nto = "m.IN1"\n', {"m.prg": b"$I4 = 5\nWAIT IN1 = ON\nDELAY 0.5\n$I4 = 7\n"}
    )
    world.run(1.0)
    world.apply_input(do.Press("go"))
    world.run(for_=2.0)
    past = whole_past(world)
    assert past.ask("m.USER_REGISTER[4] == 5 and m.IN1", 1_200 * MILLISECOND).since == SECOND
    assert past.ask("m.USER_REGISTER[4] == 5 and go", 1_200 * MILLISECOND).since == SECOND
    last = past.ask("m.USER_REGISTER[4] == 5 and m.IN1").since
    assert last is not None
    assert 1_500 * MILLISECOND < last < 1_600 * MILLISECOND
