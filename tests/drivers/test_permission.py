"""How long something may still be sent."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from steptwin.drivers.permission import Permission, never


class Clock:
    def __init__(self) -> None:
        self.now = 1000

    def __call__(self) -> int:
        return self.now


@given(
    patience=st.integers(0, 50),
    steps=st.lists(st.tuples(st.integers(0, 60), st.booleans()), max_size=12),
)
def test_it_ends_with_its_patience_and_is_never_revived(patience: int, steps: list[tuple[int, bool]]) -> None:
    """Against a list of moments: the last at which something may be sent, and whether one was missed."""
    clock = Clock()
    permission = Permission(clock, patience)
    assert permission.patience_ns == patience
    assert permission.is_stopped is never
    assert never() is False
    until, is_over = 1000 + patience, False
    for passed, extension in steps:
        clock.now += passed
        is_over |= clock.now > until
        if extension:
            permission.extend()
            until = clock.now + patience
        is_late = is_over or clock.now > until
        assert permission.has_expired() is is_late
        is_over = is_late


def test_it_lasts_to_its_last_nanosecond() -> None:
    clock = Clock()
    permission = Permission(clock, 10)
    clock.now = 1010
    assert not permission.has_expired()
    permission.extend()
    clock.now = 1020
    assert not permission.has_expired()
    clock.now = 1021
    assert permission.has_expired()


def test_an_expired_permission_stays_expired_though_the_clock_should_go_back() -> None:
    clock = Clock()
    permission = Permission(clock, 10)
    clock.now = 1011
    assert permission.has_expired()
    clock.now = 1000
    assert permission.has_expired()
    permission.extend()
    assert permission.has_expired()
