"""Values as users type them."""

from __future__ import annotations

import pytest

from steptwin.drivers.typed import changes_of, number_of, tied
from steptwin.errors import Misuse


def test_numbers_are_tied_to_axes() -> None:
    assert tied(["1=12,5", "m2=-3", "3=1e1"], 4) == {1: 12.5, 2: -3.0, 3: 10.0}


@pytest.mark.parametrize(
    ("texts", "axes", "message"),
    [
        (["1"], 4, "'1': expected AXIS=NUMBER, such as 1=12.5 or M1=12.5"),
        (["5=1"], 4, "'5' is not an axis: permitted are 1 to 4, or M1 to M4"),
        (["2=1"], 1, "'2' is not an axis: permitted are 1, or M1"),
        (["1=1", "M1=2"], 4, "'M1=2': M1 is given twice"),
        (["1=much"], 4, "'1=much': 'much' is not a number"),
    ],
)
def test_what_is_no_number_of_an_axis_is_refused(texts: list[str], axes: int, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        tied(texts, axes)
    assert str(refused.value) == message


def test_a_decimal_comma_is_a_point() -> None:
    assert number_of(" -1,5", "x=-1,5") == -1.5


def test_a_change_has_a_name_and_a_value() -> None:
    assert changes_of(["M1_ACC = 50"], "A=1") == [("M1_ACC", "50", "M1_ACC = 50")]
    with pytest.raises(Misuse, match="'M1_ACC': expected NAME=VALUE, such as A=1"):
        changes_of(["M1_ACC"], "A=1")
