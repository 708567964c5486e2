"""The example worlds: each does what its script checks, survives one fault, and reports another."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.simulation.world.check import diagnose

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
ENDS: dict[str, str | None] = {
    "hoist": "three floors served",
    "press": "the press is safe",
    "indexer": "two revolutions",
    "labeller": "ten products labelled",
    "plotter": "the octagon is drawn",
    "winder": None,
    "filler": None,
    "two_stations": "both stations served",
    "palletizer": "the pallet is full",
}
"""What a script stops with; None: they go on for ever."""

SECONDS = {"filler": 70}
"""Until their checks are through, where that is longer than a minute."""


def example(name: str) -> World:
    return World.load(EXAMPLES / name / f"{name}.toml")


@pytest.mark.parametrize("path", sorted(EXAMPLES.rglob("*.toml")), ids=lambda path: path.stem)
def test_nothing_in_it_is_wrong_or_doubtful(path: Path) -> None:
    assert not diagnose(path.name, path.read_text(encoding="utf-8"), lambda name: (path.parent / name).read_bytes()).findings


@pytest.mark.parametrize("name", ENDS)
def test_it_does_what_it_is_for(name: str) -> None:
    with example(name) as world:
        assert world.run(for_=SECONDS.get(name, 60)) == ENDS[name]
        assert not world.failures
        assert not world.overdue


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("hoist", "worn-brake element=hold share=0.6"),
        ("press", "no-air element=ram from_s=2.2 until_s=2.25"),
        ("indexer", "lost-steps machine=cell at_s=5 pulses=64"),
        ("labeller", "belt-stop element=belt from_s=4 until_s=5"),
        ("plotter", "stiff-guides element=beam factor=2"),
        ("winder", "dead-motor element=reel from_s=20 until_s=21"),
        ("filler", "empty-feeder element=infeed from_s=20 until_s=26"),
        ("palletizer", "worn-brake element=hold share=0.6"),
    ],
)
def test_it_survives_a_fault(name: str, fault: str) -> None:
    with example(name) as world:
        world.fault(fault)
        assert world.run(for_=SECONDS.get(name, 60)) == ENDS[name]
        assert not world.failures
        assert not world.overdue


@pytest.mark.parametrize(
    ("name", "fault", "failure"),
    [
        ("hoist", "worn-brake element=hold share=0.2", "abs(z.position - 500) < 0.2"),
        ("press", "welded-contact element=safety", "strokes.count == 1 and danger.count == 0"),
        ("labeller", "stuck machine=cell pin=IN2 value=0 from_s=6", "belt.delivered == 10 and labels.count == products.count"),
        ("plotter", "stall machine=cell axis=3 at_s=4 for_s=0.5", "not cell.OUT1 and not cell.OUT3 and beam.count == 0"),
        (
            "winder",
            "slip machine=winder axis=1 at_s=20 counts=100",
            "not winder.OUT2 or abs(traverse.position - (160 - abs(turns.value * 8 % 320 - 160))) < 1",
        ),
        ("filler", "jam element=valve from_s=17.8", "spill.count == 0"),
        ("indexer", "lost-steps machine=cell at_s=5 pulses=640", "abs(table.position - 720) < 1"),
        (
            "palletizer",
            "welded-contact element=sto",
            "x_axis.speed == 0 and y_axis.speed == 0 and z_axis.speed == 0 and danger.count == 0",
        ),
    ],
)
def test_it_reports_another(name: str, fault: str, failure: str) -> None:
    with example(name) as world:
        world.fault(fault)
        world.run(for_=SECONDS.get(name, 60))
        assert failure in [str(record.value).partition("; ")[0] for record in world.failures]


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("moment_s", [0.31, 1.77, 2.503])
def test_it_can_be_restored_anywhere(name: str, moment_s: float) -> None:
    with example(name) as world, example(name) as other:
        world.run(until=moment_s)
        snapshot = world.snapshot()
        world.run(for_=3.0)
        other.restore(snapshot)
        other.run(for_=3.0)
        assert other.trace.digest() == world.trace.digest()
