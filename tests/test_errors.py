from __future__ import annotations

from steptwin.errors import LineFailure, Misuse, Refusal, Runaway, SteptwinError, TimeReversal


def test_families_are_kin_of_the_builtin_ones_and_of_each_other_they_are_not() -> None:
    assert issubclass(Misuse, ValueError)
    assert issubclass(LineFailure, OSError)
    assert issubclass(Runaway, RuntimeError)
    families = (Misuse, Refusal, LineFailure, Runaway)
    assert all(issubclass(family, SteptwinError) for family in families)
    assert not any(issubclass(a, b) for a in families for b in families if a is not b)


def test_time_reversal_names_both_moments() -> None:
    error = TimeReversal(now=2_000, asked=1_999)
    assert isinstance(error, Misuse)
    assert str(error) == "time cannot go back: the machine is at 2000 ns, asked for 1999 ns"
