"""``make mutants``: small mistakes put into the core, one at a time; do the tests notice?

A random sample. For each mutation the tests run that execute its lines, the fastest first, until one fails: those of the mirrored
folder, then others. Results are written after each mutation to ``build/mutants/results.md``.

``make mutants ARGS="faults 3 7"`` tries recorded faults again: see `mutants.faults`.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

from mutants import faults
from mutants.mutations import Mutation, compiles, mutations
from mutants.reach import CORE, Reach, digest, folders
from mutants.trial import Tree
from mutants.workers import Workers

ROOT = Path(__file__).parent.parent
BUILD = ROOT / "build/mutants"
RESULTS = BUILD / "results.md"
COLUMNS = ("folder", "others", "survived")


@dataclass(frozen=True)
class Mutant:
    module: Path
    mutation: Mutation
    source: str

    def __str__(self) -> str:
        before, after = self.mutation.lines(self.source)
        return f"{self.module}:{self.mutation.line(self.source)}: {self.mutation.kind}\n    - {before}\n    + {after}"


def sources(root: Path, places: Iterable[str]) -> list[Path]:
    """The modules at these places of ``src/steptwin``: packages, folders of them, modules (``wire``, ``wire/rtu.py``)."""
    found = [root / "src/steptwin" / place for place in places]
    return sorted({path for place in found for path in ([place] if place.is_file() else place.rglob("*.py"))})


def sample(root: Path, places: list[str], seed: int) -> Iterator[Mutant]:
    """All mutants of these places in random order."""
    mutants = []
    for path in sources(root, places):
        source = path.read_text()
        mutants += [Mutant(path.relative_to(root), mutation, source) for mutation in mutations(source)]
    random.Random(seed).shuffle(mutants)
    return (mutant for mutant in mutants if compiles(mutant.mutation.apply(mutant.source)))


def outcome(tree: Tree, reach: Reach, mutant: Mutant) -> str:
    """The stage in which a test failed, or ``survived``."""
    first = mutant.mutation.line(mutant.source)
    last = first + mutant.source.count("\n", mutant.mutation.start, mutant.mutation.end)
    changed = mutant.mutation.apply(mutant.source)
    forked = not reach.on_import(mutant.module, first, last)
    with tree.changed(mutant.module, changed):
        for name, seconds in reach.stages(mutant.module, first, last):
            passed = tree.passes_forked(mutant.module, mutant.source, changed, seconds) if forked else None
            if passed is None:
                passed = tree.passes(seconds)
            if not passed:
                return name
    return "survived"


def report(results: list[tuple[Mutant, str]], seed: int) -> str:
    """Counts by module and the survivors, as Markdown."""
    modules: dict[str, Counter[str]] = {}
    for mutant, found in results:
        for name in (str(mutant.module.relative_to("src/steptwin")), f"**{mutant.module.parts[2]}**", "**all**"):
            modules.setdefault(name, Counter())[found] += 1
    lines = [f"{len(results)} mutations, seed {seed}. Noticed by tests of the mirrored folder or by others.", ""]
    lines += [f"| module | {' | '.join(COLUMNS)} |", f"|---|{'---|' * len(COLUMNS)}"]
    for name in sorted(modules):
        lines.append(f"| {name} | {' | '.join(str(modules[name][column] or '') for column in COLUMNS)} |")
    lines += ["", "Survivors:", "", *(f"```\n{mutant}\n```" for mutant, found in results if found == "survived"), ""]
    return "\n".join(lines)


def recorded(workers: Workers, root: Path, chosen: list[str]) -> Reach:
    """What the tests of these folders execute; recorded where sources or tests have changed since the last time."""
    records = {folder: BUILD / f"{Path(folder).name}-{digest(root, folder)}.json" for folder in chosen}
    missing = [folder for folder, file in records.items() if not file.exists()]
    for folder in missing:
        for old in BUILD.glob(f"{Path(folder).name}-*.json"):
            old.unlink()
    tasks = [partial(_recorded, folder, records[folder]) for folder in missing]
    for number, (folder, passed) in enumerate(workers.each(tasks), 1):
        if not passed:
            sys.exit(f"mutants: {folder} fails without any mutation")
        print(f"recorded {folder} ({number}/{len(missing)})", flush=True)
    return Reach(root, records)


def _recorded(folder: str, file: Path, tree: Tree) -> tuple[str, bool]:
    return folder, tree.record(folder, file)


def _tried(reach: Reach, mutant: Mutant, tree: Tree) -> tuple[Mutant, str]:
    return mutant, outcome(tree, reach, mutant)


def main() -> None:
    if sys.argv[1:2] == ["faults"]:
        faults.main(sys.argv[2:])
        return
    parser = argparse.ArgumentParser(prog="make mutants", description="Mutation testing of the core.")
    parser.add_argument("-n", type=int, default=60, metavar="N", help="number of mutations (default: 60)")
    parser.add_argument("--seed", type=int, default=1, help="random seed of the sample (default: 1)")
    parser.add_argument(
        "-j", type=int, default=os.cpu_count() or 1, metavar="JOBS", help="how many at the same time (default: all cores)"
    )
    parser.add_argument("--mirrored", action="store_true", help="run only the tests of the mirrored folders: quicker")
    parser.add_argument(
        "places",
        nargs="*",
        metavar="PLACE",
        help=f"what to mutate: packages, or places in them such as drivers/m1486 and wire/rtu.py (default: {' '.join(CORE)})",
    )
    options = parser.parse_args()
    places = options.places or list(CORE)
    if unknown := [place for place in places if Path(place).parts[0] not in CORE or not sources(ROOT, [place])]:
        parser.error(f"no place in a package of the core: {', '.join(unknown)}; the packages are {', '.join(CORE)}")
    if options.j < 1:
        parser.error(f"-j {options.j}: 1 or more")
    packages = [name for name in CORE if any(Path(place).parts[0] == name for place in places)]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the tests that run are ended, too
    os.nice(5)
    BUILD.mkdir(parents=True, exist_ok=True)
    results: list[tuple[Mutant, str]] = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as directory:
        base, *trees = (Tree(ROOT, Path(directory, str(number))) for number in range(options.j + 1))
        workers = Workers(trees)
        try:
            chosen = [f"tests/{name}" for name in packages] if options.mirrored else folders(base.path, packages)
            reach = recorded(workers, base.path, chosen)
            mutants = islice(sample(base.path, places, options.seed), options.n)
            for tree in trees:
                tree.fork(reach.folders)
            tasks = [partial(_tried, reach, mutant) for mutant in mutants]
            for result in workers.each(tasks):
                results.append(result)
                print(f"{len(results)}/{len(tasks)} {result[1]}: {result[0]}", flush=True)
                RESULTS.write_text(report(results, options.seed))
        finally:
            workers.end()
    print(f"wrote {RESULTS}")


if __name__ == "__main__":
    main()
