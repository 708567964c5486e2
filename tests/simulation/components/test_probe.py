"""What a probe finds of many workpieces on belts that run for ever: as by looking at each of them, with fewer searches."""

from __future__ import annotations

from random import Random

import pytest

from steptwin.controller import Nanos
from steptwin.files.world import World
from steptwin.simulation.components import workpieces
from steptwin.simulation.space.contacts import Look, Pair
from steptwin.simulation.world.records import describe


def described(belts: int, beams: list[int], blades: list[int]) -> str:
    """Belts of 6 m beside each other, with a beam and a blade across each at every one of these places."""
    text = '[[mic488]]\nname = "c"\n'
    for n in range(belts):
        text += f"""
[[conveyor]]
name = "belt{n}"
length = 6000
speed = {60 + 25 * n}
run = "c.OUT{n + 1}"
ramp_up = "{200 * n} ms"
ramp_down = "{150 * n} ms"
workpiece = [40, 40, 30]
width = 60
at = [0, {200 * n}, 100]
"""
        for k, at in enumerate(beams):
            text += f"""
[[beam]]
name = "beam{n}_{k}"
at = [{at + 7 * n}, {200 * n - 60}, 115]
along = "+y"
length = 120
"""
        for k, at in enumerate(blades):
            text += f"""
[[cylinder]]
name = "cylinder{n}_{k}"
extend = "c.OUT{5 + k}"
stroke = 100
extend_time = "{300 + 50 * n} ms"
at = [{at + 9 * n}, {200 * n - 85}, 120]
along = "+y"
[[body]]
name = "blade{n}_{k}"
on = "cylinder{n}_{k}"
size = [30, 10, 30]
"""
    names = ", ".join(f'"blade{n}_{k}"' for n in range(belts) for k in range(len(blades)))
    return text + f'[[collision]]\nname = "crash"\nbetween = [{names}, "workpieces"]\n'


def filled(text: str, places: list[list[int]]) -> World:
    world = World.from_toml(text)
    world.run(for_=0.001)
    for n, its in enumerate(places):
        for at in its:
            world.put(f"belt{n}", at)
    return world


def told(world: World) -> list[str]:
    return [f"{one.time} {describe(one)}" for one in world.trace]


def random_run(seed: int) -> tuple[list[str], list[str]]:
    """What is told of a run, and of its second half when a snapshot is restored."""
    chance = Random(seed)
    beams, blades = [chance.randrange(300, 5900) for _ in range(3)], [chance.randrange(300, 5900) for _ in range(2)]
    places = [[at + chance.randrange(60) for at in sorted(chance.sample(range(60, 5800, 110), 9))] for _ in range(2)]
    world = filled(described(2, beams, blades), places)
    pins = ["OUT1", "OUT2", "OUT5", "OUT6"]
    changes = [(pin, 1) for pin in pins] + [(chance.choice(pins), chance.randrange(2)) for _ in range(20)]
    waits = [chance.choice([0.05, 0.4, 1.0, 3.0, 11.0]) for _ in changes]

    def go_on(begin: int, end: int) -> None:
        for (pin, level), wait in zip(changes[begin:end], waits[begin:end], strict=True):
            world.mic488["c"].write(pin, level)
            world.run(for_=wait)

    half = len(changes) // 2
    go_on(0, half)
    before, noted = world.snapshot(), len(world.trace)
    go_on(half, len(changes))
    every = told(world)
    world.restore(before)
    go_on(half, len(changes))
    assert told(world)[-len(every[noted:]) :] == every[noted:]
    return every, every[noted:]


@pytest.mark.parametrize("seed", range(6))
def test_it_finds_what_looking_at_each_of_them_finds(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workpieces, "FEW_ENDLESS", 0)
    found = random_run(seed)
    monkeypatch.setattr(workpieces, "FEW_ENDLESS", 10**6)
    assert found == random_run(seed)
    assert any("beam" in line for line in found[0])


def searches(places: list[int], monkeypatch: pytest.MonkeyPatch) -> int:
    """Count of those that a blade at 3 m makes which goes to and fro, with so many workpieces on its belt."""
    searched = 0
    search = Pair.next_change

    def next_change(pair: Pair, now: Nanos, *, overlap: bool) -> Look:
        nonlocal searched
        searched += 1
        return search(pair, now, overlap=overlap)

    world = filled(described(1, [], [3000]), [places])
    with monkeypatch.context() as patch:
        patch.setattr(Pair, "next_change", next_change)
        world.mic488["c"].write("OUT1", 1)
        for level in (1, 0) * 3:
            world.mic488["c"].write("OUT5", level)
            world.run(for_=0.6)
    return searched


def test_those_that_come_later_than_what_was_found_are_not_searched_for(monkeypatch: pytest.MonkeyPatch) -> None:
    every = list(range(100, 5900, 120))
    near = [at for at in every if 1800 < at < 3300]
    assert len(near) > workpieces.FEW_ENDLESS
    assert 0 < searches(every, monkeypatch) < 1.5 * searches(near, monkeypatch)
