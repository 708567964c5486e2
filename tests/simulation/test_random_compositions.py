"""Worlds composed by chance are the same in the quick ways and in the general one, whoever looks on, and copied at any moment.

The shortcuts that this concerns are listed in the architecture page.
"""

from __future__ import annotations

import re

from compositions import BASE, PARTS, as_it_is, composed, copies, generally, looked_on
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.simulation.components.registry import ELEMENTS


def test_every_element_can_be_in_one() -> None:
    there = {table for text in (BASE, *PARTS) for table in re.findall(r"^\[\[([a-z]+)\]\]", text, re.MULTILINE)}
    assert set(ELEMENTS) <= there


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32))
def test_a_composition_is_the_same_in_every_way(seed: int) -> None:
    composition = composed(seed)
    expected = as_it_is(composition)
    assert generally(composition) == expected
    assert looked_on(composition) == expected
    for copy in copies(composition):
        assert copy == expected
