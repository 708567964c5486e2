"""``make mutants``: small mistakes put into the core, one at a time; do the tests notice?

A random sample, as many of each kind of mistake. For each of them the tests of the module run first, then those of its package,
then those of the whole core, until one fails. Results are written after each mutation to ``build/mutants/results.md``. Survivors
that change nothing a test could see are listed in ``mutants/equivalent.toml``, with the reason.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mutants.mutations import Mutation, compiles, mutations
from mutants.trial import CORE, Tree, limit_s

ROOT = Path(__file__).parent.parent
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
RESULTS = ROOT / "build/mutants/results.md"
COLUMNS = ("file", "folder", "core", "time", "equivalent", "survived")


@dataclass(frozen=True)
class Mutant:
    module: Path
    mutation: Mutation
    source: str

    def __str__(self) -> str:
        before, after = self.mutation.lines(self.source)
        return f"{self.module}:{self.mutation.line(self.source)}: {self.mutation.kind}\n    - {before}\n    + {after}"


def sample(tree: Tree, packages: list[str], seed: int) -> Iterator[Mutant]:
    """All mutants in random order, the kinds of mistakes in turn."""
    kinds: dict[str, list[Mutant]] = {}
    for module in tree.modules(packages):
        source = (tree.path / module).read_text()
        for mutation in mutations(source):
            kinds.setdefault(mutation.kind, []).append(Mutant(module, mutation, source))
    chance = random.Random(seed)
    for mutants in kinds.values():
        chance.shuffle(mutants)
    while any(kinds.values()):
        for name in sorted(kinds):
            while kinds[name]:
                mutant = kinds[name].pop()
                if compiles(mutant.mutation.apply(mutant.source)):
                    yield mutant
                    break


def equivalents() -> set[tuple[str, str, str]]:
    """Module, line before and line after of the mutants that are known to change nothing."""
    listed = tomllib.loads(EQUIVALENT.read_text()).get("mutant", [])
    return {(entry["module"], entry["before"], entry["after"]) for entry in listed}


def outcome(tree: Tree, mutant: Mutant, durations: dict[str, float], known: set[tuple[str, str, str]]) -> str:
    """Which stage failed, or one of the other `COLUMNS`."""
    if (str(mutant.module), *mutant.mutation.lines(mutant.source)) in known:
        return "equivalent"
    with tree.changed(mutant.module, mutant.mutation.apply(mutant.source)):
        for name, arguments in tree.stages(mutant.module):
            passed = tree.passes(arguments, limit_s(arguments, durations))
            if passed is None:
                return "time"
            if not passed:
                return name
    return "survived"


def report(results: list[tuple[Mutant, str]], seed: int) -> str:
    """Counts by module and the survivors, as Markdown."""
    modules: dict[str, Counter[str]] = {}
    for mutant, found in results:
        for name in (str(mutant.module.relative_to("src/steptwin")), f"**{mutant.module.parts[2]}**", "**all**"):
            modules.setdefault(name, Counter())[found] += 1
    lines = [
        f"{len(results)} mutations, seed {seed}. Killed by the mirrored file, its folder, the other folders of the core, or the"
    ]
    lines += ["limits of time and memory.", ""]
    lines += [f"| module | {' | '.join(COLUMNS)} |", f"|---|{'---|' * len(COLUMNS)}"]
    for name in sorted(modules):
        lines.append(f"| {name} | {' | '.join(str(modules[name][column] or '') for column in COLUMNS)} |")
    lines += ["", "Survivors:", "", *(f"```\n{mutant}\n```" for mutant, found in results if found == "survived"), ""]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(prog="make mutants", description="Mutation testing of the core.")
    parser.add_argument("-n", type=int, default=60, metavar="N", help="number of mutations (default: 60)")
    parser.add_argument("--seed", type=int, default=1, help="random seed of the sample (default: 1)")
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help=f"packages to mutate (default: {' '.join(CORE)})")
    options = parser.parse_args()
    if unknown := set(options.packages) - set(CORE):
        parser.error(f"no package of the core: {', '.join(sorted(unknown))}; they are {', '.join(CORE)}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the pytest that runs is ended, too
    os.nice(19)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    known = equivalents()
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    results: list[tuple[Mutant, str]] = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as directory:
        tree = Tree(ROOT, Path(directory))
        durations = tree.durations(list(CORE))
        for mutant in sample(tree, options.packages or list(CORE), options.seed):
            if len(results) == options.n:
                break
            results.append((mutant, outcome(tree, mutant, durations, known)))
            print(f"{len(results)}/{options.n} {results[-1][1]}: {mutant}", flush=True)
            RESULTS.write_text(report(results, options.seed))
    print(f"wrote {RESULTS}")


if __name__ == "__main__":
    main()
