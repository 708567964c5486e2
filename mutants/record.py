"""A plugin of pytest that records which test executes which line of the core, and how long each test takes."""

from __future__ import annotations

import json
import os
from collections.abc import Generator
from pathlib import Path

import coverage
import pytest

from mutants.trial import RECORD

_measured = coverage.Coverage(data_file=None, config_file=False, source_pkgs=["steptwin"])
_measured.start()
_seconds: dict[str, float] = {}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    _measured.switch_context(item.nodeid)
    return (yield)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    _seconds[report.nodeid] = _seconds.get(report.nodeid, 0.0) + report.duration


def pytest_unconfigure(config: pytest.Config) -> None:
    _measured.stop()
    numbers = {"": -1} | {test: number for number, test in enumerate(_seconds)}
    data = _measured.get_data()
    lines = {
        str(Path(module).relative_to(config.rootpath)): {
            line: [numbers[test] for test in tests] for line, tests in data.contexts_by_lineno(module).items() if tests
        }
        for module in data.measured_files()
    }
    Path(os.environ[RECORD]).write_text(json.dumps({"seconds": _seconds, "lines": lines}))
