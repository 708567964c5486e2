"""The keys of descriptions and steps."""

from __future__ import annotations

import pytest

from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.steptable import ACTIONS
from steptwin.simulation.describe.tables import written_tables


@pytest.mark.parametrize("table", [*written_tables(), "step"])
def test_each_key_says_what_it_means_and_what_is_permitted(table: str) -> None:
    steps = [key for action in ACTIONS.values() for key in (action.main, *action.others)]
    for key in written_tables().get(table, steps):
        assert key.meaning, key.name
        assert key.permitted, key.name


@pytest.mark.parametrize(("gap", "gap_ns"), [("'0.001 us'", 1), ("1e-6", 1), ("1.5", 1_500_000), ("10000", 10**10)])
def test_the_gap_of_a_line_may_be_as_short_as_a_nanosecond(gap: str, gap_ns: int) -> None:
    spec = read_world("w", f'[[line]]\nname = "bus"\ngap = {gap}\n[[mic488]]\nname = "a"\nline = "bus"\n')
    assert [line.gap for line in spec.lines] == [gap_ns]


def test_axes_and_inputs_of_controllers_are_among_the_tables() -> None:
    tables = {name: {key.name: key for key in keys} for name, keys in written_tables().items()}
    velocity = tables["[mic488.M1] to [mic488.M4]"]["vel"]
    assert (velocity.meaning, velocity.permitted) == ("velocity, u/s", "a number > 0 in units/s")
    assert tables["[mic488.IN1] to [mic488.IN20]"]["filter"].permitted.startswith("10 ms (0), 50 ms (1)")
    assert "[gateway.modbus]" in tables
