"""Messages: each is one constant, its uses give all its values, and the page has it in Polish."""

from __future__ import annotations

import ast
import copy
import json
import math
import pickle
import re
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from inspect import signature
from pathlib import Path
from string import Formatter

import pytest

from steptwin.diagnostics import SourceText, Span
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.files.world import World
from steptwin.live.studio.demo import FOLDER, describe_demo
from steptwin.m1486.datasheet import datasheet_of as chip_sheet
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.variants import VARIANTS
from steptwin.messages import MESSAGES, Message, MessageText, text_of, with_messages
from steptwin.mic488.configform import config_form
from steptwin.mic488.datasheet import datasheet_of as mic488_sheet
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS, FIRMWARES
from steptwin.simulation.faults.kinds import rows as fault_kinds
from steptwin.subject.dispatch import code_of, failure, raised
from steptwin.subject.events import payload_of
from steptwin.subject.payloads import is_shown
from steptwin.verify import m1486, mic488
from steptwin.wire.pdu import ModbusException

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src"
POLISH = ROOT / "studio-web/src/text/polish.json"
ROWS = ROOT / "studio-web/src/text/rows.json"
DONE = (
    *(f"{room}/**/*.py" for room in ("access", "calc", "debug", "devices", "m1486", "mic488", "studio", "subject", "why")),
    *(
        f"live/{name}.py"
        for name in ("clock", "control", "debugging", "directory", "keptsettings", "pace", "timetravel", "why", "world")
    ),
    *(
        f"drivers/{name}.py"
        for name in ("address", "exchange", "lineaddress", "subject", "tcp", "*/failures", "*/jog", "*/subject")
    ),
    *(f"drivers/{name}.py" for name in ("m1486/chip", "mic488/axis")),
    *(f"live/studio/{name}.py" for name in ("branches", "campaigns", "drawing", "services", "processes", "recordings", "work")),
    *(
        f"simulation/faults/{name}.py"
        for name in ("active", "element", "fault", "kinds_physics", "controller", "places", "table")
    ),
    *(
        f"simulation/kinds/{name}.py"
        for name in ("kind", "lines", "master", "*/control", "*/deadmanjog", "*/kind", "*/memory", "m1486/programs")
    ),
)
"""Where what a page asks for can be refused."""
ERRORS = ("LineFailure", "Misuse", "ProgramFault", "Refusal", "Runaway", "WrongData", "WrongMove")
HAPPENS = ("devices/**/*.py", "drivers/**/*.py", "live/**/*.py", "m1486/**/*.py", "mic488/**/*.py", "simulation/**/*.py")
REPORTS = ("axis_event", "event", "refusing", "report", "wrong_data", "wrong_data_received", "_started", "StatusPayload")
CALLED = re.compile(r"\b(\w+)\(")
DEFINITION = re.compile(r'^[A-Z_]+ = Message\(\s*"([^"]*)"', re.MULTILINE)
FORMAT = re.compile(r"\+?(0\d+)?(\.\d+)?[gfdX]|\n|; ")
"""Formats of numbers and lists that the page knows."""


@cache
def defining() -> dict[str, dict[str, Message]]:
    """The messages that a module has, by the names of their constants, for modules that define any."""
    paths = [path for path in SOURCES.rglob("*.py") if "Message(" in path.read_text("utf-8")]
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
    names = {name for messages in defining().values() for name in messages}
    for path in SOURCES.rglob("*.py"):
        text = path.read_text("utf-8")
        tree = ast.parse(text) if names.intersection(CALLED.findall(text)) else None
        known = {} if tree is None else {**messages_in(module_of(path)), **messages_through(tree)}
        for node in ast.walk(tree) if tree is not None and known else ():
            if isinstance(node, ast.Call) and (name := ast.unparse(node.func)) in known:
                yield f"{path}:{node.lineno}", node, known[name]


