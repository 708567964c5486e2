"""pytest on small files."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import dedent

import pytest

import steptwin.campaign.properties.evaluate
import steptwin.testing  # noqa: F401  else every run imports it anew, for pytester forgets what a run has imported


@pytest.fixture(autouse=True)
def with_this_plugin_alone(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """As here; `test_wheel.py` has it as pytest finds it."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p steptwin.pytest_plugin")


@pytest.fixture
def run(pytester: pytest.Pytester) -> Callable[..., pytest.RunResult]:
    """``run(text, *options)``: pytest on a file with that text; a warning fails its test, as here."""

    def run_(text: str, *options: str) -> pytest.RunResult:
        pytester.makepyfile(test_it=dedent(text))
        return pytester.runpytest_inprocess("-W", "error", "-p", "no:cacheprovider", *options)

    return run_
