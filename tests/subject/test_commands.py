"""Commands as values: from JSON and back, what is refused and with which words, and the schema that is kept beside the docs."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.actions import ACTIONS
from steptwin.simulation.world.inputs import Bytes, Download, EndScripts, Leave, Refused, See, SetVariable
from steptwin.subject import commands as command
from steptwin.subject import debugcommands as debug
from steptwin.subject.commands import COMMANDS, command_to_json, read_command
from steptwin.subject.schema import schema

EXAMPLES: list[tuple[dict[str, Any], command.Command]] = [
    ({"do": "describe"}, command.Describe()),
    ({"do": "read", "points": ["table.M1.position", "time"]}, command.ReadPoints(("table.M1.position", "time"))),
    ({"do": "pins"}, command.ReadPins()),
    ({"do": "pins", "controller": "a"}, command.ReadPins("a")),
    ({"do": "state", "controller": "a"}, command.ReadState("a")),
    ({"do": "encoders", "controller": "a"}, command.Encoders("a")),
    ({"do": "faults"}, command.ListFaults()),
    ({"do": "fault_kinds"}, command.ListFaultKinds()),
    ({"do": "time"}, command.Time()),
    ({"do": "end_points"}, command.EndPoints()),
    (
        {"do": "subscribe", "kinds": ["plan"], "controllers": ["a"], "axes": ["1"], "bound": 7},
        command.Subscribe(("plan",), ("a",), ("1",), 7),
    ),
    ({"do": "unsubscribe", "subscription": 3}, command.Unsubscribe(3)),
    ({"do": "set", "levels": {"a.IN1": 1.0, "a.AIN1": 4.2}}, do.Set((("a", "IN1", 1.0), ("a", "AIN1", 4.2)))),
    ({"do": "press", "button": "go"}, do.Press("go")),
    ({"do": "press", "button": "go", "for_ns": "200000000"}, do.Press("go", SECOND // 5)),
    ({"do": "release", "button": "go"}, do.Release("go")),
    ({"do": "write", "values": {"a.M1_POS_ABS": 5.0}}, do.Write((("a", "M1_POS_ABS", 5.0),))),
    ({"do": "send", "line": "chips", "text": "f640\r\xff"}, do.Send("chips", b"f640\r\xff")),
    ({"do": "request", "line": "bus", "unit": 1, "pdu": "0327240002"}, do.Request("bus", 1, b"\x03\x27\x24\x00\x02", SECOND)),
    ({"do": "put", "on": "belt", "front": 20.0}, do.Put("belt", 20.0)),
    ({"do": "remove", "workpiece": "belt.1"}, do.Remove("belt.1")),
    ({"do": "power_cycle", "controller": "a"}, do.PowerCycle("a")),
    ({"do": "turn", "controller": "a", "axis": 3, "counts": -40}, do.Turn("a", 3, -40)),
    ({"do": "couple", "controller": "a", "axis": 3, "to": "free"}, do.Couple("a", 3, "free")),
    ({"do": "fault", "fault": "crc unit=1 nth=3"}, do.SetFault(read_fault("crc unit=1 nth=3"))),
    ({"do": "clear_fault", "name": "crc"}, do.ClearFault("crc")),
    ({"do": "expect", "condition": "a.IN1"}, do.Expect("a.IN1")),
    ({"do": "note", "text": "now"}, do.Note("now")),
    ({"do": "see", "controller": "a", "number": 1.0, "x": 2.0, "y": 3.0, "angle": 0.0}, See("a", 1.0, 2.0, 3.0, 0.0)),
    ({"do": "enable", "controller": "a", "axis": 1}, command.Enable("a", 1)),
    ({"do": "enable", "controller": "a", "axis": 1, "on": False}, command.Enable("a", 1, on=False)),
    ({"do": "move", "controller": "a", "axis": 1, "to": 0.0}, command.Move("a", 1, to=0.0)),
    ({"do": "move", "controller": "a", "axis": 1, "by": -2.5}, command.Move("a", 1, by=-2.5)),
    ({"do": "home", "controller": "a", "axis": 1, "velocity": -20.0}, command.Home("a", 1, -20.0)),
    ({"do": "jog", "controller": "a", "axis": 1, "velocity": 5.0}, command.Jog("a", 1, 5.0)),
    ({"do": "stop", "controller": "a"}, command.StopAxes("a")),
    ({"do": "stop", "controller": "a", "axis": 2}, command.StopAxes("a", 2)),
    ({"do": "stop_all"}, command.StopAll()),
    ({"do": "program", "controller": "a", "action": "start"}, command.ControlProgram("a", "start")),
    (
        {"do": "download", "controller": "a", "place": "program 0", "text": "END\n"},
        Download("a", "program 0", "END\n"),
    ),
    ({"do": "pause"}, command.Pause()),
    ({"do": "resume"}, command.Resume()),
    ({"do": "resume", "speed": 0.1}, command.Resume(0.1)),
    ({"do": "resume", "speed": "max"}, command.Resume(float("inf"))),
    ({"do": "step"}, command.Advance()),
    ({"do": "step", "for_ns": "9223372036854", "until": "a.IN1"}, command.Advance(duration=9223372036854, until="a.IN1")),
    ({"do": "step", "to_ns": "5"}, command.Advance(to=5)),
    ({"do": "save", "file": "/tmp/now.json"}, command.Save("/tmp/now.json")),
    ({"do": "snapshot"}, command.TakeSnapshot()),
    ({"do": "snapshot", "name": "before"}, command.TakeSnapshot("before")),
    ({"do": "snapshots"}, command.ListSnapshots()),
    ({"do": "restore", "name": "before"}, command.RestoreSnapshot("before")),
    ({"do": "drop_snapshot", "name": "before"}, command.DropSnapshot("before")),
    ({"do": "debug"}, debug.Debug()),
    (
        {
            "do": "breakpoint",
            "controller": "a",
            "program": "program 0",
            "line": 3,
            "condition": "n > 2",
            "hits": "5",
            "log": "{n}",
        },
        debug.SetBreakpoint(controller="a", program="program 0", line=3, condition="n > 2", hits="5", log="{n}"),
    ),
    ({"do": "breakpoint", "label": "MAIN"}, debug.SetBreakpoint(label="MAIN")),
    ({"do": "breakpoint", "controller": "a", "value": "IN3"}, debug.SetBreakpoint(controller="a", value="IN3")),
    ({"do": "clear_breakpoint", "breakpoint": 2}, debug.ClearBreakpoint(2)),
    ({"do": "breakpoints"}, debug.ListBreakpoints()),
    ({"do": "stop_on", "events": ["limit"]}, debug.StopOn(("limit",))),
    ({"do": "step_program", "controller": "a", "way": "over"}, debug.StepProgram("a", "over")),
    ({"do": "run"}, debug.RunProgram()),
    ({"do": "run", "way": "backwards"}, debug.RunProgram("backwards")),
    ({"do": "look_at", "to_ns": "5"}, debug.LookAt(5)),
    ({"do": "branch"}, debug.Branch()),
    ({"do": "stack", "controller": "a"}, debug.Stack("a")),
    ({"do": "values", "controller": "a", "scope": "Pins"}, debug.Values("a", "Pins")),
    ({"do": "evaluate", "controller": "a", "expression": "n + 1"}, debug.Evaluate("a", "n + 1")),
    ({"do": "set_value", "controller": "a", "name": "n", "expression": "7"}, debug.SetValue("a", "n", "7")),
    ({"do": "program_source", "controller": "a", "program": "program"}, debug.ProgramSource("a", "program")),
    ({"do": "why"}, debug.AskWhy()),
    ({"do": "why", "question": "OUT3 == 0", "at_ns": "5"}, debug.AskWhy("OUT3 == 0", 5)),
]


@pytest.mark.parametrize(("plain", "value"), EXAMPLES, ids=lambda one: one["do"] if isinstance(one, dict) else "")
def test_from_json_and_back(plain: dict[str, Any], value: command.Command) -> None:
    name, fields = plain["do"], {key: one for key, one in plain.items() if key != "do"}
    assert read_command(name, fields) == value
    assert json.loads(json.dumps(command_to_json(value))) == plain


def test_every_command_is_among_the_examples() -> None:
    assert {plain["do"] for plain, _ in EXAMPLES} == set(COMMANDS)


def test_every_step_that_is_not_only_for_scripts_is_a_command() -> None:
    # Bytes and Leave belong to the connections of programs, SetVariable to debuggers, ExpectReached to the steps that move,
    # Refused to scripts of Python, Halt and EndScripts to the commands that stop.
    others = {Bytes, Leave, SetVariable, do.ExpectReached, Refused, Halt, EndScripts}
    assert {row.kind for row in COMMANDS.values()} >= set(ACTIONS) - others


@pytest.mark.parametrize(
    ("name", "fields", "text"),
    [
        ("pauze", {}, "no command 'pauze' (did you mean 'pause'?); commands are describe, "),
        (7, {}, "no command 7; commands are "),
        ("set", {"level": {"a.IN1": 1}}, "set: no field 'level' (did you mean 'levels'?); fields are levels"),
        ("pause", {"x": 1}, "pause: no field 'x'; fields are none"),
        ("set", {}, 'set: levels is missing, expected {"CONTROLLER.NAME": NUMBER, ...}: 0, 1, volts.'),
        ("set", {"levels": {}}, 'set: levels: {}: expected {"CONTROLLER.NAME": NUMBER, ...}'),
        ("set", {"levels": {"IN1": 1}}, "set: levels: 'IN1': expected CONTROLLER.PIN, such as 'table.IN3'"),
        ("set", {"levels": {"a.IN1": "1"}}, "set: levels: '1': expected a number from -1e+300 to 1e+300"),
        ("set", {"levels": {"a.IN1": float("nan")}}, "set: levels: nan: expected a number from"),
        ("set", {"levels": {"a.IN1": 10**400}}, "expected a number from"),
        (
            "turn",
            {"controller": "a", "axis": 1, "counts": 2**31},
            "turn: counts: 2147483648: expected a whole number from",
        ),
        ("turn", {"controller": "a", "axis": True, "counts": 1}, "turn: axis: True: expected a whole number from 1 to 64"),
        ("press", {"button": "go", "for_ns": -1}, "press: for_ns: -1: expected whole nanoseconds from 0 to"),
        ("press", {"button": "go", "for_ns": "9" * 5000}, "expected whole nanoseconds from 0 to"),
        ("press", {"button": "a\0b"}, "a text takes neither NUL nor surrogates"),
        ("press", {"button": "\udcff"}, "a text takes neither NUL nor surrogates"),
        ("press", {"button": "x" * 5000}, "a text of 5000 characters: permitted are at most 4096"),
        ("resume", {"speed": 0}, "resume: speed: 0: expected a number from 0.001 to 1000, or 'max'"),
        (
            "subscribe",
            {"kinds": ["plans"]},
            "subscribe: kinds: no kind of event 'plans' (did you mean 'plan'?); there are plan, ",
        ),
        ("couple", {"controller": "a", "axis": 1, "to": "wheel"}, "couple: to: 'wheel': expected 'drive' or 'free' or 'blocked'"),
        ("request", {"line": "b", "unit": 1, "pdu": "0"}, "request: pdu: '0': expected bytes as hexadecimal digits"),
        ("send", {"line": "b", "text": "ż"}, "send: text: 'ż' is not an 8-bit character"),
        ("fault", {"fault": "crk"}, "fault: fault: fault: kind = 'crk' (did you mean 'crc'?): permitted are"),
        ("move", {"controller": "a", "axis": 1}, "move: give either to (a position) or by (a distance)"),
        ("move", {"controller": "a", "axis": 1, "to": 1, "by": 1}, "move: give either to (a position) or by (a distance)"),
        ("step", {"for_ns": 1, "to_ns": 2}, "step: for_ns and to_ns exclude each other"),
    ],
)
def test_what_is_refused(name: Any, fields: dict[str, Any], text: str) -> None:
    with pytest.raises(Misuse) as refused:
        read_command(name, fields)
    assert text in str(refused.value)


def test_null_is_as_if_not_given() -> None:
    assert read_command("pins", {"controller": None}) == command.ReadPins()


def test_times_are_taken_as_numbers_too() -> None:
    assert read_command("step", {"for_ns": 10_000_000}) == command.Advance(duration=10_000_000)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.sampled_from(["a", "a.IN1", "max", "crc"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=5,
)


@given(name=st.sampled_from(list(COMMANDS)), data=st.data())
def test_whatever_is_read_is_a_command_or_misuse(name: str, data: st.DataObject) -> None:
    fields = {field.name: data.draw(VALUES) for field in COMMANDS[name].fields}
    try:
        found = read_command(name, fields)
    except Misuse:
        return
    again = command_to_json(found)
    assert again.pop("do") == name
    assert read_command(name, json.loads(json.dumps(again))) == found


def test_the_schema_has_what_the_table_has() -> None:
    found: Any = schema()
    for row in COMMANDS.values():
        request = found["$defs"][row.name]
        assert set(request["properties"]) == {"do", "id", "version", *(field.name for field in row.fields)}
        assert request["required"] == ["do", *(field.name for field in row.fields if field.is_required)]
        assert request["additionalProperties"] is False
