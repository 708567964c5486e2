"""The fixtures of conftest.py: a missing peer skips a test on a desk and fails it in CI."""

from __future__ import annotations

from pathlib import Path

import pytest

ASKS = """
    def test_program(require_peer): require_peer("no-such-program")
    def test_library(require_library): require_library("no-such-library")
    def test_present(require_peer): assert require_peer("sh").endswith("/sh")
    def test_without(): pass
"""


@pytest.fixture
def asking(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeconftest((Path(__file__).parent / "conftest.py").read_text())
    pytester.makeini("[pytest]\nmarkers = peers\naddopts = --strict-markers -ra\nasyncio_default_fixture_loop_scope = function")
    pytester.makepyfile(ASKS)
    return pytester


def test_missing_peers_skip_and_say_what_to_do(asking: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STEPTWIN_REQUIRE_PEERS", raising=False)
    outcome = asking.runpytest()
    outcome.assert_outcomes(passed=2, skipped=2)
    outcome.stdout.fnmatch_lines(["SKIPPED*no-such-program is not installed; 'make peers' installs it"])


def test_missing_peers_fail_where_they_are_required(asking: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STEPTWIN_REQUIRE_PEERS", "1")
    asking.runpytest().assert_outcomes(passed=2, failed=2)


def test_the_marker_follows_the_fixtures(asking: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STEPTWIN_REQUIRE_PEERS", raising=False)
    asking.runpytest("-m", "not peers").assert_outcomes(passed=1, deselected=3)
