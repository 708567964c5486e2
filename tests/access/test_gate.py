"""Tokens, origins, rates and the audit log."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.access.audit import MOST_ENTRIES, Audit, Entry
from steptwin.access.control import Viewer
from steptwin.access.origin import Origins
from steptwin.access.rate import RateLimit, RateLimits
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate, Token, read_tokens
from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.jsonvalues import to_json

ENGINEER = Token(Role.ENGINEER, "anna", "e" * 16)
VIEWER = Token(Role.VIEWER, "hall", "ż" * 16)


def test_who_has_a_token_has_its_role() -> None:
    gate = AccessGate([ENGINEER, VIEWER])
    assert gate.asks
    assert gate.enter("e" * 16) == (Role.ENGINEER, "anna")
    assert gate.enter("ż" * 16) == (Role.VIEWER, "hall")
    for wrong in ("", "e" * 15, "e" * 17, "E" * 16, "\ud800", None):
        with pytest.raises(Refusal, match="token"):
            gate.enter(wrong)


def test_without_tokens_everybody_has_one_role() -> None:
    gate = AccessGate(open_to=Role.ENGINEER)
    assert not gate.asks
    assert gate.enter(None) == (Role.ENGINEER, None)
    assert gate.enter("whatever") == (Role.ENGINEER, None)


def test_a_file_of_tokens() -> None:
    text = f"# hall 3\nengineer anna {'e' * 16}  # her laptop\n\nviewer hall {'ż' * 16}\n"
    assert read_tokens(text, "tokens") == (ENGINEER, VIEWER)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "tokens: no tokens"),
        ("viewer x", "tokens, line 1: 2 words: expected ROLE NAME TOKEN"),
        (f"\nboss x {'e' * 16}", "tokens, line 2: no role 'boss'; roles are viewer, operator, engineer"),
        ("viewer x short", "a token of 5 characters: permitted are 16 to 200"),
        (f"viewer x {'e' * 16}\nviewer y {'e' * 16}", "line 2: this token is there already"),
    ],
)
def test_what_is_wrong_in_a_file_of_tokens_is_named(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        read_tokens(text, "tokens")


LOCAL = Origins(8488)
REMOTE = Origins(443, ["studio.example"], by_address=True, has_tls=True)
OPEN = Origins(8488, by_address=True)


@pytest.mark.parametrize(
    ("origins", "host", "origin"),
    [
        (LOCAL, "127.0.0.1:8488", None),
        (LOCAL, "localhost:8488", "http://localhost:8488"),
        (LOCAL, "LocalHost:8488", "http://LOCALHOST:8488"),
        (LOCAL, "[::1]:8488", "http://[::1]:8488"),
        (REMOTE, "studio.example", "https://studio.example"),
        (REMOTE, "192.0.2.5:443", "https://192.0.2.5:443"),
        (REMOTE, "192.0.2.5", "https://192.0.2.5"),
        (OPEN, "192.0.2.5:8488", "http://192.0.2.5:8488"),
        (OPEN, "[2001:db8::1]:8488", None),
    ],
)
def test_pages_of_the_studio_may_ask_it(origins: Origins, host: str, origin: str | None) -> None:
    origins.check(host, origin)


@pytest.mark.parametrize(
    ("origins", "host", "origin"),
    [
        (LOCAL, None, None),
        (LOCAL, "", None),
        (LOCAL, "127.0.0.1", None),
        (LOCAL, "127.0.0.1:8489", None),
        (LOCAL, "evil.example:8488", "http://evil.example:8488"),
        (LOCAL, "127.0.0.1:8488", "http://evil.example"),
        (LOCAL, "127.0.0.1:8488", "null"),
        (LOCAL, "127.0.0.1:8488", ""),
        (LOCAL, "127.0.0.1:8488", "https://127.0.0.1:8488"),
        (LOCAL, "127.0.0.1:8488", "http://localhost:8488"),
        (LOCAL, "127.0.0.1:8488", "http://127.0.0.1:8000"),
        (LOCAL, "192.0.2.5:8488", None),
        (REMOTE, "studio.example.evil.example", None),
        (OPEN, "192.0.2.5", None),
        (OPEN, "192.0.2.5:8489", None),
        (OPEN, "[2001:db8::1]", None),
        (OPEN, "192.0.2.5.evil.example:8488", None),
        (OPEN, ":8488", None),
    ],
)
def test_other_sites_may_not(origins: Origins, host: str | None, origin: str | None) -> None:
    with pytest.raises(Refusal):
        origins.check(host, origin)


@given(st.lists(st.integers(0, 3 * SECOND), min_size=1, max_size=200))
def test_no_more_requests_than_the_rate_and_the_burst_permit(gaps: list[int]) -> None:
    limit, now, allowed = RateLimit(10, 20), 0, 0
    for gap in gaps:
        now += gap
        allowed += limit.allows(now)
    assert allowed <= 20 + 10 * (sum(gaps[1:]) / SECOND) + 1e-6


def test_who_asks_seldom_is_never_refused() -> None:
    limit = RateLimit(10, 1)
    assert all(limit.allows(n * 101 * MILLISECOND) for n in range(1000))
    assert not limit.allows(999 * 101 * MILLISECOND)


def test_limits_are_kept_for_those_who_asked_last() -> None:
    limits = RateLimits(1, 1, most=2)
    assert [limits.allows(key, 0) for key in "aab"] == [True, False, True]
    assert limits.allows("c", 0)
    assert limits.allows("a", 0)  # forgotten, because b and c came after it


def test_the_audit_log_is_bounded() -> None:
    kept: list[Entry] = []
    audit = Audit(lambda: "2026-01-01T00:00:00Z", kept.append)
    anna = Viewer(1, "Anna", Role.ENGINEER)
    for n in range(MOST_ENTRIES + 5):
        audit.add(anna, n, "move", {"to": n}, "done")
    audit.add(anna, 0, "write", {"values": {f"a.R{n}": 0 for n in range(1000)}}, "misuse")
    assert len(audit.last(10**9)) == MOST_ENTRIES
    assert [entry.fields for entry in audit.last(2)] == [{"to": MOST_ENTRIES + 4}, {"values": "(12890 characters)"}]
    assert len(kept) == MOST_ENTRIES + 6
    assert to_json(kept[3]) == {
        "at": "2026-01-01T00:00:00Z", "time_ns": "3", "viewer": "Anna (viewer 1)", "role": "engineer",
        "do": "move", "fields": {"to": 3}, "outcome": "done",
    }  # fmt: skip
