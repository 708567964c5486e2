"""Every test shows what makes it fail: an assertion, an expected error, or a helper whose name says that it checks."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parent
CHECKING = ("assert", "check", "expect", "fnmatch_lines", "must", "raises", "until", "verify", "warns")
"""What the names of helpers that fail a test begin with."""


def unchecked(text: str) -> Iterator[str]:
    """The tests in a module without a visible check."""
    for found in ast.walk(ast.parse(text)):
        is_test = isinstance(found, ast.FunctionDef | ast.AsyncFunctionDef) and found.name.startswith("test_")
        if is_test and not any(map(is_check, ast.walk(found))):
            yield found.name


def is_check(node: ast.AST) -> bool:
    if isinstance(node, ast.Assert):
        return True
    if not isinstance(node, ast.Call):
        return False
    called = node.func
    name = called.attr if isinstance(called, ast.Attribute) else called.id if isinstance(called, ast.Name) else ""
    return name.lstrip("_").startswith(CHECKING)


def test_every_test_shows_what_it_checks() -> None:
    found = {str(path.relative_to(TESTS)): list(unchecked(path.read_text("utf-8"))) for path in TESTS.rglob("test_*.py")}
    assert {path: names for path, names in found.items() if names} == {}


def test_a_test_without_a_check_is_found() -> None:
    assert list(unchecked("def test_it():\n    run()\n")) == ["test_it"]
    assert list(unchecked("def test_it():\n    with pytest.raises(OSError):\n        run()\n")) == []
