"""Libraries are used through what they offer: each private name, and each module that one keeps for itself, has a reason."""

from __future__ import annotations

import ast
import gc
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pytest

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


def own_names(nodes: Iterable[ast.AST]) -> set[str]:
    """Names that are defined in a module or class: functions, classes, variables, attributes of ``self``."""
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            found.add(node.id)
        elif isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load) and is_oneself(node.value):
            found.add(node.attr)
    return found


def is_oneself(node: ast.expr) -> bool:
    """``self``, ``cls`` or ``super()``."""
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "super"
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


class Classes:
    """All classes of the package by their names, which are unique enough for this."""

    def __init__(self, nodes: Iterable[ast.AST]) -> None:
        self.own: dict[str, set[str]] = {}
        self.near: dict[str, set[str]] = {}
        """Bases and derived classes."""
        self.known: dict[str, set[str]] = {}
        for one in (node for node in nodes if isinstance(node, ast.ClassDef)):
            self.own.setdefault(one.name, set()).update(own_names(ast.walk(one)))
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


def foreign_names(nodes: Sequence[ast.AST], own: set[str], classes: Classes) -> Iterator[str]:
    """Private names of other things than ``self`` that are not among ``own``, those of ``self`` that its class has not from this
    package, and what is kept by its library for itself. A module that imports a library has no private name of another thing."""
    libraries = set(imported_from_libraries(nodes))
    for node in nodes:
        if isinstance(node, ast.Attribute) and is_private(node.attr) and not is_oneself(node.value):
            if libraries or node.attr not in own:
                yield f"{node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.ClassDef):
            theirs = classes.names(node.name)
            for inner in ast.walk(node):
                if not isinstance(inner, ast.Attribute) or inner.attr in theirs:
                    continue
                if is_private(inner.attr) and is_oneself(inner.value):
                    yield f"{inner.lineno}: {ast.unparse(inner)}"
    for line, name in libraries:
        if name.startswith(INTERNAL) or any(map(is_private, name.split("."))):
            yield f"{line}: {name}"


def imported_from_libraries(nodes: Iterable[ast.AST]) -> Iterator[tuple[int, str]]:
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = (node.module or "") if isinstance(node, ast.ImportFrom) else ""
            for name in (f"{module}.{one.name}".lstrip(".") for one in node.names):
                if name.partition(".")[0] not in {"steptwin", *sys.stdlib_module_names}:
                    yield node.lineno, name


def nodes(text: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(text)))


@pytest.fixture
def without_collector() -> Iterator[None]:
    """To look for garbage in so many trees would take longer than to make them."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("without_collector")
def test_private_parts_of_libraries_are_used_where_there_is_a_reason() -> None:
    modules = {path.relative_to(SOURCE): nodes(path.read_text()) for path in sorted(SOURCE.rglob("*.py"))}
    own: dict[str, set[str]] = {}
    """By room, whose classes may know of each other."""
    for path, inside in modules.items():
        own.setdefault(path.parts[0], set()).update(own_names(inside))
    classes = Classes(node for inside in modules.values() for node in inside)
    found = {path.as_posix(): list(foreign_names(inside, own[path.parts[0]], classes)) for path, inside in modules.items()}
    assert {name: uses for name, uses in found.items() if uses and name not in REASONS} == {}
    assert [name for name in REASONS if not found[name]] == []


def test_a_name_that_is_also_one_of_ours_hides_nothing() -> None:
    ours = "class Ours:\n    def __init__(self): self._queue = self._client = None\n"
    use = "def use(client, ours):\n    client._client._queue.clear()\n    client._loop.stop()\n    client._sock = ours._queue\n"
    derived = "class Theirs(Client):\n    def use(self): self._queue.clear()\n"
    library = nodes(f"from aiomqtt import Client\n{ours}{use}{derived}")
    plain = nodes(ours + use)
    names = {"_queue", "_client"}
    assert own_names(plain) & {"_queue", "_client", "_loop", "_sock"} == names
    assert {text.partition(": ")[2] for text in foreign_names(library, names, Classes(library))} == {
        *("client._client._queue", "client._client", "client._loop", "client._sock", "ours._queue", "self._queue"),
    }
    assert {text.partition(": ")[2] for text in foreign_names(plain, names, Classes(plain))} == {"client._loop", "client._sock"}
