"""Properties of running worlds: moments to the nanosecond, distances in the units of the world, snapshots and branches."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from slides import GUARD, slide

from steptwin.campaign.properties import Verdict, read_property, watch_together
from steptwin.campaign.properties.recording import ComparisonRecord
from steptwin.campaign.properties.text import parse_property
from steptwin.campaign.properties.tree import Atom, nodes
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.world.simulation import Simulation

WORLD = (
    slide()
    + GUARD
    + """
[[script]]
name = "move"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { write = { "table.M1_POS_ABS" = 100.0 } },
]
"""
)


def world() -> World:
    return World.from_toml(WORLD)


def said(text: str, seconds: float = 4.0) -> Verdict:
    run = world()
    watch = read_property(text).watch(run)
    run.run(until=seconds)
    return watch.verdict()


def test_what_is_reached_has_its_distance_as_a_share_of_the_travel() -> None:
    """x comes to 100 mm; 120 mm is 20 of 200 mm of travel away."""
    found = said("always x.position < 120")
    assert found.holds
    assert found.robustness == pytest.approx(0.1)
    assert not said("always x.position < 90").holds
    assert said("always x.position < 90").robustness == pytest.approx(-0.05)


def test_the_moment_of_a_violation_is_that_at_which_a_run_ends_by_it() -> None:
    run = world()
    run.run(until="x.position >= 9 cm")
    assert said("never x.position >= 9 cm").at_ns == run.now
    assert said("eventually x.position >= 9 cm").at_ns == run.now


def test_a_window_counts_to_the_nanosecond() -> None:
    run = world()
    run.run(until="x.position >= 90")
    assert said(f"eventually within {run.now} ns x.position >= 90").holds
    assert not said(f"eventually within {run.now - 1} ns x.position >= 90").holds


def test_a_reaction_is_measured_from_an_edge() -> None:
    run = world()
    watch = read_property("after table.IN1 within 200 ms x.position > 50").watch(run)
    moment = world()
    moment.run(until="x.position > 50")
    run.run(until=moment.now / 1e9 - 0.1)
    run.press("guard")
    run.run(until=4.0)
    found = watch.verdict()
    assert found.holds
    assert 0.0 < found.robustness <= 0.5


def test_a_run_with_properties_is_the_same_run() -> None:
    plain, watched = world(), world()
    for text in (
        "always x.position < 120",
        "after table.M1.moving within 2 s not table.M1.moving",
        "never table.M1.velocity > 200",
    ):
        read_property(text).watch(watched)
    for run in (plain, watched):
        run.run(until=1.0)
        run.press("guard")
        run.run(until=4.0)
    assert watched.trace.digest() == plain.trace.digest()


def test_a_branch_goes_on_with_what_was_seen_before_it() -> None:
    text = "time between x.position > 10 and x.position > 90 <= 2 s and always x.position < 120"
    whole = world()
    expected = read_property(text).watch(whole)
    whole.run(until=4.0)
    common = world()
    watch = read_property(text).watch(common)
    common.run(until=0.6)
    seen, snapshot = pickle.loads(pickle.dumps(watch.state())), common.snapshot()
    for _ in range(2):
        branch = World(common.blueprint, at=snapshot)
        again = read_property(text).watch(branch, seen)
        branch.run(until=4.0)
        assert again.verdict().holds is expected.verdict().holds
        assert again.verdict().robustness == pytest.approx(expected.verdict().robustness, abs=1e-6)
        assert again.measures() == expected.measures()
    common.run(until=4.0)
    assert watch.measures() == expected.measures()


def test_a_restored_moment_undoes_what_was_seen_after_it() -> None:
    run = world()
    watch = read_property("never table.IN1").watch(run)
    run.run(until=0.5)
    before = run.snapshot()
    run.press("guard")
    run.run(until=1.0)
    assert not watch.verdict().holds
    run.restore(before)
    run.run(until=1.0)
    assert watch.verdict().holds


def test_a_watch_that_is_closed_sees_nothing_further() -> None:
    run = world()
    watch = read_property("never table.IN1").watch(run)
    run.run(until=0.5)
    watch.close()
    run.press("guard")
    run.run(until=1.0)
    assert watch.verdict().holds


def test_cycle_times_are_measures() -> None:
    run = world()
    watch = read_property("time between table.M1.moving and not table.M1.moving <= 3 s", "cycle").watch(run)
    run.run(until=4.0)
    found = watch.measures()
    assert found["cycle cycles"] == 1.0
    assert found["cycle min"] == found["cycle max"] == pytest.approx(2.1, abs=0.01)  # 100 mm / 50 mm/s + 0.1 s of a ramp
    assert watch.verdict().robustness == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("always x.position < 3 V", "3 V is compared with 'mm'"),
        ("always x.positon < 3", r"did you mean 'position'\?"),
        ("no-collision", r"this world has no \[\[collision\]\]"),
    ],
)
def test_what_a_world_does_not_have_is_refused(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        read_property(text).watch(world())


def test_what_was_seen_serves_its_own_property_and_moment_only() -> None:
    run = world()
    seen = read_property("never table.IN1").watch(run).state()
    with pytest.raises(Misuse, match=r"does not serve 'never table.IN2'"):
        read_property("never table.IN2").watch(run, seen)
    run.run(until=1.0)
    with pytest.raises(Misuse, match="does not serve a world at 1 s"):
        read_property("never table.IN1").watch(run, seen)


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("no-lost-step-unnoticed", True),
        ("never-moves-while table.IN1", True),
        ("never-moves-while not table.IN1", False),
        ("stops-within 2.5 s after table.M1.moving", True),
        ("stops-within 1.5 s after table.M1.moving", False),
        ("returns-to-safe not table.M1.moving", True),
        ("returns-to-safe table.M1.moving", False),
    ],
)
def test_ready_properties(text: str, holds: bool) -> None:
    assert said(text).holds is holds


def test_ready_properties_of_a_chip(tmp_path: Path) -> None:
    run = World.from_toml(CHIP)
    watch = read_property("never-moves-while not drum.B1").watch(run)
    run.run(until=1.0)
    assert watch.verdict().holds


CHIP = """
[[m1486]]
name = "drum"

