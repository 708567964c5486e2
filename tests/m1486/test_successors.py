"""What can be executed after each command: the commands of the manual's chapter on programs, with their ways out."""

from __future__ import annotations

import pytest

from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.structure import streams
from steptwin.m1486.successors import flow_of
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import variant


@pytest.mark.parametrize(
    ("text", "after"),
    [
        ("F64 R", [(1,), (2,)]),
        # A loop that is run through once does not go back; one that is run through more often does, behind its L.
        ("L1 F64 E R", [(1,), (2,), (3,), (4,)]),
        ("L2 F64 E R", [(1,), (2,), (1, 3), (4,)]),
        ("L3 L2 F64 E E R", [(1,), (2,), (3,), (2, 4), (1, 5), (6,)]),
        ("E R", [(1,), (2,)]),
        # I goes to its label or on, J to its label alone.
        ("@1 I1H1 R J1", [(1,), (0, 2), (3,), (0,)]),
        ("I1H9 R", [(1,), (2,)]),
        ("J9 R", [(), (2,)]),
        # The label of a J or ' without a number is that of the variable.
        ("[ :2 J @1 R @2 R ]", [(1,), (2,), (5,), (4,), (5,), (6,), (7,), (8,)]),
        # A dot leads back to calls, wherever they are.
        ("[ :2 ' @1 R . @2 R . ]", [(1,), (2,), (6,), (4,), (5,), (), (7,), (8,), (), (10,)]),
        # With T44 a call in a subroutine is left out, and so is a dot outside of one.
        ("[ T44 '1 R @1 R . ]", [(1,), (2,), (4, 3), (4,), (5,), (6,), (7,), (8,)]),
        ("[ T40 '1 R @1 R . ]", [(1,), (2,), (4,), (4,), (5,), (6,), (), (8,)]),
        # After a jump out of it, an E belongs to whichever loop is in progress.
        ("[ L2 J1 E @1 L3 E ]", [(1,), (2,), (4,), (2, 6, 4), (5,), (6,), (2, 6, 7), (8,)]),
    ],
)
def test_the_ways_out_of_commands(text: str, after: list[tuple[int, ...]]) -> None:
    (stream,) = streams(parse(text.replace(" ", "\r")).program)
    flow = flow_of(stream, variant("B"), STEP_DIRECTION)
    assert [flow.calls.get(index, ways) for index, ways in enumerate(flow.after)] == after
