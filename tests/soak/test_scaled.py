"""The length of soak tests follows STEPTWIN_SOAK. Soak tests themselves are the other files of this folder."""

from __future__ import annotations

import pytest
from soak import scaled, time_limit


@pytest.mark.parametrize(("factor", "full", "expected"), [("1", 500, 500), ("0.01", 500, 5), ("0.01", 3, 1), ("2", 500, 1000)])
def test_a_number_of_iterations_is_multiplied_and_never_zero(
    monkeypatch: pytest.MonkeyPatch, factor: str, full: int, expected: int
) -> None:
    monkeypatch.setenv("STEPTWIN_SOAK", factor)
    assert scaled(full) == expected


def test_an_ordinary_run_does_a_hundredth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STEPTWIN_SOAK", raising=False)
    assert scaled(10_000) == 100
    assert time_limit() == 120


@pytest.mark.parametrize("wrong", ["", "0", "-1", "nan", "much", "1001"])
def test_another_factor_is_an_error_that_names_it(monkeypatch: pytest.MonkeyPatch, wrong: str) -> None:
    monkeypatch.setenv("STEPTWIN_SOAK", wrong)
    with pytest.raises(ValueError, match=f"STEPTWIN_SOAK='{wrong}': a number above 0 and up to 1000"):
        scaled(10)


def test_files_of_this_folder_are_marked_and_have_their_own_limit(request: pytest.FixtureRequest) -> None:
    assert request.node.get_closest_marker("soak") is not None
    limit = request.node.get_closest_marker("timeout")
    assert limit is not None
    assert limit.args == (time_limit(),)
