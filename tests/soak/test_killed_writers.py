"""Commands that are killed while they write lose no file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import killed_writers
import pytest
from soak import scaled

KILLS = 500


@pytest.mark.parametrize("seed", [29])
def test_no_kill_loses_a_file(tmp_path: Path, seed: int) -> None:
    kills = scaled(KILLS)
    child = [sys.executable, killed_writers.__file__, str(tmp_path), str(seed), str(kills)]
    done = subprocess.run(child, check=True, capture_output=True, text=True, env={**os.environ, "COLUMNS": "200"})
    counts = json.loads(done.stdout)
    print(f"{kills} kills, seed {seed}: {counts}")
    assert sum(sum(one.values()) for one in counts.values()) == kills
    assert {name: one["lost"] for name, one in counts.items() if "lost" in one} == {}
