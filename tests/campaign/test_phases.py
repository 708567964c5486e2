"""Phases of cycles, from recorded runs."""

from __future__ import annotations

from pathlib import Path

from steptwin.campaign.phases import CyclePhase, PhaseWatch
from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.world import World

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def phases(example: str, time: str, most: int = 100, begin: str = "") -> list[CyclePhase]:
    world = World.load(EXAMPLES / example / f"{example}.toml")
    if begin:
        world.run(for_=begin)
    watch = PhaseWatch(world)
    world.run(for_=time)
    return watch.phases(most)


def test_a_cycle_that_repeats_has_its_phases_once() -> None:
    found = phases("labeller", "60 s")
    assert [phase.number for phase in found] == list(range(1, len(found) + 1))
    assert sum(phase.total for phase in found) == 13_200 * MILLISECOND  # its script ends it
    assert len({phase.name for phase in found}) > len(found) - 2
    assert all(phase.begin <= phase.middle < phase.end for phase in found)


def test_homing_direction_status_and_line_tell_phases_apart() -> None:
    """There and back, a search for the switch, and each wait of the program, whatever the outputs are meanwhile."""
    names = [phase.name for phase in phases("pick_and_place", "20 s")]
    assert "cell.M1 homing (−), cell program line 17 WAITPOS" in names
    assert "cell.M1 moving to position (+), cell program line 33 WAITPOS" in names
    assert "cell.M1 moving to position (−), cell program line 22 WAITPOS" in names
    assert "cell.OUT1, cell program line 27 WAIT isDown = ON" in names


def test_of_many_those_that_tell_most_stay_in_order() -> None:
    """A homing of 1.5 s at the beginning is among 6 of 31 phases: it is the only one."""
    found = phases("pick_and_place", "60 s", most=6)
    assert len(found) == 6
    assert [phase.begin for phase in found] == sorted(phase.begin for phase in found)
    assert sum("homing (−)" in phase.name for phase in found) == 1


def test_the_common_beginning_has_none() -> None:
    found = phases("labeller", "10 s", begin="3010 ms")
    assert min(phase.begin for phase in found) >= 3010 * MILLISECOND
    assert "at the beginning" not in [phase.name for phase in found[1:]]


def test_a_phase_ends_when_its_motion_does() -> None:
    world = World.load(EXAMPLES / "labeller" / "labeller.toml")
    watch = PhaseWatch(world)
    world.run(for_="60 s")
    moving = next(phase for phase in watch.phases() if phase.name == "cell.M1 velocity mode (+)")
    assert moving.begin in [record.time for record in world.trace.plans("cell") if record.subject == "1"]
    assert MILLISECOND < moving.end - moving.begin < SECOND


def test_without_a_run_there_is_none() -> None:
    assert PhaseWatch(World.load(EXAMPLES / "labeller" / "labeller.toml")).phases() == []
