"""The past of a world that runs: any moment of it is as it was, and memory is bounded."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.script.steps import Set, Write
from steptwin.simulation.world import snapshotlog as module
from steptwin.simulation.world.inputs import Bytes, size_of
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshotlog import LoggedSnapshot, PastWorld, SnapshotLog

TEXT = """
[[mic488]]
name = "m"
[mic488.M1]
unit = "mm"
gear = 100.0
acc = 100.0
dec = 100.0
vel = 40.0
[[event]]
every = "700 ms"
steps = [{ set = { "m.IN5" = 1 } }, { wait = "300 ms" }, { set = { "m.IN5" = 0 } }]
"""


def make() -> World:
    world = World.from_toml(TEXT, keep_trace=False, keep_inputs=False)
    world.stop_recording()
    return world


def shown(world: Simulation) -> tuple[object, ...]:
    found = world.snapshot(with_inputs=False)
    return (
        world.now,
        world.controller("m").pins(),
        world.read("m.M1.position"),
        world.read("m.M1.velocity"),
        repr(found.schedulers),
    )


def states(snapshots: SnapshotLog) -> list[LoggedSnapshot]:
    return [*snapshots._states.back_from(snapshots.world.now)][::-1]


def go(past: PastWorld, moment: Nanos) -> Simulation:
    for _ in past.go(moment):
        pass
    return past.world


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 900), st.sampled_from(("in", "out", "move", "state"))), max_size=25), st.randoms())
def test_every_moment_is_as_it_was(acts: list[tuple[int, str]], chance: object) -> None:
    world = make()
    world.apply_input(Write((("m", "M1_EN", 1.0),)))
    snapshots, past = SnapshotLog(world), None
    seen: dict[Nanos, tuple[object, ...]] = {}
    level = 0.0
    for wait_ms, act in acts:
        world.run(for_=wait_ms / 1000)
        if act == "state":
            snapshots.take()
        elif act == "move":
            world.apply_input(Write((("m", "M1_POS_ABS", float(wait_ms)),)))
        else:
            level = 1.0 - level
            world.apply_input(Set((("m", "IN3", level),)))
        world.sync_all()
        seen[world.now] = shown(world)
    past = PastWorld(snapshots)
    moments = list(seen)
    chance.shuffle(moments)  # type: ignore[attr-defined]
    for moment in moments:
        assert shown(go(past, moment)) == seen[moment]
    assert world.now == max(seen, default=0)


def test_what_is_looked_at_touches_nothing() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=2)
    before = shown(world)
    past = PastWorld(snapshots)
    go(past, SECOND)
    past.world.apply_input(Set((("m", "IN3", 1.0),)))
    past.world.run_to(5 * SECOND)
    assert shown(world) == before


def test_moments_outside_of_what_is_kept_are_refused() -> None:
    world = make()
    world.run(for_=1)
    snapshots = SnapshotLog(world)
    world.run(for_=1)
    past = PastWorld(snapshots)
    with pytest.raises(Misuse, match=r"999999\.999 us: the past is kept from 1 s to 2 s"):
        go(past, SECOND - 1)
    with pytest.raises(Misuse, match=r"2000000\.001 us: the past is kept from 1 s to 2 s"):
        go(past, 2 * SECOND + 1)
    assert go(past, SECOND).now == SECOND


def test_states_are_bounded_and_dense_where_they_are_new() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    for _ in range(1200):
        world.run(for_=1)
        snapshots.take()
        snapshots.take()  # of the same moment: not another one
    assert len(snapshots) == module.MOST_SNAPSHOTS
    assert snapshots.begin == 0
    times = [snapshots.state_at(moment)[0].now for moment in range(0, 1200 * SECOND + 1, SECOND // 2)]
    ages = [moment * SECOND // 2 - time for moment, time in enumerate(times)]
    assert max(ages[-20:]) < SECOND
    assert max(ages) < 60 * SECOND
    assert all(age <= 2 * SECOND + (2400 - moment) * SECOND // 40 for moment, age in enumerate(ages))


def test_inputs_are_bounded_and_the_oldest_states_go_with_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_INPUTS", 10)
    world = make()
    snapshots = SnapshotLog(world)
    for count in range(25):
        world.run(for_=0.1)
        if count % 5 == 0:
            snapshots.take()
        world.apply_input(Set((("m", "IN3", float(count % 2)),)))
    assert snapshots.begin == 1_600_000_000
    assert not snapshots.keeps_inputs_from(0)
    with pytest.raises(Misuse, match=r"kept from 1600 ms to"):
        snapshots.inputs_from(0)
    past = PastWorld(snapshots)
    assert go(past, 1_600_000_000).now == snapshots.begin
    assert go(past, 2_500_000_000).controller("m").pins()["IN3"] == 0.0
    for count in range(25):  # more than may be kept, and no state among them
        world.apply_input(Set((("m", "IN3", float(count % 2)),)))
    assert (len(snapshots), snapshots.begin) == (0, world.now)
    with pytest.raises(Misuse, match="the past is kept from"):
        go(past, world.now)
    snapshots.take()
    assert go(past, world.now).now == world.now


def test_the_way_to_a_moment_leaves_a_state_for_each_slice_of_time_not_for_each_input(monkeypatch: pytest.MonkeyPatch) -> None:
    world = make()
    snapshots = SnapshotLog(world)
    for count in range(200):
        world.run(for_=0.01)
        world.apply_input(Set((("m", "IN3", float(count % 2)),)))
    past, taken = PastWorld(snapshots), []
    snapshot = past.world.snapshot

    def counted(*, with_inputs: bool = True) -> object:
        taken.append(past.world.now)
        return snapshot(with_inputs=with_inputs)

    monkeypatch.setattr(past.world, "snapshot", counted)
    go(past, 2_000_000_000)
    assert taken == [count * module.SLICE_NS for count in range(1, 8)]


def test_what_is_undone_is_no_past() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=1)
    snapshot = world.snapshot()
    snapshots.take()
    world.apply_input(Set((("m", "IN3", 1.0),)))
    world.run(for_=1)
    past = PastWorld(snapshots)
    assert go(past, 2 * SECOND).controller("m").pins()["IN3"] == 1.0
    world.restore(snapshot)
    snapshots.gone_back()
    with pytest.raises(Misuse, match="from 0 s to 1 s"):
        go(past, 2 * SECOND)
    world.run(for_=1)
    assert go(past, 2 * SECOND).controller("m").pins()["IN3"] == 0.0


def test_the_world_can_go_back_to_what_is_looked_at_and_its_digest_with_it() -> None:
    world = World.from_toml(TEXT)
    world.trace.let_go()
    snapshots = SnapshotLog(world)
    world.apply_input(Set((("m", "IN3", 1.0),)))
    world.run(for_=1.5)
    digest = world.trace.digest()
    world.run(for_=1)
    past = PastWorld(snapshots)
    world.restore(replace(go(past, 1_500_000_000).snapshot(), inputs=tuple(world.inputs[:1])))
    snapshots.gone_back()
    assert world.now == 1_500_000_000
    assert world.trace.digest() == digest


def test_nothing_is_recorded_after_the_end() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    assert world.records_inputs
    snapshots.close()
    assert not world.records_inputs
    world.apply_input(Set((("m", "IN3", 1.0),)))
    assert snapshots.inputs_from(0) == []


def test_a_past_that_was_used_for_something_else_begins_with_a_state_again() -> None:
    """Whatever came before it: a world that went back to a snapshot goes on as another branch."""
    world = make()
    snapshots = SnapshotLog(world)
    kept = world.snapshot(with_inputs=False)
    past = PastWorld(snapshots)
    for branch in range(3):
        world.run(for_=2)
        before = shown(go(past, SECOND))
        past.world.apply_input(Set((("m", "IN3", 1.0),)))
        assert shown(past.world) != before
        past.forget()
        assert shown(go(past, SECOND)) == before, branch
        world.restore(kept)
        snapshots.gone_back()


@pytest.mark.parametrize(("controller_states", "most"), [(0, 16), (16, 16), (17, 17), (300, 256)])
def test_how_many_snapshots_are_kept(monkeypatch: pytest.MonkeyPatch, controller_states: int, most: int) -> None:
    """Of a world with one controller: as many as there may be states of controllers, but 16 to 256."""
    monkeypatch.setattr(module, "MOST_CONTROLLER_STATES", controller_states)
    world = make()
    snapshots = SnapshotLog(world)
    kept = 0
    for _ in range(most + 5):
        world.run(for_=0.001)
        snapshots.take()
        kept = max(kept, len(snapshots))
    assert kept == most


def test_a_branch_begins_whenever_the_world_goes_back() -> None:
    snapshots = SnapshotLog(make())
    assert snapshots.branch == 0
    snapshots.gone_back()
    assert snapshots.branch == 1


def test_what_a_snapshot_that_goes_had_seen_changed_stays_with_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_CONTROLLER_STATES", 16)
    world = World.from_toml(TEXT)
    snapshots = SnapshotLog(world)
    for count in range(20):
        world.run(for_=0.01)
        world.apply_input(Set((("m", f"IN{count + 1}", 1.0),)))
        world.sync_all()
        snapshots.take()
    assert len(snapshots) == 16
    changed = [name for state in states(snapshots) for controller, name in state.changed if name.startswith("IN")]
    assert sorted(changed) == sorted(f"IN{count + 1}" for count in range(20))


def test_inputs_are_bounded_by_their_bytes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    text = '[[line]]\nname = "bus"\nkind = "modbus"\n' + TEXT.replace('name = "m"', 'name = "m"\nline = "bus"')
    world = World.from_toml(text, keep_trace=False, keep_inputs=False)
    given = Bytes("bus", "here", "rtu", b"nothing")
    monkeypatch.setattr(module, "MOST_INPUT_BYTES", 3 * size_of(given))
    snapshots = SnapshotLog(world)
    for count, kept in enumerate((1, 2, 3, 0, 1), start=1):
        world.run(for_=0.1)
        world.apply_input(given)
        assert (snapshots.kept_inputs, snapshots.inputs_so_far) == (kept, count)
    # Those that are undone no longer count.
    world.run(for_=0.1)
    snapshot = world.snapshot()
    for _ in range(4):
        world.run(for_=0.1)
        world.apply_input(given)
        assert snapshots.kept_inputs == 2
        world.restore(snapshot)
        snapshots.gone_back()
        assert snapshots.kept_inputs == 1


def test_nothing_watches_the_trace_after_the_end() -> None:
    world = make()
    watchers = list(world.trace.subscribers)
    snapshots = SnapshotLog(world)
    assert world.trace.subscribers != watchers
    snapshots.close()
    assert world.trace.subscribers == watchers
    subscribers = world.objects.scheduler_of["m"].subscribers
    assert subscribers is None or not subscribers.by_name["m"]


@pytest.mark.parametrize(("controllers", "most"), [(1, 60), (2, 30), (3, 20), (5, 16)])
def test_a_world_of_more_controllers_keeps_fewer_snapshots(monkeypatch: pytest.MonkeyPatch, controllers: int, most: int) -> None:
    monkeypatch.setattr(module, "MOST_CONTROLLER_STATES", 60)
    world = World.from_toml("".join(f'[[mic488]]\nname = "m{n}"\n' for n in range(controllers)), keep_inputs=False)
    snapshots = SnapshotLog(world)
    for _ in range(most + 2):
        world.run(for_=0.001)
        snapshots.take()
    assert len(snapshots) == most


def test_what_a_past_knows_of_its_place() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    past = PastWorld(snapshots)
    assert not past.is_in_step
    world.run(for_=1)
    go(past, SECOND)
    assert (past.is_in_step, past.lacks_inputs, past.can_go_on) == (True, False, True)
    world.apply_input(Set((("m", "IN3", 1.0),)))
    assert (past.is_in_step, past.lacks_inputs) == (True, True)
    world.run(for_=1)
    assert not past.is_in_step
    for _ in past.go_on(world.now):
        pass
    assert (past.is_in_step, past.lacks_inputs, past.world.controller("m").pins()["IN3"]) == (True, False, 1.0)
    past.forget()
    assert not past.is_in_step
    assert not past.world.records_inputs  # its own inputs are kept by nobody


def test_a_past_goes_on_from_where_it_is_and_back_to_the_nearest_state(monkeypatch: pytest.MonkeyPatch) -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=3)
    past, restored = PastWorld(snapshots), []
    restore = past.world.restore
    monkeypatch.setattr(past.world, "restore", lambda snapshot: (restored.append(snapshot.now), restore(snapshot)))
    for moment in (0.9, 1.0, 1.0, 2.1, 0.6, 0.55, 0.5, 2.0):
        go(past, round(moment * SECOND))
    # A state every 250 ms on the way; from one of them on where time goes back, and where there is a newer one.
    assert restored == [0, 500_000_000, 500_000_000, 500_000_000, 2_000_000_000]


def test_what_is_undone_in_its_own_moment_is_gone_too() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=1)
    snapshot = world.snapshot()
    world.apply_input(Set((("m", "IN3", 1.0),)))
    snapshots.take()
    world.restore(snapshot)
    snapshots.gone_back()
    assert (snapshots.kept_inputs, snapshots.inputs_so_far, len(snapshots)) == (0, 0, 2)
    assert snapshots.state_at(SECOND).inputs == 0
    assert go(PastWorld(snapshots), SECOND).controller("m").pins()["IN3"] == 0.0


@pytest.mark.parametrize("keep", [True, False])
def test_a_past_keeps_a_trace_like_its_world_but_no_inputs(keep: bool) -> None:
    world = World.from_toml(TEXT, keep_trace=keep)
    snapshots = SnapshotLog(world)
    world.run(for_=1.0)
    world.apply_input(Set((("m", "IN3", 1.0),)))
    world.run(for_=1.0)
    there = go(PastWorld(snapshots), world.now)
    assert there.trace.is_recorded
    assert there.trace.is_kept is keep
    assert there.trace.digest() == world.trace.digest()
    assert list(there.inputs) == []
    world.stop_recording()
    assert not PastWorld(snapshots).world.trace.is_recorded


def test_what_has_changed_in_what_is_undone_may_have_changed_where_it_goes_on() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=1)
    snapshot = world.snapshot()
    for name in ("IN3", "IN4"):
        world.apply_input(Set((("m", name, 1.0),)))
        world.run(for_=1)
        snapshots.take()
    world.restore(snapshot)
    snapshots.gone_back()
    assert {("m", "IN3"), ("m", "IN4")} <= states(snapshots)[-1].changed


def test_the_snapshot_that_is_missed_least_may_be_the_first_after_the_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_CONTROLLER_STATES", 16)
    world = make()
    snapshots = SnapshotLog(world)
    for moment in (0.001, *range(1, 16)):
        world.run(until=float(moment))
        snapshots.take()
    assert [state.snapshot.now for state in states(snapshots)] == [moment * SECOND for moment in range(16)]


def test_a_value_that_changes_again_after_it_was_undone_is_noted_again() -> None:
    world = make()
    snapshots = SnapshotLog(world)
    world.run(for_=1)
    snapshot = world.snapshot()
    found = []
    for _ in range(2):
        world.restore(snapshot)
        snapshots.gone_back()
        world.apply_input(Write((("m", "M1_EN", 1.0),)))
        world.run(for_=1)
        snapshots.take()
        found.append(states(snapshots)[-1].changed)
    assert ("m", "M1.enabled") in found[0]
    assert found[0] <= found[1]


def test_the_snapshot_that_is_missed_least_may_be_the_last_before_the_newest(monkeypatch: pytest.MonkeyPatch) -> None:
    """All others are three times as old as the one after them."""
    monkeypatch.setattr(module, "MOST_CONTROLLER_STATES", 16)
    world = World.from_toml('[[mic488]]\nname = "m"\n')
    world.stop_recording()
    snapshots = SnapshotLog(world)
    ages = [3**count for count in reversed(range(15))]
    for age in (*ages, 2 / 3, 0):
        world.run(until=round((3**14 - age) * 1.5, 3))
        snapshots.take()
    assert [(world.now - state.snapshot.now) / SECOND for state in states(snapshots)] == [*(1.5 * age for age in ages), 0]
