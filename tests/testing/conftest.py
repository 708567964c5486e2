"""pytest on small files."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import dedent

import pytest

import steptwin.campaign.properties.evaluate
import steptwin.testing  # noqa: F401  else every run imports it anew, for pytester forgets what a run has imported


@pytest.fixture(autouse=True)
def without_asyncio_plugin(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """pytest-lsp brings pytest-asyncio, which warns in runs whose configuration does not set its loop scope."""
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p no:asyncio")


@pytest.fixture
def run(pytester: pytest.Pytester) -> Callable[..., pytest.RunResult]:
    """``run(text, *options)``: pytest on a file with that text; a warning fails its test, as here."""

    def run_(text: str, *options: str) -> pytest.RunResult:
        pytester.makepyfile(test_it=dedent(text))
        return pytester.runpytest_inprocess("-W", "error", "-p", "no:cacheprovider", "-p", "no:rerunfailures", *options)

    return run_
