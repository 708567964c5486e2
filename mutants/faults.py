"""``python -m mutants faults [NUMBER …]``: put recorded faults (``faults.toml``) into copies of the tree; do tests still notice?

A fault is found by the qualified name of its function, and a test by its name, wherever their modules are now. A fault is noticed
when one of its tests fails that is no digest; digests are tried last. What is tried has to pass without any fault.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import signal
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mutants.mutations import compiles
from mutants.trial import Tree
from mutants.workers import Workers

ROOT = Path(__file__).parent.parent
FAULTS = Path(__file__).parent / "faults.toml"
KINDS = ("plain", "property", "golden", "digest")
"""How a test knows what is right, in the order in which they are tried: it says so itself; by a rule, for values by chance; by a
file that a person can review; by a digest or by whole sessions that come by chance."""
LIMIT_S = 300.0


class Lost(Exception):
    """The function or a test of a fault is not there, or there more than once."""


@dataclass(frozen=True)
class Fault:
    number: int
    wrong: str
    """What a user sees."""
    module: str
    """Below ``src/steptwin``, where the function was first."""
    function: str
    """Qualified name, without ``<locals>``."""
    old: str
    """What is once in the function, up to white space; ``new`` takes its place."""
    new: str
    noticed: Mapping[str, Sequence[str]]
    """By kind, tests that noticed it first, each ``tests/simulation/mechanics/test_belt.py::test_it``."""

    def put_into(self, root: Path) -> tuple[Path, str]:
        """The module with the function and its source with the fault. Raises `Lost`."""
        found = []
        for path in sorted((root / "src/steptwin").rglob("*.py")):
            source = path.read_text()
            if self.function.rpartition(".")[2] in source:
                found += [(path.relative_to(root), text) for text in self._changed(source)]
        here = [one for one in found if one[0] == Path("src/steptwin", self.module)]
        found = here or found
        if len(found) != 1:
            raise Lost(f"{self.function} with {self.old!r} is there {len(found)} times")
        return found[0]

    def _changed(self, source: str) -> Iterator[str]:
        pattern = re.compile(r"\s+".join(map(re.escape, self.old.split())))
        lines = source.splitlines(keepends=True)
        for name, node in _functions(ast.parse(source)):
            first, last = node.lineno - 1, node.end_lineno
            changed, number = pattern.subn(lambda _: self.new, "".join(lines[first:last]))
            if name == self.function and number == 1:
                text = "".join((*lines[:first], changed, *lines[last:]))
                if not compiles(text):
                    raise Lost(f"{self.function}: {self.new!r} does not fit there")
                yield text


def _functions(node: ast.AST, above: str = "") -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    for child in ast.iter_child_nodes(node):
        name = above
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = f"{above}.{child.name}" if above else child.name
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            yield name, child
        yield from _functions(child, name)


def read(file: Path = FAULTS) -> list[Fault]:
    return [Fault(**row) for row in tomllib.loads(file.read_text())["fault"]]


def find_test(root: Path, test: str) -> str:
    """The node id of a test today: in its file, in one of that name, or in another. Raises `Lost`."""
    file, _, name = test.partition("::")
    paths = [path for path in (root / "tests").rglob("test_*.py") if re.search(rf"def {name}\(", path.read_text())]
    for among in ([root / file], [path for path in paths if path.name == Path(file).name], paths):
        found = [path for path in among if path in paths]
        if len(found) == 1:
            return f"{found[0].relative_to(root)}::{name}"
    raise Lost(f"{test} is there {len(paths)} times")


def notice(fault: Fault, tree: Tree) -> tuple[Fault, str, str]:
    """A kind of `KINDS` with the first test that notices; ``nothing``; or ``lost`` with the reason."""
    try:
        module, changed = fault.put_into(tree.path)
        tests = [(kind, find_test(tree.path, test)) for kind in KINDS for test in fault.noticed.get(kind, ())]
    except Lost as lost:
        return fault, "lost", str(lost)
    with tree.changed(module, changed):
        for kind, test in tests:
            if tree.fails([test], LIMIT_S):
                return fault, kind, test
    return fault, "nothing", ""


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m mutants faults", description="Whether the tests notice recorded faults.")
    parser.add_argument("-j", type=int, default=os.cpu_count() or 1, metavar="JOBS", help="how many at the same time")
    parser.add_argument("numbers", nargs="*", type=int, metavar="NUMBER", help="which faults (default: all)")
    options = parser.parse_args(arguments)
    faults = [fault for fault in read() if not options.numbers or fault.number in options.numbers]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the tests that run are ended, too
    os.nice(5)
    counts: Counter[str] = Counter()
    noticing = set()
    with tempfile.TemporaryDirectory(prefix="faults-") as directory:
        trees = [Tree(ROOT, Path(directory, str(number))) for number in range(max(1, options.j))]
        workers = Workers(trees)
        try:
            for fault, kind, what in workers.each([partial(notice, fault) for fault in faults]):
                counts[kind] += 1
                noticing |= {what} if kind in KINDS else set()
                print(f"{fault.number} {kind} {what}: {fault.wrong}", flush=True)
            print(", ".join(f"{number} {kind}" for kind, number in counts.most_common()))
            if noticing and trees[0].fails(sorted(noticing), LIMIT_S + 10 * len(noticing)):
                sys.exit("faults: one of these tests fails without any fault")
        finally:
            workers.end()
    if counts["digest"] + counts["nothing"] + counts["lost"]:
        sys.exit(1)
