"""Coverage of programs to files, in the format of the ending of each, and as a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from steptwin.coverage.counts import Coverage
from steptwin.coverage.jsontext import json_text
from steptwin.coverage.lcov import lcov
from steptwin.coverage.page import page
from steptwin.coverage.table import table
from steptwin.coverage.watch import WorldCoverage
from steptwin.errors import Misuse
from steptwin.files.textfiles import check_writable, write_bytes
from steptwin.simulation.world.simulation import Simulation

STANDARD_OUTPUT = "-"
"""The target of the table."""
FORMATS: Mapping[str, Callable[[Coverage], str]] = {".info": lcov, ".html": page, ".json": json_text}


class CoverageReports:
    """The coverage of worlds, and where it is to be reported. Raises `Misuse` for a target that cannot be written."""

    def __init__(self, targets: Sequence[str]) -> None:
        self.coverage = Coverage()
        self._targets = tuple(targets)
        self._here = Path.cwd().resolve() if targets else Path()
        self._watches: list[WorldCoverage] = []
        for target in self._targets:
            _check(target)

    def observe(self, world: Simulation, folder: Path) -> None:
        """Count from now on what a world executes, if that is to be reported. Its description lies in ``folder``."""
        if self._targets:
            self._watches.append(WorldCoverage(world, self.coverage, lambda name: _format_path(folder / name, self._here, name)))

    def add(self, coverage: Coverage, folder: Path) -> None:
        """Report also what was counted elsewhere, of a description that lies in ``folder``."""
        for text in coverage:
            self.coverage.add(replace(text, path=_format_path(folder / text.path, self._here, text.path)))

    def close(self) -> None:
        """End all observation."""
        for watch in self._watches:
            watch.close()
        self._watches.clear()

    def write(self, out: Callable[[str], object]) -> list[Path]:
        """Write the reports after `close`; ``out`` gets the table. Returns the files. Raises `Misuse`."""
        self.close()
        written: list[Path] = []
        for target in self._targets:
            if target == STANDARD_OUTPUT:
                out(table(self.coverage))
            else:
                path = Path(target)
                write_bytes(path, FORMATS[path.suffix.lower()](self.coverage).encode())
                written.append(path)
        return written


def _check(target: str) -> None:
    if target == STANDARD_OUTPUT:
        return
    path = Path(target)
    if path.suffix.lower() not in FORMATS:
        raise Misuse(f"coverage in {target}: the name must end with {', '.join(FORMATS)}; {STANDARD_OUTPUT} prints a table")
    check_writable(path)


def _format_path(path: Path, here: Path, name: str) -> str:
    """The path of a text: from ``here`` where it is below, else from the root; its name where it is no file."""
    with suppress(OSError, ValueError):
        if path.is_file():
            whole = path.resolve()
            found = whole.relative_to(here) if whole.is_relative_to(here) else whole
            return found.as_posix()
    return name
