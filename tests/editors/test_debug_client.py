"""`steptwin dap` with an independent client: @vscode/debugadapter-testsupport."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from debug_rig import running_twin
from tests.conftest import STEPTWIN


@pytest.mark.peers
def test_programs_and_twins_are_debugged(run_node: Callable[..., str], tmp_path: Path) -> None:
    with running_twin(tmp_path):
        done = run_node("tests/dap.test.mjs", "", "--test", STEPTWIN=STEPTWIN, FOLDER=str(tmp_path))
    assert re.search(r"^\S+ fail 0$", done, re.MULTILINE), done
