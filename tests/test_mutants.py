"""Mutations of source text: where they are, and that nothing else changes."""

from __future__ import annotations

from pathlib import Path

import pytest
from mutants.__main__ import CORE, equivalents
from mutants.mutations import compiles, mutations

ROOT = Path(__file__).parent.parent


def changed(source: str, kind: str) -> list[str]:
    return [mutation.apply(source) for mutation in mutations(source) if mutation.kind == kind]


@pytest.mark.parametrize(
    ("source", "kind", "expected"),
    [
        ("a < b", "comparison", ["a <= b", "a >= b"]),
        ("(a) is not None", "comparison", ["(a) is None"]),
        ("a in b in c", "comparison", ["a not in b in c", "a in b not in c"]),
        ("x = a and (b) and c", "operator", ["x = a or (b) and c", "x = a and (b) or c"]),
        ("x = -a * b", "operator", ["x = -a / b", "x = a * b"]),
        ("x = a // b", "operator", ["x = a * b"]),
        ("é = 'é' + b", "operator", ["é = 'é' - b"]),
        ("x += y", "operator", ["x -= y"]),
        ("x += y", "statement", ["pass"]),
        ("self.x = y", "statement", ["pass"]),
        ("x = y", "statement", []),
        ("f()\nx()", "statement", ["pass\nx()", "f()\npass"]),
        ("def f(): return 1", "statement", ["def f(): pass"]),
        ("f(a, b)", "argument", ["f(b, a)"]),
        ("f(a, b=b, c=c)", "argument", ["f(a,  c=c)", "f(a, b=b, )"]),
        ("f(a, a)", "argument", []),
        ("max(a, b)", "argument", []),
        ("zip(a, a, strict=True)", "argument", []),
        ("zip(a, a, strict=True)", "truth value", []),
        ("x = True", "truth value", ["x = False"]),
        ("x = 0x10", "number", ["x = (0x10 + 1)"]),
        ("x: Literal[1] = y", "number", []),
        ("@cache(1)\nclass A: pass", "number", []),
        ("x = f'{a:3}'", "number", []),
    ],
)
def test_each_mutation_changes_one_thing(source: str, kind: str, expected: list[str]) -> None:
    assert sorted(changed(source, kind)) == sorted(expected)


def test_a_mutation_tells_its_line_before_and_after() -> None:
    source = "x = 1\nif a:\n    b(c <\n      d)\n"
    (first, *_) = (mutation for mutation in mutations(source) if mutation.kind == "comparison")
    assert first.line(source) == 3
    assert first.lines(source) == ("b(c <", "b(c <=")


def test_nearly_all_mutations_of_a_module_compile() -> None:
    source = (ROOT / "src/steptwin/wire/rtu.py").read_text()
    found = [compiles(mutation.apply(source)) for mutation in mutations(source)]
    assert len(found) > 10
    assert found.count(False) < len(found) / 20


def test_all_packages_of_the_core_are_there() -> None:
    assert [name for name in CORE if not ((ROOT / "src/steptwin" / name).is_dir() and (ROOT / "tests" / name).is_dir())] == []


def test_mutants_said_to_be_equivalent_are_still_possible() -> None:
    """An entry that fits no line any more is to be removed."""
    stale = []
    for module, before, after in equivalents():
        source = (ROOT / module).read_text()
        if (before, after) not in {mutation.lines(source) for mutation in mutations(source)}:
            stale.append(f"{module}: {before}")
    assert stale == []
