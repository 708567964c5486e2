"""The command line for tests of its commands."""

from __future__ import annotations

import pytest
from shell import Shell


@pytest.fixture
def shell(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shell:
    """Runs commands in this process. ``STEPTWIN_DEVICE`` names no device."""
    monkeypatch.delenv("STEPTWIN_DEVICE", raising=False)
    return Shell(monkeypatch, capsys)
