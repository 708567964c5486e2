"""Logic without delay: what it counts does not depend on the order of the tables, and is what the settled levels give."""

from __future__ import annotations

from itertools import permutations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.files.world import World
from steptwin.simulation.scheduler.order import successors, update_order
from steptwin.simulation.scheduler.wires import PinName, Wire

BASE = '[[mic488]]\nname = "c"\n'
NOT = '[[gate]]\nname = "off"\nkind = "not"\ninputs = ["c.OUT1"]\n'
BOTH = '[[gate]]\nname = "both"\nkind = "and"\ninputs = ["c.OUT1", "off.out"]\n'
COUNTER = '[[counter]]\nname = "count"\nup = "both.out"\npreset = 1\n'
LATCH = '[[latch]]\nname = "seen"\nset = "both.out"\n'


@pytest.mark.parametrize("order", list(permutations((NOT, BOTH, COUNTER, LATCH))))
def test_an_input_and_its_inverse_are_never_both_on(order: tuple[str, ...]) -> None:
    world = World.from_toml(BASE + "".join(order))
    for level in (1, 0, 1):
        world.mic488["c"].write("OUT1", level)
        world.run(for_="10 ms")
    assert world.read("count.count") == world.read("seen.out") == 0
    assert [record.value for record in world.trace.edges() if record.subject == "both.out"] == [0.0]


FUNCTIONS = {
    "and": min,
    "or": max,
    "xor": lambda levels: sum(levels) & 1,
    "nand": lambda levels: 1 - min(levels),
    "nor": lambda levels: 1 - max(levels),
}
OUTPUTS = 3


@st.composite
def networks(draw: st.DrawFn) -> tuple[list[tuple[str, list[int]]], list[int]]:
    """Gates, each with its kind and its connections (outputs of the controller, then gates); the order of their tables."""
    gates = []
    for number in range(draw(st.integers(2, 7))):
        inputs = draw(st.lists(st.integers(0, OUTPUTS + number - 1), min_size=1, max_size=3))
        gates.append((draw(st.sampled_from(sorted(FUNCTIONS))), inputs))
    return gates, draw(st.permutations(range(len(gates))))


def settled(gates: list[tuple[str, list[int]]], levels: list[int]) -> list[int]:
    found = list(levels)
    for kind, inputs in gates:
        found.append(FUNCTIONS[kind]([found[one] for one in inputs]))
    return found[OUTPUTS:]


def source(number: int) -> str:
    return f'"c.OUT{number + 1}"' if number < OUTPUTS else f'"g{number - OUTPUTS}.out"'


@settings(max_examples=40, deadline=None)
@given(networks(), st.lists(st.tuples(st.integers(0, OUTPUTS - 1), st.integers(0, 1)), min_size=1, max_size=6))
def test_counters_count_changes_of_settled_levels(
    network: tuple[list[tuple[str, list[int]]], list[int]], changes: list[tuple[int, int]]
) -> None:
    gates, order = network
    text = BASE
    for number in order:
        kind, inputs = gates[number]
        text += f'[[counter]]\nname = "n{number}"\nup = "g{number}.out"\npreset = 9\n'
        text += f'[[gate]]\nname = "g{number}"\nkind = "{kind}"\ninputs = [{", ".join(map(source, inputs))}]\n'
    world = World.from_toml(text)
    levels = [0] * OUTPUTS
    before = settled(gates, levels)
    world.run(for_="1 ms")
    counted = [int(world.read(f"n{number}.count")) for number in range(len(gates))]
    for output, level in changes:
        world.mic488["c"].write(f"OUT{output + 1}", level)
        world.run(for_="1 ms")
        levels[output] = level
        now = settled(gates, levels)
        counted = [count + (new > old) for count, new, old in zip(counted, now, before, strict=True)]
        before = now
    assert [world.read(f"n{number}.count") for number in range(len(gates))] == counted
    assert [world.read(f"g{number}.out") for number in range(len(gates))] == before


def test_a_relay_that_holds_itself_is_a_loop() -> None:
    text = BASE + (
        '[[relay]]\nname = "k"\ncoil = "run.out"\npull_in = "5 ms"\n'
        '[[gate]]\nname = "run"\nkind = "and"\ninputs = ["either.out", "c.OUT2"]\n'
        '[[gate]]\nname = "either"\nkind = "or"\ninputs = ["c.OUT1", "k.no"]\n'
    )
    world = World.from_toml(text)
    for output, level, on in (("OUT2", 1, 0), ("OUT1", 1, 1), ("OUT1", 0, 1), ("OUT2", 0, 0), ("OUT2", 1, 0)):
        world.mic488["c"].write(output, level)
        world.run(for_="10 ms")
        assert world.read("k.no") == on


def test_what_follows_what() -> None:
    wires = [Wire(PinName("a", "OUT"), PinName("b", "IN1")), Wire(PinName("b", "OUT"), PinName("a", "IN1"), delay=1)]
    watching = {"a": [0, 2], "b": [1]}
    # Part 2 is a contact at an input of a.
    after = successors(["a", "b", None], watching, {2: "a"}, wires)
    assert after == [{1}, set(), {0}]
    assert update_order(after, ()) == [2, 0, 1]
    assert update_order([set(), set(), set()], [0]) == [1, 2, 0]
    # 1 and 2 are a loop; 0 follows it, 3 is before it.
    assert update_order([set(), {0, 2}, {1}, {2}], ()) == [3, 1, 0, 2]


def reached(number: int, after: list[set[int]]) -> set[int]:
    found = {*after[number]}
    for _ in after:
        found |= {one for other in found for one in after[other]}
    return found


@st.composite
def graphs(draw: st.DrawFn) -> list[set[int]]:
    count = draw(st.integers(1, 9))
    return [draw(st.sets(st.integers(0, count - 1), max_size=3)) - {number} for number in range(count)]


@settings(max_examples=80, deadline=None)
@given(graphs(), st.sets(st.integers(0, 8), max_size=2))
@example([{2}, {3, 6}, {4, 6}, {0, 4}, {0, 1, 2, 3, 6}, {0, 7}, {3, 4}, {1, 5}], {3, 4})
def test_only_within_a_loop_does_a_part_come_before_what_drives_it(after: list[set[int]], late: set[int]) -> None:
    """In the example two parts that drive each other, 5 and 7, are before a loop with lower numbers."""
    found = update_order(after, late)
    assert sorted(found) == [*range(len(after))]
    place = {number: n for n, number in enumerate(found)}
    assert [(a, b) for a, those in enumerate(after) for b in those if place[a] > place[b] and a not in reached(b, after)] == []
