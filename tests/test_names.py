"""One name for one thing: a class of the product has a name that no other class and no type alias has."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "steptwin"


def named_types(module: ast.Module) -> Iterator[ast.ClassDef | ast.AnnAssign]:
    for node in ast.walk(module):
        match node:
            case ast.ClassDef() | ast.AnnAssign(annotation=ast.Name("TypeAlias")):
                yield node


def test_no_two_types_have_the_same_name() -> None:
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        for node in named_types(ast.parse(path.read_text())):
            name = node.name if isinstance(node, ast.ClassDef) else ast.unparse(node.target)
            found.append((name, f"{path.relative_to(SOURCE)}:{node.lineno}"))
    found.sort()
    places = {name: [place for _, place in group] for name, group in groupby(found, key=lambda one: one[0])}
    assert len(places) > 1000
    assert {name: where for name, where in places.items() if len(where) > 1} == {}