def messages_through(tree: ast.Module) -> dict[str, Message]:
    """Messages of imported modules by their names in this one, such as ``f.WRITE``."""
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    modules = {alias.asname or alias.name: f"{node.module}.{alias.name}" for node in imports for alias in node.names}
    return {f"{name}.{one}": said for name, module in modules.items() for one, said in defining().get(module, {}).items()}


def calls_in(patterns: Iterable[str]) -> Iterator[tuple[Path, ast.Call]]:
    for path in {path for pattern in patterns for path in (SOURCES / "steptwin").glob(pattern)}:
        yield from ((path, node) for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call))


def test_errors_that_reach_the_page_are_messages() -> None:
    """Not a text of its own in any error."""
    calls = [(path, call) for path, call in calls_in(DONE) if ast.unparse(call.func) in ERRORS and call.args]
    assert len(calls) > 300
    assert [(path, call.lineno) for path, call in calls if isinstance(call.args[0], ast.Constant | ast.JoinedStr)] == []


def test_events_are_messages() -> None:
    """No sentence is reported but that of a message."""
    calls = [(path, call) for path, call in calls_in(HAPPENS) if ast.unparse(call.func).rpartition(".")[2] in REPORTS]
    assert len(calls) > 100
    assert [(path, call.lineno) for path, call in calls if any(map(is_sentence, call.args))] == []


def is_sentence(node: ast.expr) -> bool:
    if isinstance(node, ast.JoinedStr):
        return any(isinstance(part, ast.Constant) and " " in str(part.value) for part in node.values)
    return isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.count(" ") > 1


@pytest.mark.parametrize("name", ["demo", "hoist/hoist", "feeder", "handwheel", "two_stations/two_stations"])
def test_events_of_the_examples_are_messages(name: str) -> None:
    if name == "demo":
        world = World.from_toml(describe_demo(free_ports=True), {"demo.prg": (FOLDER / "demo.prg").read_bytes()})
    else:
        world = World.load(ROOT / f"examples/worlds/{name}.toml")
    with world:
        world.run(for_=12.0)
        texts = [payload.text for record in world.trace if is_shown(payload := payload_of(record))]
    assert texts
    assert [text for text in texts if text_of(text).id is None] == []


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


def rows_of_tables() -> dict[str, set[str]]:
    sheets = [*map(chip_sheet, VARIANTS), *map(mic488_sheet, FIRMWARES)]
    kinds = tuple(fault_kinds())
    return {
        "points": {name for sheet in sheets for name in (*(p.path for p in sheet.points), *(c.name for c in sheet.commands))},
        "configuration": {key.name for section in config_form("", "").sections for key in section.settings},
        "faults": {kind.name for kind in kinds},
        "parameters": {f"{kind.name}.{one.name}" for kind in kinds for one in kind.parameters},
        "checks": {check.id for check in (*mic488.CHECKS, *m1486.CHECKS)},
    }


def test_the_page_has_each_row_of_the_tables_in_polish_and_nothing_else() -> None:
    """By its name, or with ``{n}`` for the number in it; a parameter of several kinds of faults once."""
    polish = json.loads(ROWS.read_text("utf-8"))
    words = polish.pop("words")
    assert sum(map(len, polish.values())) > 200
    for table, rows in rows_of_tables().items():
        forms = [(row, re.sub(r"\d+", "{n}", row, count=1), row.rpartition(".")[2]) for row in rows]
        used = {next((form for form in named if form in polish[table]), named[0]) for named in forms}
        assert used == polish[table].keys(), table
    defaults = {one.otherwise for kind in fault_kinds() for one in kind.parameters if one.otherwise}
    assert {UNIT, f"{UNIT}/s", *defaults, *AXIS_STATUS_TEXTS.values(), *CONTROLLER_STATUS_TEXTS.values()} <= words.keys()


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> Message:
    monkeypatch.delitem(MESSAGES, "test.too-wide", raising=False)
    return Message("test.too-wide", "{name!r} is {width:g} mm wide; permitted are {names}")


