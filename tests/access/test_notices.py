"""Notices about clients, limited for each host."""

from __future__ import annotations

from steptwin.access.notices import AT_ONCE, MOST_HOSTS, ClientNotices
from steptwin.controller import SECOND


def test_a_client_that_goes_on_for_ever_gives_a_line_in_a_minute() -> None:
    told: list[str] = []
    now = 0
    notices = ClientNotices(told.append, lambda: now)
    for n in range(6000):  # ten minutes
        now = n * SECOND // 10
        notices.say("192.0.2.7", f"client 192.0.2.7:{n}: nonsense")
    assert told[:AT_ONCE] == [f"client 192.0.2.7:{n}: nonsense" for n in range(AT_ONCE)]
    assert told[AT_ONCE] == "client 192.0.2.7:600: nonsense (595 more like this were left out)"
    assert len(told) == AT_ONCE + 9
    notices.say("192.0.2.8", "another one")
    assert told[-1] == "another one"


def test_nothing_grows_with_the_number_of_hosts() -> None:
    told: list[str] = []
    notices = ClientNotices(told.append, lambda: 0)
    for n in range(3 * MOST_HOSTS):
        for _ in range(AT_ONCE + 1):
            notices.say(f"host {n}", "nonsense")
    assert len(notices._left_out) <= MOST_HOSTS + 1
    assert len(told) == 3 * MOST_HOSTS * AT_ONCE
