"""Whether the tests notice a mutation: a copy of the project, mutated in one place, and pytest in it.

What runs on import needs a new process. For mutations inside of functions a fork of one that has collected the tests will do, see
`mutants.forks`.
"""

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
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path

import pytest

RECORD = "MUTANTS_RECORD"
"""The environment variable that names the file of `mutants.record`: ``{"seconds": {test: s}, "lines": {module: {line:
[test]}}}``; tests of lines are numbers in the order of ``seconds``, and -1 is what ran before the first test."""
CHOICE = "MUTANTS_CHOICE"
"""The environment variable that names the file for `mutants.choice`: node ids in order, each with the seconds it may take."""
REQUESTS, ANSWERS = "MUTANTS_REQUESTS", "MUTANTS_ANSWERS"
"""The environment variables with the numbers of the pipes to and from `mutants.forks`."""
PASSED, FAILED, UNFIT = 0, 1, 3
# Foreign programs take time, and a browser more memory than there is.
PYTEST = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not peers")
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
        self._forking: subprocess.Popen[bytes] | None = None
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
        choice.write_text(json.dumps(_limits(seconds)))
        files = {test.partition("::")[0]: None for test in seconds}
        arguments = ["-p", "mutants.choice", *files]
        return self._passed(self._pytest(arguments, {CHOICE: str(choice)}), _limit(seconds))

    def fails(self, tests: Iterable[str], limit_s: float) -> bool:
        """Whether one of these tests fails, by node id, or they take longer."""
        return not self._passed(self._pytest(list(tests), {}), limit_s)

    def fork(self, folders: Iterable[str]) -> None:
        """Collect the tests of these folders once, for `passes_forked`."""
        requests, answers = os.pipe(), os.pipe()
        numbers = {REQUESTS: str(requests[0]), ANSWERS: str(answers[1])}
        arguments = ["-p", "mutants.forks", *folders]
        self._forking = self._pytest(arguments, numbers, (requests[0], answers[1]))
        for number in (requests[0], answers[1]):
            os.close(number)
        self._requests, self._answers = os.fdopen(requests[1], "w"), os.fdopen(answers[0])
        self._answer()

    def passes_forked(self, module: Path, before: str, after: str, seconds: dict[str, float]) -> bool | None:
        """The same without a new process; None if this mutation needs one."""
        if self._ended:
            return False
        ask = {"path": str(self.path / module), "before": before, "after": after, "limits": _limits(seconds)}
        self._requests.write(json.dumps({**ask, "limit_s": _limit(seconds)}) + "\n")
        self._requests.flush()
        return {PASSED: True, UNFIT: None}.get(self._answer(), False)

    def _answer(self) -> int:
        line = self._answers.readline()
        if not line and not self._ended:
            raise RuntimeError("the process with the collected tests has ended")
        return int(line or FAILED)

    def record(self, folder: str, file: Path) -> bool:
        """Write what the tests of a folder execute, as described in `mutants.record`; False if one of them fails."""
        arguments = ["-p", "mutants.record", "-o", f"timeout={RECORD_S}", folder]
        return self._passed(self._pytest(arguments, {RECORD: str(file)}), RECORD_S)

    def end(self) -> None:
        """End the tests that run, and let no others begin."""
        self._ended = True
        if self._forking is not None:
            self._forking.terminate()
            self._forking.wait()
            self._requests.close()
            self._answers.close()
        self._kill()

    def _passed(self, process: subprocess.Popen[bytes], limit_s: float) -> bool:
        self._process = process
        try:
            return not self._ended and process.wait(limit_s) in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
        except subprocess.TimeoutExpired:
            return False
        finally:
            self._kill()
            shutil.rmtree(self._run / "tmp", ignore_errors=True)

    def _pytest(self, arguments: list[str], environment: dict[str, str], pipes: tuple[int, ...] = ()) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [*PYTEST, f"--basetemp={self._run / 'tmp'}", *arguments],
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
            pass_fds=pipes,
            preexec_fn=_limit_memory,  # noqa: PLW1509
        )

    def _kill(self) -> None:
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def _limits(seconds: dict[str, float]) -> dict[str, float]:
    return {test: START_S + SLOWER * taken for test, taken in seconds.items()}


def _limit(seconds: dict[str, float]) -> float:
    return START_S + SLOWER * sum(seconds.values())


def _limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