[[axis]]
name = "d"
drive = "drum.M1"
pitch = 4.0
"""


def test_a_moment_of_standstill_is_no_stop() -> None:
    """It stands when the guard opens, and goes on before the time is over."""
    run = world()
    watches = [read_property(f"stops-within {time} after guard.pressed").watch(run) for time in ("50 ms", "400 ms")]
    run.run(until=0.5)
    run.press("guard")
    run.mic488["table"].axis[1].stop()
    run.run(until=0.6)
    run.mic488["table"].axis[1].move_to(100.0)
    run.run(until=2.0)
    assert [watch.verdict().holds for watch in watches] == [True, False]
    assert watches[1].verdict().at_ns == 900_000_000


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("always x.position < 6 cm", "x.position is 60 mm, not < 60 mm at 1.25 s"),
        ("never abs(x.position - 100) <= 0.1", "abs(x.position - 100) is 0.1 mm, not > 0.1 mm at 2.08 s"),
        ("always table.OUT1", "table.OUT1 is 0 at 0 s"),
        ("always not table.M1.moving", "table.M1.moving is not 0 at 0 s"),
        ("always table.M1.status == 3", "table.M1.status is 2 or 4, not 3 at 2.1 s"),
        ("always table.OUT1 == 1", "table.OUT1 is not 1 at 0 s"),
        ("always table.USER_REGISTER[0]:real == 5", "table.USER_REGISTER[0]:real is not 5 at 0 s"),
        ("always table.USER_REGISTER[0]:real > 5", "table.USER_REGISTER[0]:real is 0 or less, not > 5 at 0 s"),
        ("always x.position < table.M1.position - 5 mm", "x.position is 5 mm above (table.M1.position - 5 mm) at 0 s"),
        ("eventually table.OUT1", "eventually table.OUT1: not come true by 4 s"),
        ("after table.M1.moving within 1 s not table.M1.moving", "within 1 s not table.M1.moving: not come true by 1 s"),
        ("count(table.M1.moving) < 1", "count(table.M1.moving) < 1: not so at 0 s"),
    ],
)
def test_a_violation_says_what_there_was(text: str, why: str) -> None:
    assert said(text).why == why


TOGETHER = (
    "after table.M1.moving within 2 s not table.M1.moving",
    "never (x.position > 300 and table.M1.moving)",
    "always x.position < 300",
    "always x.position < 300 or table.OUT1",
    "count(not table.M1.moving) <= 3",
    "time between table.M1.moving and x.position > 5 <= 1 s",
)


def test_what_several_properties_compare_is_followed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    apart = world()
    watches = [read_property(text).watch(apart) for text in TOGETHER]
    apart.run(for_="3 s")
    expected = [(one.verdict(), one.measures()) for one in watches]

    made: list[Atom] = []
    begin = ComparisonRecord.__init__

    def noted(self: ComparisonRecord, world: Simulation, atom: Atom, *, is_fine: bool) -> None:
        made.append(atom)
        begin(self, world, atom, is_fine=is_fine)

    monkeypatch.setattr(ComparisonRecord, "__init__", noted)
    joined = world()
    several = watch_together([read_property(text) for text in TOGETHER], joined)
    joined.run(for_="3 s")
    assert [(one.verdict(), one.measures()) for one in several] == expected
    comparisons = sum(len(set(_atoms(text))) for text in TOGETHER)
    assert len(made) < comparisons
    for one in several:
        one.close()
    assert all(
        scheduler.subscribers is None or not any(scheduler.subscribers.by_name.values()) for scheduler in joined.schedulers
    )


def _atoms(text: str) -> list[Atom]:
    return [node for node in nodes(parse_property(text)) if isinstance(node, Atom)]
