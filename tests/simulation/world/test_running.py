"""What a script in Python has been sent is kept and given again in the same order."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.running import Script, SentValues

VALUES = st.lists(st.none() | st.booleans() | st.floats(allow_nan=False) | st.binary(max_size=300))


@given(VALUES, VALUES)
def test_values_come_back_as_they_were_sent(first: list[object], more: list[object]) -> None:
    sent = SentValues()
    for value in first:
        sent.add(value)
    copy = sent.copy()
    for value in more:
        sent.add(value)
    assert (len(copy), len(sent)) == (len(first), len(first) + len(more))
    for found, expected in ((copy, first), (sent, first + more)):
        values = list(found.values())
        assert values == expected
        assert [type(value) for value in values] == [type(value) for value in expected]


@pytest.mark.parametrize("value", [1, "text", Decimal(1)])
def test_what_no_step_gives_is_refused(value: object) -> None:
    with pytest.raises(Misuse, match="the result of a step is None, a truth value, a number or bytes"):
        SentValues().add(value)


def test_the_end_of_a_script_in_python_leaves_its_blocks() -> None:
    left: list[str] = []

    def steps() -> do.Steps:
        try:
            yield do.Note("one")
            yield do.Note("one")
        finally:
            left.append("block")

    script = Script(1, "s", steps, is_external=False)
    assert script.send(None) is not None
    script.end()
    assert (script.ended, left) == (True, ["block"])


def test_a_script_that_was_brought_back_can_be_brought_back_again() -> None:
    seen: list[object] = []

    def steps() -> do.Steps:
        seen.append((yield do.Read("x")))
        seen.append((yield do.Read("y")))
        yield do.Note("end")

    script = Script(1, "s", steps, is_external=True)
    for value in (None, 1.0):
        script.send(value)
    for _ in range(3):
        script = Script.at(script.state())
    seen.clear()
    assert script.send(2.0) == do.Note("end")
    assert seen == [2.0]
