"""Foreseeing against looking at every moment."""

from __future__ import annotations

from bisect import bisect_right

from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.wbc.controller import FOREVER
from steptwin.wbc.looks import first_change

HORIZON = 10**6


@given(
    turns=st.lists(st.tuples(st.integers(1, 400), st.integers(-9, 9)), max_size=6),
    threshold=st.integers(-900, 900),
    begin=st.integers(0, 300),
    period=st.integers(1, 50),
    endless=st.booleans(),
)
@example(turns=[(200, -9), (400, -9)], threshold=0, begin=0, period=1, endless=True)
def test_wbc_18_the_first_look_that_differs_is_found(
    turns: list[tuple[int, int]], threshold: int, begin: int, period: int, *, endless: bool
) -> None:
    # A function that rises or falls in intervals, and the side of a threshold it is on.
    ends, values, value, at = [], [], 0, 0
    for length, slope in turns:
        at += length
        ends.append(at)
        values += [value := value + slope for _ in range(length)]

    def height(moment: int) -> int:
        if moment < len(values):
            return values[moment]
        return (values[-1] if values else 0) + (moment - len(values) if endless else 0)

    def side(moment: int) -> float:
        return float(height(moment) > threshold)

    intervals = [end - 1 for end in ends[bisect_right(ends, begin) :]] + ([FOREVER] if endless else [])
    looks = range(begin + period, begin + period + 30_000 * period, period)
    expected = next((moment for moment in looks if side(moment) != side(begin)), None)
    found = first_change(side, begin, period, intervals, HORIZON)
    assert found == expected or (expected is None and endless and found is not None and found > HORIZON)


def test_beyond_the_horizon_the_look_is_taken() -> None:
    assert first_change(lambda moment: 0.0, 5, 10, [FOREVER], 1000) == 1005
    assert first_change(lambda moment: 0.0, 5, 10, [20], 1000) is None
    assert first_change(lambda moment: 0.0, 5, 2000, [], 1000) == 2005
    assert first_change(lambda moment: 0.0, 0, 1000, [FOREVER], 1000) == 2000  # the horizon itself is looked at
    assert first_change(lambda moment: 0.0, 0, 1000, [], 1000) is None
