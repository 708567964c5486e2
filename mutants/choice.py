"""A plugin of pytest that runs chosen tests in a chosen order; as arguments, thousands of them would be slow to collect."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from mutants.trial import CHOICE


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    limits = json.loads(Path(os.environ[CHOICE]).read_text())
    order = {test: number for number, test in enumerate(limits)}
    items[:] = sorted((item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid])
    for item in items:
        item.add_marker(pytest.mark.timeout(limits[item.nodeid]), append=False)
