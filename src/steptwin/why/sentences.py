"""Actions and statements in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from steptwin.diagnostics import visible
from steptwin.messages import Message, MessageText
from steptwin.simulation.kinds.programs import Programs, StatementLocation
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.inputs import Bytes, Download, ExternalInput, SetVariable
from steptwin.why.log import CauseLog, Executed

SETS = Message("why.sets", "sets {levels}")
PRESSES = Message("why.presses", "presses {button}")
RELEASES = Message("why.releases", "releases {button}")
WRITES = Message("why.writes", "writes {values}")
SWITCHES_OFF_AND_ON = Message("why.switches-off-and-on", "switches {controller} off and on")
STOPS = Message("why.stops", "stops {name}")
STOPS_A_PROGRAM = Message("why.stops-a-program", "stops {controller}'s program ({program})")
PUTS_A_WORKPIECE = Message("why.puts-a-workpiece", "puts a workpiece on {on}")
REMOVES_A_WORKPIECE = Message("why.removes-a-workpiece", "removes {workpiece}")
TURNS = Message("why.turns", "turns the encoder of {axis} by {counts}")
SETS_A_FAULT = Message("why.sets-a-fault", "sets the fault {name}")
CLEARS_A_FAULT = Message("why.clears-a-fault", "clears the fault {name}")
SETS_A_VARIABLE = Message("why.sets-a-variable", "sets the variable {name} = {value:g}")
PUTS_A_TEXT = Message("why.puts-a-text", "puts a text into {place}")
SENDS = Message("why.sends", "sends {data} from {place}")
SENDS_TO = Message("why.sends-to", "sends {data} to {line}")
REQUESTS = Message("why.requests", "requests {data} of {unit} on {line}")
COUPLES = Message("why.couples", "lets the encoder of {axis} be turned by: {to}")
REPLACED_STATEMENT = Message("why.replaced-statement", "a statement of a program that was replaced since")
LINE = Message("why.line", "line {line} `{code}`")
GIVEN = Message("why.given", "`{code}`")
END_OF_PROGRAM = Message("why.end-of-program", "the end of the program")
IS_NUMBER = Message("why.is-number", "{name} is {value:g}")
IS_IN_UNIT = Message("why.is-in-unit", "{name} is {value:.6g} {unit}")


def _halted(given: Halt) -> MessageText:
    if given.axis is None and given.program is not None:
        return STOPS_A_PROGRAM(controller=given.controller, program=given.program)
    return STOPS(name=given.controller if given.axis is None else f"{given.controller}.M{given.axis}")


_WORDS: Mapping[type, Callable[[Any], MessageText]] = {
    do.Set: lambda step: SETS(levels=[f"{controller}.{pin.upper()} = {value:g}" for controller, pin, value in step.levels]),
    do.Press: lambda step: PRESSES(button=step.button),
    do.Release: lambda step: RELEASES(button=step.button),
    do.Put: lambda step: PUTS_A_WORKPIECE(on=step.on),
    do.Remove: lambda step: REMOVES_A_WORKPIECE(workpiece=step.workpiece),
    do.Write: lambda step: WRITES(values=[f"{controller}.{name} = {value:g}" for controller, name, value in step.values]),
    do.Send: lambda step: SENDS_TO(data=visible(step.data.decode("ascii", "backslashreplace").strip()), line=step.line),
    do.Request: lambda step: REQUESTS(data=step.pdu.hex(" "), unit=step.unit, line=step.line),
    do.Couple: lambda step: COUPLES(axis=f"{step.controller}.M{step.axis}", to=step.coupling),
    do.PowerCycle: lambda step: SWITCHES_OFF_AND_ON(controller=step.controller),
    Halt: _halted,
    do.Turn: lambda step: TURNS(axis=f"{step.controller}.M{step.axis}", counts=step.counts),
    do.SetFault: lambda step: SETS_A_FAULT(name=step.fault.name or step.fault.kind.name),
    do.ClearFault: lambda step: CLEARS_A_FAULT(name=step.name),
    SetVariable: lambda given: SETS_A_VARIABLE(name=given.name, value=given.value),
    Download: lambda given: PUTS_A_TEXT(place=given.place),
    Bytes: lambda given: SENDS(data=given.data.hex(" "), place=given.place),
}


def describe_input(what: ExternalInput) -> MessageText:
    """An action in words."""
    words = _WORDS.get(type(what))
    return MessageText(type(what).__name__) if words is None else words(what)


def value_with_unit(name: str, value: float, unit: str) -> MessageText:
    """A value in words; ``unit`` may be empty."""
    return IS_IN_UNIT(name=name, value=value, unit=unit) if unit else IS_NUMBER(name=name, value=value)


def statement(log: CauseLog, executed: Executed) -> MessageText:
    """A statement with its line: "line 12 `OUT3 = OFF`"."""
    if executed.location.number < 0:
        return GIVEN(code=executed.location.text)
    if not log.is_of_present_text(executed):
        return REPLACED_STATEMENT()
    return statement_at(log.world.programs[executed.controller], executed.location)


def statement_at(programs: Programs, location: StatementLocation) -> MessageText:
    """As `statement`, of a present text."""
    found, source = programs.statements(location.text)[location.number], programs.texts[location.text]
    text = visible(source.text[found.start : found.end].strip())
    return LINE(line=found.line, code=text) if text else END_OF_PROGRAM()