def test_two_messages_with_one_id_are_refused(wide: Message) -> None:
    with pytest.raises(ValueError, match=wide.id):
        Message(wide.id, "something else")
    del MESSAGES[wide.id]


def error_kinds() -> list[type[SteptwinError]]:
    """All error classes of the sources; their modules are imported."""
    known, before = {"SteptwinError"}, 0
    found = re.compile(r"^class (\w+)\(([\w., ]+)\):", re.MULTILINE)
    classes = [(path, *one) for path in SOURCES.rglob("*.py") for one in found.findall(path.read_text("utf-8"))]
    while len(known) > before:
        before = len(known)
        known |= {name for _, name, bases in classes if known & set(re.findall(r"\w+", bases))}
    for module in {module_of(path) for path, name, _ in classes if name in known}:
        import_module(module)
    kinds = {SteptwinError}
    for _ in range(len(known)):
        kinds |= {one for kind in kinds for one in kind.__subclasses__() if one.__module__.startswith("steptwin.")}
    assert {kind.__name__ for kind in kinds} == known
    return sorted(kinds, key=lambda kind: kind.__name__)


def made(kind: type[SteptwinError], text: MessageText) -> SteptwinError:
    """An error of this kind; what its own ``__init__`` takes is chosen by the types there."""
    if not any("__init__" in vars(one) for one in kind.__mro__ if one.__module__.startswith("steptwin.")):
        return kind(text)
    examples: dict[str, object] = {
        "bool": True,
        "bytes": b"7",
        "int": 3,
        "object": "a request",
        "str": text,
        "str | None": "another",
        "ChipMoveEnd": "the end of a motion",
        "Collection[int]": (1, 2),
        "Findings": (),
        "LineFailure": LineFailure(text),
        "LineFailure | None": LineFailure(text),
        "LineRequest": Changing("a request"),
        "ModbusException": ModbusException(3, 2),
        "MoveEnd": "the end of a motion",
        "Nanos": 7,
        "Path": Path("file"),
        "Sequence[Diagnostic]": (),
        "Sequence[str]": (),
        "SourceText": SourceText("file", ""),
        "Span": Span(0, 1),
        "list[Diagnostic]": [],
    }
    return kind(**{one.name: examples[one.annotation] for one in signature(kind).parameters.values()})


class Changing(str):
    """A request that changes something."""

    __slots__ = ()
    changes = True


@pytest.mark.parametrize("kind", error_kinds())
def test_an_error_is_the_same_after_pickling_copying_and_json(wide: Message, kind: type[SteptwinError]) -> None:
    inner = wide(name="belt", width=1e7, names=["wide", MessageText("from elsewhere")])
    text = Message("test.outer", "in {place}: {problem}")(place="here", problem=inner)
    del MESSAGES["test.outer"], MESSAGES[wide.id]
    assert text == "in here: 'belt' is 1e+07 mm wide; permitted are wide, from elsewhere"
    error = made(kind, text)
    for other in (pickle.loads(pickle.dumps(error)), copy.deepcopy(error)):
        assert type(other) is kind
        assert vars(other).keys() == vars(error).keys()
        assert (str(other), text_of(other).to_json()) == (str(error), text_of(error).to_json())
    by_json = raised(json.loads(json.dumps(failure(error)))["error"])
    assert type(by_json) in (Misuse, Refusal, LineFailure)
    assert isinstance(error, type(by_json)) or code_of(error) == "failure"
    assert (str(by_json), text_of(by_json).to_json()) == (str(error), text_of(error).to_json())


def test_what_json_has_no_number_for_is_a_text(wide: Message) -> None:
    text = wide(name="belt", width=math.inf, names=[])
    del MESSAGES[wide.id]
    assert text.values["width"] == "inf"


def test_lists_of_messages_have_one_for_each_member(wide: Message) -> None:
    text = wide(name="belt", width=1, names=[])
    del MESSAGES[wide.id]
    plain = with_messages({"notes": ["by hand", text], "name": "belt"})
    assert plain["messages"] == {"notes": [None, {"id": text.id, "values": text.values}]}
