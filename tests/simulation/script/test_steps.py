"""Steps in order: walks, and what their place is."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.simulation.script import steps as do
from steptwin.simulation.world.running import Script, SentValues

NOTES = st.builds(do.Note, st.sampled_from("abc"))
STEPS = st.recursive(
    st.lists(NOTES, max_size=3).map(tuple),
    lambda inner: st.lists(NOTES | st.builds(do.Repeat, st.integers(0, 3), inner), max_size=3).map(tuple),
    max_leaves=6,
)


def expanded(steps: tuple[do.Step, ...]) -> Iterator[do.Step]:
    for step in steps:
        if isinstance(step, do.Repeat):
            for _ in range(step.times):
                yield from expanded(step.steps)
        else:
            yield step


@given(steps=STEPS, times=st.integers(0, 3), taken=st.integers(0, 30))
def test_a_walk_takes_all_steps_and_goes_on_from_its_place(steps: tuple[do.Step, ...], times: int, taken: int) -> None:
    wanted = [*expanded(steps)] * times
    walk = do.run_through(steps, times)
    assert [*islice(walk, taken)] == wanted[:taken]
    other = do.run_through(steps, times)
    other.place = walk.place
    assert [*other] == [*walk] == wanted[taken:]


@pytest.mark.parametrize("steps", [(), (do.Repeat(10**9, ()),), (do.Repeat(10**9, (do.Repeat(10**9, ()),)),)])
def test_nothing_is_repeated_in_no_time(steps: tuple[do.Step, ...]) -> None:
    assert [*do.run_through((do.Note("a"), *steps, do.Note("b")), 2)] == [do.Note("a"), do.Note("b")] * 2
    assert [*do.run_through(steps, 10**9)] == []


def test_turns_of_a_period_begin_at_its_multiples() -> None:
    walk = do.run_every((do.Note("a"),), 10, 5)
    assert [*islice(walk, 5)] == [do.At(15), do.Note("a"), do.At(25), do.Note("a"), do.At(35)]
    again = do.run_every((do.Note("a"),), 10, 5)
    again.place = walk.place
    assert [*islice(again, 2)] == [do.Note("a"), do.At(45)]


def test_a_condition_has_to_become_false_before_it_acts_again() -> None:
    steps = (do.Note("a"),)
    assert [*islice(do.run_when(steps, "x", once=False), 4)] == [
        do.Until("x"),
        do.Note("a"),
        do.Until("not (x)"),
        do.Until("x"),
    ]
    assert [*do.run_when(steps, "x", once=True)] == [do.Until("x"), do.Note("a")]


@given(values=st.lists(st.none() | st.booleans() | st.floats(allow_nan=False) | st.binary(max_size=5), max_size=20))
def test_a_generator_is_brought_back_by_sending_it_the_same(values: list[object]) -> None:
    seen: list[object] = []

    def operator() -> do.Steps:
        while True:
            seen.append((yield do.Note(f"{len(seen)}")))

    script = Script(3, "operator", operator, is_external=True)
    script.send(None)
    for value in values:
        script.send(value)
    state = script.state()
    first, seen[:] = list(seen), []
    again = Script.at(state)
    assert seen == first == values
    assert again.send(None) == do.Note(f"{len(values) + 1}")


def test_what_a_step_cannot_give_is_not_sent() -> None:
    with pytest.raises(do.Misuse, match="5: the result of a step is None, a truth value, a number or bytes"):
        SentValues().add(5)
