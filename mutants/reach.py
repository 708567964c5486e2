"""Which tests can notice a mutation: those that execute its lines, recorded once per state of sources and tests."""

from __future__ import annotations

import ast
import hashlib
import json
from collections import defaultdict
from functools import cache
from pathlib import Path

CORE = ("motion", "wire", "mic488", "m1486", "wbc", "simulation", "drivers")
"""Packages that are mutated; tests/<package> mirrors each of them."""
USERS = (
    "calc",
    "campaign",
    "coverage",
    "debug",
    "explain",
    "files",
    "gateways",
    "history",
    "languages",
    "lsp",
    "subject",
    "testing",
    "why",
)
"""Packages above them whose tests run in one process."""
WHOLE = ("test_branches.py", "test_state.py")
"""Tests of all state of a world with everything in it."""
FOLDERS = tuple(f"tests/{name}" for name in (*CORE, *USERS, *WHOLE))
"""Folders of tests, and single files."""

FEW = 3
"""What no more tests than these execute may be kept by a cache or a fixture, and be used by others."""
OTHERS_S = 60.0
"""For the tests outside of the mirrored folder; the slower ones that would exceed it are left out."""


class Reach:
    """What each test executes, and how long it takes, from one record per folder."""

    def __init__(self, root: Path, records: dict[str, Path]) -> None:
        self.folders = list(records)
        self._root = root
        self._imported = {folder: imported_files(root, folder) for folder in records}
        self._seconds: dict[str, float] = {}
        self._tests: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        for file in records.values():
            record = json.loads(file.read_text())
            names = [*record["seconds"], ""]
            self._seconds |= record["seconds"]
            for module, lines in record["lines"].items():
                for line, numbers in lines.items():
                    self._tests[module][int(line)].update(names[number] for number in numbers)

    def stages(self, module: Path, first: int, last: int) -> list[tuple[str, dict[str, float]]]:
        """The tests that can notice a change of these lines, with their seconds: of the mirrored folder, and others.

        The fastest first. Empty if no test executes the lines. What runs on import can be noticed by all tests that import it.
        """
        tests, imported = self._executing(module, range(first, last + 1))
        home = f"tests/{module.parts[2]}"
        folders = {home} if 0 < len(tests) <= FEW else set()
        if imported:
            folders = {folder for folder, files in self._imported.items() if self._root / module in files}
        tests |= {test for test in self._seconds if _folder(test) in folders}
        ordered = sorted(tests, key=lambda test: self._seconds[test])
        inside = {test: self._seconds[test] for test in ordered if _folder(test) == home}
        outside = {}
        total = 0.0
        for test in ordered:
            total += self._seconds[test] if test not in inside else 0.0
            if test not in inside and total <= OTHERS_S:
                outside[test] = self._seconds[test]
        return [stage for stage in (("folder", inside), ("others", outside)) if stage[1]]

    def on_import(self, module: Path, first: int, last: int) -> bool:
        """Whether one of these lines is executed on import."""
        return self._executing(module, range(first, last + 1))[1]

    def _executing(self, module: Path, lines: range) -> tuple[set[str], bool]:
        """The tests that execute one of the lines; whether they are executed on import."""
        known = self._tests[str(module)]
        body = ast.parse((self._root / module).read_text())
        around = [
            node for node in ast.walk(body) if isinstance(node, ast.stmt) and node.lineno <= lines[0] <= (node.end_lineno or 0)
        ]
        statement = max(around, key=lambda node: node.lineno)
        # A line without an event of its own, such as one with a closing bracket, is executed with its statement.
        tests = set().union(*(known[line] for line in lines)) or known[statement.lineno]
        functions = [node for node in around if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        inside = any(node.body[0].lineno <= lines[0] for node in functions)
        return tests - {""}, not inside or "" in tests


def folders(root: Path, packages: list[str]) -> list[str]:
    """Those whose tests import one of these packages."""
    places = [root / "src/steptwin" / name for name in packages]
    return [
        folder
        for folder in FOLDERS
        if any(path.is_relative_to(place) for path in imported_files(root, folder) for place in places)
    ]


def digest(root: Path, folder: str) -> str:
    """Of what the tests of a folder execute."""
    found = hashlib.sha256()
    for path in sorted({*imported_files(root, folder), root / "tests/conftest.py"}):
        found.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    return found.hexdigest()[:16]


@cache
def imported_files(root: Path, folder: str) -> set[Path]:
    """The test files of a folder and all modules of the project that they import, at once or later."""
    place = root / folder
    waiting = [place] if place.is_file() else list(place.rglob("*.py"))
    found = set(waiting)
    while waiting:
        new = _imports(root, waiting.pop()) - found
        found |= new
        waiting += new
    return found


@cache
def _imports(root: Path, path: Path) -> set[Path]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.ImportFrom(module=str(module)):
                names |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
            case ast.Import():
                names |= {alias.name for alias in node.names}
    places = [name.replace(".", "/") for name in names]
    candidates = [
        root / path for place in places for path in (f"src/{place}.py", f"src/{place}/__init__.py", f"tests/support/{place}.py")
    ]
    return {candidate for candidate in candidates if candidate.is_file()}


def _folder(test: str) -> str:
    return "/".join(test.partition("::")[0].split("/")[:2])
