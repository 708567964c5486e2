"""``python -m steptwin``, where the command is not in PATH."""

from __future__ import annotations

import subprocess
import sys

from steptwin import __version__


def steptwin(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "steptwin", *arguments], capture_output=True, text=True, check=False)


def test_the_package_runs_as_the_command() -> None:
    assert steptwin("--version").stdout == f"{__version__}\n"


def test_usage_and_errors_are_those_of_the_command() -> None:
    assert "Usage: python -m steptwin [OPTIONS] COMMAND" in steptwin("--help").stdout
    wrong = steptwin("serve", "mic488", "--firmware", "9")
    assert (wrong.returncode, "firmware '9'" in wrong.stderr, "Traceback" in wrong.stderr) == (2, True, False), wrong.stderr
