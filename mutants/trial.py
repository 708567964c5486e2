"""Whether the tests notice a mutation: a copy of the project, mutated in one place, and pytest in it."""

from __future__ import annotations

import contextlib
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

CORE = ("motion", "wire", "mic488", "m1486", "wbc", "world", "drivers")
"""Packages that are mutated; tests/<package> mirrors each of them."""

PYTEST = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider")
MEMORY_BYTES = 4 * 2**30
START_S = 20.0
"""For interpreter and collection, on a busy machine."""
SLOWER = 4.0
"""A stage that takes this many times as long as without a mutation is ended and counts as failed."""


class Tree:
    """A copy of the files under version control, with the changes that are in the working tree."""

    def __init__(self, root: Path, directory: Path) -> None:
        self.path = directory / "tree"
        self._run = directory / "run"
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split("\0")):
            if (root / name).is_file():
                (self.path / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(root / name, self.path / name)
        self._run.mkdir(mode=0o700)
        # Compiled files are recognized by the second in which the source was changed: each change gets a second of its own.
        self._changed_s = int(time.time()) - 10_000_000

    def modules(self, packages: list[str]) -> list[Path]:
        """Paths of the modules in these packages, relative to the tree."""
        return [
            path.relative_to(self.path) for name in packages for path in sorted((self.path / "src/steptwin" / name).rglob("*.py"))
        ]

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

    def stages(self, module: Path) -> list[tuple[str, list[str]]]:
        """Names and arguments of pytest: the file that mirrors the module, the rest of its folder, the rest of the core."""
        package, *inner = module.relative_to("src/steptwin").parts
        mirrored = Path("tests", package, *inner[:-1], f"test_{inner[-1]}")
        stages = []
        folder = [f"tests/{package}"]
        if (self.path / mirrored).exists():
            stages.append(("file", [str(mirrored)]))
            folder.append(f"--ignore={mirrored}")
        rest = [f"tests/{name}" for name in CORE if name != package]
        return [*stages, ("folder", folder), ("core", rest)]

    def passes(self, arguments: list[str], limit_s: float) -> bool | None:
        """Run pytest up to the first failure; None if it had to be ended."""
        temporary = self._run / "tmp"
        environment = {
            **os.environ,
            "PYTHONPATH": str(self.path / "src"),
            "HYPOTHESIS_PROFILE": "unshrunk",
            "XDG_RUNTIME_DIR": str(self._run),
        }
        process = subprocess.Popen(
            [*PYTEST, f"--basetemp={temporary}", *arguments],
            cwd=self.path,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_limit_memory,  # noqa: PLW1509
        )
        try:
            return process.wait(limit_s) == 0
        except subprocess.TimeoutExpired:
            return None
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            shutil.rmtree(temporary, ignore_errors=True)

    def durations(self, packages: list[str]) -> dict[str, float]:
        """Seconds that the tests of each package take without a mutation; ends the program if one of them fails."""
        seconds = {}
        for name in packages:
            begin = time.monotonic()
            if self.passes([f"tests/{name}"], 1800.0) is not True:
                sys.exit(f"mutants: tests/{name} fails without any mutation")
            seconds[name] = time.monotonic() - begin
        return seconds


def limit_s(arguments: list[str], durations: dict[str, float]) -> float:
    """What a stage may take, from the durations of the packages it tests."""
    tested = {Path(argument).parts[1] for argument in arguments if not argument.startswith("-")}
    return START_S + SLOWER * sum(durations[name] for name in tested)


def _limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
