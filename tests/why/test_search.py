"""When something changed last is found by running the past again, whatever has been noted of it."""

from __future__ import annotations

import pytest
from why_worlds import PROGRAM as WAITS_PROGRAM
from why_worlds import WAITS

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.why import pastquestions, search
from steptwin.why.notedpast import NotedPast
from steptwin.why.pastquestions import PastQuestions
from steptwin.why.question import Why, finish

PROGRAM = """\
n = 0
M1 = ON
$I5 = 3
MAIN:
    n = n + 1
    IF n = 40
        $I4 = n
        VMAXM1 = 300
        OUT2 = ON
    ENDIF
    IF n = 60
        PABS M1 20
        WAITPOS
    ENDIF
    DELAY 0.05
JUMP MAIN
"""
WORLD = """
[[mic488]]
name = "m"
program = "m.prg"
start = true

[[mic488]]
name = "other"

[[button]]
name = "go"
to = "m.IN1"

[[axis]]
name = "x"
drive = "m.M1"
unit = "mm"
pulses_per_unit = 40
"""
QUESTIONS = (
    *("m.OUT2", "m.OUT3", "go", "go.pressed", "m.IN1", "m.USER_REGISTER[4]", "m.USER_REGISTER[5]:int", "m.M1_VMAX", "m.M2_ACC"),
    *("m.M1.status", "m.M_STATUS", "other.OUT1", "m.OUT2 == 1 and other.OUT1 == 1", "m.USER_REGISTER[4] > 7 or go.pressed"),
    *("other.M1_ACC", "x.position > 100 mm", "x.position < 1 mm", "m.M2.position > 5 and m.OUT2"),
)


@pytest.fixture(autouse=True)
def noted_little(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pastquestions, "FIRST_SPAN_NS", 100 * MILLISECOND)


def past_of(world: World, end: int, step: int = 150 * MILLISECOND) -> PastQuestions:
    snapshots = SnapshotLog(world)
    inputs = {
        1_000: do.Press("go"),
        1_100: do.Release("go"),
        1_300: do.Set((("other", "IN4", 1.0),)),
        1_700: do.Write((("other", "OUT1", 1.0), ("other", "M1_ACC", 700.0))),
    }
    for moment in range(0, end + 1, step):
        for time in [time for time in inputs if moment - step < time * MILLISECOND <= moment]:
            world.run_to(time * MILLISECOND)
            world.apply_input(inputs.pop(time))
        world.run_to(moment)
        snapshots.take()
    return PastQuestions(snapshots)


@pytest.mark.parametrize("step", [150 * MILLISECOND, 1_600 * MILLISECOND], ids=lambda step: f"{step // MILLISECOND} ms")
def test_answers_are_those_of_what_is_noted_from_the_beginning(step: int) -> None:
    world = World.from_toml(WORLD, {"m.prg": PROGRAM.encode()})
    past = past_of(world, 4_800 * MILLISECOND, step)
    whole = Why(NotedPast(lambda: World(world.blueprint), world.inputs, world.now))
    moments = [world.now, 1_250 * MILLISECOND]
    for question in QUESTIONS:
        for at in moments:
            found, expected = finish(past.asking(question, at)), whole.ask(question, at)
            assert (found.state, found.since) == (expected.state, expected.since), (question, at)
            assert found.links[:2] == expected.links[:2], (question, at)
            if expected.since is None:
                assert (found.known_from, found.is_cut, found.is_complete) == (0, False, expected.is_complete), question


@pytest.mark.parametrize("parts", [0, 40])
def test_an_answer_for_which_there_is_no_time_says_from_when_on_it_knows(parts: int) -> None:
    is_known = False
    for question in QUESTIONS[::3]:
        world = World.from_toml(WORLD, {"m.prg": PROGRAM.encode()})
        past, left = past_of(world, 4_800 * MILLISECOND, 1_600 * MILLISECOND), iter(range(parts))
        found = finish(past.asking(question, is_over=lambda left=left: next(left, None) is None))
        whole = finish(past.asking(question))
        assert found.state == whole.state, question
        if (found.since, found.links) != (whole.since, whole.links):
            assert found.is_cut, question
            assert 0 < found.known_from < found.at, question
            assert found.since in (None, whole.since), question
            assert whole.since is None or found.since is not None or whole.since <= found.known_from, question
            is_known = True
        assert not whole.is_cut, question
    assert is_known


def test_flags_of_a_chip_are_set_without_an_event() -> None:
    """``U14`` is the byte with the user flags."""
    program = b"[\nW50\nT81\n@1\nW1\nJ1\n]\n"
    world = World.from_toml('[[m1486]]\nname = "chip"\nprogram = "p.m1486"\n', {"p.m1486": program})
    snapshots = SnapshotLog(world)
    for moment in range(50, 1000, 50):
        world.run_to(moment * MILLISECOND)
        snapshots.take()
    whole = Why(NotedPast(lambda: World(world.blueprint), world.inputs, world.now)).ask("chip.U14")
    found = finish(PastQuestions(snapshots).asking("chip.U14"))
    assert (found.state, found.since, found.links) == (whole.state, whole.since, whole.links)
    assert found.since is not None
    assert found.since < 100 * MILLISECOND


