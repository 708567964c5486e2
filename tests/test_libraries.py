"""Libraries are used through what they offer: each private name, and each module that one keeps for itself, has a reason."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src/steptwin"
INTERNAL = (
    "asyncua.server.address_space",
    "asyncua.server.binary_server_asyncio",
    "asyncua.server.internal_",
    "asyncua.server.monitored_item_service",
    "asyncua.server.subscription_service",
    "asyncua.server.uaprocessor",
    "asyncua.ua.ua_binary",
    "asyncua.ua.uaprotocol_",
    "paho.mqtt.client",
    "uvicorn.protocols",
)
"""Modules without an underscore that are not meant for others: the beginnings of their names."""
REASONS = {
    "drivers/rfc2217.py": "serialx waits for confirmations that ser2net never sends",
    "gateways/epics/server.py": "caproto takes its addresses from the environment only, and answers a put before its monitors",
    "gateways/opcua/session.py": "asyncua gives no user to writes and calls, and answers the requests of a connection one by one",
    "lsp/protocol.py": "pygls has no answer to a request that it refuses",
    "testing/rig.py": "a type that only checkers see",
}
"""Modules that use such names all the same."""
FIELDS = frozenset({"_asdict", "_fields", "_make", "_replace", "_exit"})
"""Documented in spite of their underscore: those of named tuples, `os._exit`."""


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__") and name not in FIELDS


def own_names(tree: ast.AST) -> set[str]:
    """Names that are defined in a module or class: functions, classes, variables, attributes of ``self``, ``__slots__``."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Attribute | ast.Name) and not isinstance(node.ctx, ast.Load):
            found.add(node.attr if isinstance(node, ast.Attribute) else node.id)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)
    return found


class Classes:
    """All classes of the package by their names, which are unique enough for this."""

    def __init__(self, trees: Iterable[ast.AST]) -> None:
        self.own: dict[str, set[str]] = {}
        self.near: dict[str, set[str]] = {}
        """Bases and derived classes."""
        self.known: dict[str, set[str]] = {}
        for one in (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
            self.own.setdefault(one.name, set()).update(own_names(one))
            for base in one.bases:
                name = ast.unparse(base).partition("[")[0].rpartition(".")[2]
                self.near.setdefault(one.name, set()).add(name)
                self.near.setdefault(name, set()).add(one.name)

    def names(self, name: str) -> set[str]:
        """Those that a class has of this package: its own, and those of its bases and derived classes."""
        if name in self.known:
            return self.known[name]
        seen: set[str] = set()
        waiting = {name}
        while waiting:
            seen.add(one := waiting.pop())
            if one in self.own:  # not through the classes of libraries
                waiting |= self.near.get(one, set()) - seen
        theirs = {found for one in seen for found in self.own.get(one, ())}
        self.known |= dict.fromkeys(seen & self.own.keys(), theirs)
        return theirs


def foreign_names(tree: ast.AST, own: set[str], classes: Classes) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and is_private(node.attr) and node.attr not in own:
            yield f"{node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.ClassDef):
            theirs = classes.names(node.name)
            for inner in ast.walk(node):
                if not isinstance(inner, ast.Attribute) or not isinstance(inner.value, ast.Name):
                    continue
                if (
                    inner.value.id in ("self", "cls")
                    and is_private(inner.attr)
                    and inner.attr in own
                    and inner.attr not in theirs
                ):
                    yield f"{inner.lineno}: {ast.unparse(inner)}"
        elif isinstance(node, ast.Import | ast.ImportFrom):
            module = (node.module or "") if isinstance(node, ast.ImportFrom) else ""
            for name in (f"{module}.{one.name}".lstrip(".") for one in node.names):
                is_library = name.partition(".")[0] not in {"steptwin", *sys.stdlib_module_names}
                if is_library and (name.startswith(INTERNAL) or any(map(is_private, name.split(".")))):
                    yield f"{node.lineno}: {name}"


def test_private_parts_of_libraries_are_used_where_there_is_a_reason() -> None:
    modules = {str(path.relative_to(SOURCE)): ast.parse(path.read_text()) for path in sorted(SOURCE.rglob("*.py"))}
    own = {name for tree in modules.values() for name in own_names(tree)}
    classes = Classes(modules.values())
    found = {name: list(foreign_names(tree, own, classes)) for name, tree in modules.items()}
    assert {name: uses for name, uses in found.items() if uses and name not in REASONS} == {}
    assert [name for name in REASONS if not found[name]] == []
