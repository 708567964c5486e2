"""Phases of cycles, from recorded runs."""

from __future__ import annotations

from pathlib import Path

from steptwin.campaign.phases import cycle_phases
from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.world import World

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def labeller() -> World:
    world = World.load(EXAMPLES / "labeller" / "labeller.toml")
    world.run(for_="60 s")
    return world


def test_a_cycle_that_repeats_has_its_phases_once() -> None:
    found = cycle_phases(labeller())
    assert [phase.name for phase in found][-3:] == ["cell.OUT1", "cell.M1 moving", "cell.OUT2"]
    assert [phase.number for phase in found] == list(range(1, len(found) + 1))
    assert sum(phase.total for phase in found) == labeller().now
    assert all(phase.begin <= phase.middle < phase.end for phase in found)


def test_of_many_the_longest_stay_in_order() -> None:
    found = cycle_phases(labeller(), most=2)
    assert [phase.name for phase in found] == ["cell.M1 moving", "cell.OUT2"]
    assert found[0].begin < found[1].begin


def test_the_common_beginning_has_none() -> None:
    found = cycle_phases(labeller(), begin=3 * SECOND)
    assert all(phase.begin >= 3 * SECOND for phase in found)


def test_a_phase_ends_when_its_motion_does() -> None:
    world = labeller()
    moving = next(phase for phase in cycle_phases(world) if phase.name == "cell.M1 moving")
    plans = [record for record in world.trace.plans("cell") if record.subject == "1"]
    assert moving.begin in [record.time for record in plans]
    assert MILLISECOND < moving.end - moving.begin < SECOND


def test_without_a_run_there_is_none() -> None:
    assert cycle_phases(World.load(EXAMPLES / "labeller" / "labeller.toml")) == []


def test_what_was_before_the_common_beginning_names_no_phase() -> None:
    world = World.load(EXAMPLES / "labeller" / "labeller.toml")
    world.run(for_="3010 ms")
    found = cycle_phases(world, begin=3 * SECOND)
    assert found[0].begin == 3 * SECOND
    assert found[0].name == "at the beginning"
