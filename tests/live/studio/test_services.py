"""What a studio shows beside its world, where only the libraries of the studio are installed."""

from __future__ import annotations

import sys

import pytest

from steptwin.later import start
from steptwin.live.studio.services import LiveServices


def test_without_a_history_its_libraries_are_not_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("steptwin.history")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "sqlalchemy", None)
    asked = start(LiveServices([]).history())
    assert asked.is_done
    assert asked.result() is None