def test_an_unchanged_part_of_the_past_is_not_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World.from_toml(WORLD, {"m.prg": PROGRAM.encode()})
    past = past_of(world, 2_850 * MILLISECOND)
    runs: list[int] = []
    run = search.in_parts
    monkeypatch.setattr(search, "in_parts", lambda world, inputs, end: runs.append(end) or run(world, inputs, end))
    assert finish(past.asking("m.OUT7")).since is None
    assert runs == []
    assert finish(past.asking("other.M1_POS_ACT > 9")).since is None
    assert len(runs) <= 2, "near inputs it might move"
    runs.clear()
    assert finish(past.asking("m.IN1")).since == 1_100 * MILLISECOND
    assert len(runs) <= 1
    assert finish(past.asking("m.M2_DEC")).since is None
    assert len(runs) <= 3, "near inputs it might"
    runs.clear()
    assert finish(past.asking("m.M2_DEC")).since is None
    assert runs == []


def test_a_search_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World.from_toml(WORLD, {"m.prg": PROGRAM.encode()})
    past = past_of(world, 2_850 * MILLISECOND)
    monkeypatch.setattr(search, "MOST_PARTS", 2)
    answer = finish(past.asking("m.M2_DEC"))
    assert (answer.since, answer.is_cut) == (None, True)
    assert 0 < answer.known_from < 2_800 * MILLISECOND
    assert f"(what was before {answer.known_from / SECOND:.6f} s is not known)" in answer.text()


BACK_AGAIN = """\
n = 0
M1 = ON
MAIN:
    DELAY 0.5
    n = n + 1
    IF n = 4
        $D4 = 70000
        VMAXM2 = 300
        M3 = ON
        LIMLM4 = -10
        DELAY 0.01
        $I4 = 0
        $I5 = 0
        VMAXM2 = 60
        M3 = OFF
        LIMLM4 = 0
    ENDIF
JUMP MAIN
"""
UNCHANGED = (
    "m.DATA_TYPE",
    "m.M2_ACC",
    "m.M3_VMAX",
    "m.USER_REGISTER[6]:dint",
    "m.M4.status",
    "m.M_STATUS",
    "m.M3_POSLIM_R",
    "m.program",
    "other.M1_ACC",
)


def test_what_became_what_it_was_before_the_next_state_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World.from_toml(WORLD, {"m.prg": BACK_AGAIN.encode()})
    snapshots = SnapshotLog(world)
    for moment in range(300, 6000, 300):
        world.run_to(moment * MILLISECOND)
        snapshots.take()
    past, whole = PastQuestions(snapshots), Why(NotedPast(lambda: World(world.blueprint), world.inputs, world.now))
    changed = ("m.USER_REGISTER[4]", "m.USER_REGISTER[5]", "m.M2_VMAX", "m.M3.status", "m.M3.enabled", "m.M4_POSLIM_L")
    for question in changed:
        found, expected = finish(past.asking(question)), whole.ask(question)
        assert expected.since is not None, question
        assert (found.state, found.since) == (expected.state, expected.since), question
    runs: list[int] = []
    run = search.in_parts
    monkeypatch.setattr(search, "in_parts", lambda world, inputs, end: runs.append(end) or run(world, inputs, end))
    for question in UNCHANGED:
        found, expected = finish(past.asking(question)), whole.ask(question)
        assert (found.state, found.since, found.known_from) == (expected.state, None, 0), question
        assert runs == [], question


def test_points_that_changed_after_the_world_went_back_are_noted() -> None:
    world = World.from_toml(WORLD, {"m.prg": b"WAIT IN2 = ON\nM3 = ON\nDELAY 100\n"})
    snapshots = SnapshotLog(world)
    for _ in range(2):
        world.run_to(SECOND)
        snapshots.take()
        world.apply_input(do.Set((("m", "IN2", 1.0),)))
        for moment in range(11, 40):
            world.run_to(moment * SECOND // 10)
            snapshots.take()
        assert finish(PastQuestions(snapshots).asking("m.M3.enabled")).since is not None
        if not snapshots.branch:
            world.restore(snapshots.state_at(SECOND).snapshot)
            snapshots.gone_back()


HELD = ("IN1", "IN2", "cell.IN1 == 1", "cell.IN2 == 0 and cell.OUT1 == 1", "cell")


@pytest.mark.parametrize("since", [500, 5_000, 59_900])
def test_a_fault_that_holds_a_level_is_shown_however_old(since: int) -> None:
    """It began before all that is noted near the moment, and after the level changed or before."""
    world = World.from_toml(WAITS, {"p.prg": WAITS_PROGRAM.encode()})
    snapshots = SnapshotLog(world)
    for moment in range(0, 60_001, 300):
        world.run_to(moment * MILLISECOND)
        snapshots.take()
        if moment <= since < moment + 300:
            world.run_to(since * MILLISECOND)
            world.apply_input(do.SetFault(read("stuck machine=cell pin=IN1 value=1")))
            world.apply_input(do.SetFault(read("stuck machine=cell pin=IN2 value=0 name=cut")))
    past, whole = PastQuestions(snapshots), Why(NotedPast(lambda: World(world.blueprint), world.inputs, world.now))
    for question in HELD:
        found, expected = finish(past.asking(question)), whole.ask(question)
        assert (found.state, found.since) == (expected.state, expected.since), question
        shown = len(found.links)
        assert found.links == expected.links[:shown], question
        assert any("fault" in link.text for link in found.links), question


def test_a_fault_from_before_the_past_that_is_kept() -> None:
    world = World.from_toml(WAITS, {"p.prg": WAITS_PROGRAM.encode()})
    world.run_to(5 * SECOND)
    world.fault("stuck machine=cell pin=IN2 value=0 name=cut")
    world.run_to(7 * SECOND)
    snapshots = SnapshotLog(world)
    world.run_to(9 * SECOND)
    answer = finish(PastQuestions(snapshots).asking("IN2"))
    assert [(link.time, link.text) for link in answer.links] == [(5 * SECOND, "cell.IN2 is held at 0 by fault cut")]
    assert (answer.since, answer.known_from) == (None, 7 * SECOND)
