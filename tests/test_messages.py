"""Messages: each is one constant, its uses give all its values, and the page has it in Polish."""

from __future__ import annotations

import ast
import copy
import json
import math
import pickle
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from string import Formatter

import pytest

from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.messages import MESSAGES, Message, MessageText, text_of, with_messages
from steptwin.subject.dispatch import failure, raised

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src"
POLISH = ROOT / "studio-web/src/text/polish.json"
DONE = (
    *(f"{room}/**/*.py" for room in ("access", "calc", "debug", "devices", "studio", "subject", "why")),
    *(
        f"live/{name}.py"
        for name in ("clock", "control", "debugging", "directory", "keptsettings", "lookback", "pace", "why", "world")
    ),
    *(f"drivers/{name}.py" for name in ("address", "exchange", "place", "subject", "tcp", "*/failures", "*/jog", "*/subject")),
    *(f"drivers/{name}.py" for name in ("m1486/chip", "mic488/axis")),
    *(f"live/studio/{name}.py" for name in ("branches", "campaigns", "drawing", "plant", "processes", "recordings", "work")),
    *(f"simulation/faults/{name}.py" for name in ("active", "element", "fault", "kinds_physics", "machine", "places", "table")),
    *(
        f"simulation/kinds/{name}.py"
        for name in ("kind", "lines", "master", "*/control", "*/heldjog", "*/kind", "*/memory", "m1486/programs")
    ),
)
"""Of the others that reach the page, sentences still are in the tables by English (tests/studio/test_texts.py)."""
ERRORS = ("LineFailure", "Misuse", "Refusal")
DEFINITION = re.compile(r'^[A-Z_]+ = Message\(\s*"([^"]*)"', re.MULTILINE)
FORMAT = re.compile(r"\+?(0\d+)?(\.\d+)?[gfdX]")
"""Formats of numbers that the page knows."""


@cache
def defining() -> dict[str, dict[str, Message]]:
    """The messages that a module has, by the names of their constants, for modules that define any."""
    paths = [path for path in SOURCES.rglob("*.py") if " = Message(" in path.read_text("utf-8")]
    return {name: messages_in(name) for name in map(module_of, paths)}


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(SOURCES).with_suffix("").parts).removesuffix(".__init__")


def messages_in(module: str) -> dict[str, Message]:
    return {name: one for name, one in vars(import_module(module)).items() if isinstance(one, Message)}


def places(text: str) -> set[tuple[str, str, str]]:
    """Name, format and conversion of each place."""
    return {(name, form or "", kind or "") for _, name, form, kind in Formatter().parse(text) if name is not None}


def test_a_message_has_a_readable_id_in_its_room() -> None:
    for path in SOURCES.rglob("*.py"):
        room = "".join(module_of(path).split(".")[1:2])
        for id_ in DEFINITION.findall(path.read_text("utf-8")):
            assert re.fullmatch(rf"{room}(\.[a-z0-9]+(-[a-z0-9]+)*)+", id_), path


def calls() -> Iterator[tuple[str, ast.Call, Message]]:
    names = re.compile(rf"\b({'|'.join({name for messages in defining().values() for name in messages})})\(")
    for path in SOURCES.rglob("*.py"):
        text = path.read_text("utf-8")
        known = messages_in(module_of(path)) if names.search(text) else {}
        for node in ast.walk(ast.parse(text)) if known else ():
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in known:
                yield f"{path}:{node.lineno}", node, known[node.func.id]


def test_errors_that_reach_the_page_are_messages() -> None:
    """Not a text of its own in any ``raise``."""
    paths = [path for pattern in DONE for path in (SOURCES / "steptwin").glob(pattern)]
    nodes = [
        (path, node) for path in paths for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Raise)
    ]
    calls = [(path, node.exc) for path, node in nodes if isinstance(node.exc, ast.Call) and ast.unparse(node.exc.func) in ERRORS]
    found = [(path, call.lineno) for path, call in calls if isinstance(call.args[0], ast.Constant | ast.JoinedStr)]
    assert len(calls) > 100
    assert found == []


def test_each_use_of_a_message_gives_its_values() -> None:
    for place, call, message in calls():
        assert {one.arg for one in call.keywords} == {name for name, _, _ in places(message.english)}, place


def test_the_page_has_each_message_in_polish_with_the_same_places() -> None:
    assert defining()
    polish = json.loads(POLISH.read_text("utf-8"))
    assert polish.keys() == MESSAGES.keys()
    assert {one: places(polish[one]) for one in polish} == {one: places(MESSAGES[one].english) for one in MESSAGES}
    for one in MESSAGES.values():
        assert all(not form or FORMAT.fullmatch(form) for _, form, _ in places(one.english)), one.id


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> Message:
    monkeypatch.delitem(MESSAGES, "test.too-wide", raising=False)
    return Message("test.too-wide", "{name!r} is {width:g} mm wide; permitted are {names}")


def test_two_messages_with_one_id_are_refused(wide: Message) -> None:
    with pytest.raises(ValueError, match=wide.id):
        Message(wide.id, "something else")
    del MESSAGES[wide.id]


@pytest.mark.parametrize("kind", [Misuse, Refusal, LineFailure])
def test_an_error_is_the_same_after_pickling_copying_and_json(wide: Message, kind: type[SteptwinError]) -> None:
    inner = wide(name="belt", width=1e7, names=["wide", MessageText("from elsewhere")])
    text = Message("test.outer", "in {place}: {problem}")(place="here", problem=inner)
    del MESSAGES["test.outer"], MESSAGES[wide.id]
    error = kind(text)
    assert str(error) == "in here: 'belt' is 1e+07 mm wide; permitted are wide, from elsewhere"
    by_json = raised(json.loads(json.dumps(failure(error)))["error"])
    for other in (pickle.loads(pickle.dumps(error)), copy.deepcopy(error), by_json):
        assert type(other) is kind
        assert (str(other), text_of(other).plain()) == (str(error), text.plain())


def test_what_json_has_no_number_for_is_a_text(wide: Message) -> None:
    text = wide(name="belt", width=math.inf, names=[])
    del MESSAGES[wide.id]
    assert text.values["width"] == "inf"


def test_lists_of_messages_have_one_for_each_member(wide: Message) -> None:
    text = wide(name="belt", width=1, names=[])
    del MESSAGES[wide.id]
    plain = with_messages({"notes": ["by hand", text], "name": "belt"})
    assert plain["messages"] == {"notes": [None, {"id": text.id, "values": text.values}]}
