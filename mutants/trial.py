"""Whether the tests notice a mutation: a copy of the project, mutated in one place, and pytest in it."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

RECORD = "MUTANTS_RECORD"
"""The environment variable that names the file of `mutants.record`: ``{"seconds": {test: s}, "lines": {module: {line:
[test]}}}``; tests of lines are numbers in the order of ``seconds``, and -1 is what ran before the first test."""
CHOICE = "MUTANTS_CHOICE"
"""The environment variable that names the file for `mutants.choice`: node ids in order, each with the seconds it may take."""
PYTEST = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider")
MEMORY_BYTES = 4 * 2**30
START_S = 20.0
"""For interpreter and collection, or for a short test, on a busy machine."""
SLOWER = 5.0
"""What takes this many times as long as without a mutation is ended and counts as failed."""
RECORD_S = 1800.0


class Tree:
    """A copy of the working tree, without what git ignores."""

    def __init__(self, root: Path, directory: Path) -> None:
        self.path = directory / "tree"
        self._run = directory / "run"
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = False
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for name in filter(None, listed.split("\0")):
            if (root / name).is_file():
                (self.path / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(root / name, self.path / name)
        self._run.mkdir(mode=0o700)
        # Compiled files are recognized by the second in which the source was changed: each change gets a second of its own.
        self._changed_s = int(time.time()) - 10_000_000

    @contextmanager
    def changed(self, module: Path, source: str) -> Generator[None]:
        path = self.path / module
        kept = path.read_text()
        self._write(path, source)
        try:
            yield
        finally:
            self._write(path, kept)

    def _write(self, path: Path, source: str) -> None:
        path.write_text(source)
        self._changed_s += 1
        os.utime(path, (self._changed_s, self._changed_s))

    def passes(self, seconds: dict[str, float]) -> bool:
        """Run these tests in this order up to the first failure; they take so many seconds without a mutation."""
        choice = self._run / "choice.json"
        choice.write_text(json.dumps({test: START_S + SLOWER * taken for test, taken in seconds.items()}))
        files = {test.partition("::")[0]: None for test in seconds}
        return self._pytest(["-p", "mutants.choice", *files], {CHOICE: str(choice)}, START_S + SLOWER * sum(seconds.values()))

    def record(self, folder: str, file: Path) -> bool:
        """Write what the tests of a folder execute, as described in `mutants.record`; False if one of them fails."""
        return self._pytest(["-p", "mutants.record", "-o", f"timeout={RECORD_S}", folder], {RECORD: str(file)}, RECORD_S)

    def end(self) -> None:
        """End the tests that run, and let no others begin."""
        self._ended = True
        self._kill()

    def _pytest(self, arguments: list[str], environment: dict[str, str], limit_s: float) -> bool:
        if self._ended:
            return False
        temporary = self._run / "tmp"
        self._process = subprocess.Popen(
            [*PYTEST, f"--basetemp={temporary}", *arguments],
            cwd=self.path,
            env={
                **os.environ,
                "PYTHONPATH": str(self.path / "src"),
                "HYPOTHESIS_PROFILE": "unshrunk",
                "XDG_RUNTIME_DIR": str(self._run),
                **environment,
            },
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_limit_memory,  # noqa: PLW1509
        )
        try:
            return self._process.wait(limit_s) in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
        except subprocess.TimeoutExpired:
            return False
        finally:
            self._kill()
            shutil.rmtree(temporary, ignore_errors=True)

    def _kill(self) -> None:
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def _limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
