"""Faults read from a table of a TOML file or a line of text."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.nearmiss import NearMiss
from steptwin.numerals import read_integer, read_number
from steptwin.simulation.faults.kinds import KINDS
from steptwin.simulation.faults.table import Fault, FaultKind, FaultValue, Parameter, ParameterForm, check

GRAMMAR = "KIND [NAME=VALUE ...]"
EXAMPLE = "crc unit=1 nth=3"


class FaultMistake(Misuse):
    """A description of a fault is wrong. ``key``: of the wrong value; empty if none."""

    def __init__(self, text: str, key: str = "") -> None:
        super().__init__(text)
        self.key = key


UNKNOWN_KIND_OF_FAULT = Message("simulation.unknown-kind-of-fault", "{place}: kind = {value}{hint}: permitted are {names}")
WRONG_NAME_OF_A_FAULT = Message(
    "simulation.wrong-name-of-a-fault", "{place}: name = {value}: permitted is text that can be printed, without blanks"
)
UNKNOWN_PARAMETER_OF_A_FAULT = Message(
    "simulation.unknown-parameter-of-a-fault", "{place}: there is no {key!r}: parameters are {names}"
)
MISSING_PARAMETER_OF_A_FAULT = Message("simulation.missing-parameter-of-a-fault", "{place}: {name} is missing: {what}")
NTH_AND_EVERY = Message("simulation.nth-and-every", "{place}: nth and every exclude each other")
FAULT_ENDS_BEFORE_ITS_BEGIN = Message(
    "simulation.fault-ends-before-its-begin", "{place}: until_s = {end:g} is before the fault begins at {begin:g} s"
)


def parse(mapping: Mapping[str, object], place: str = "fault") -> Fault:
    """The fault in ``{"kind": "crc", "unit": 1, "nth": 3}``. `FaultMistake` names key, value, range, and ``place``."""
    word = mapping.get("kind")
    kind = KINDS.get(word) if isinstance(word, str) else None
    if kind is None:
        near = NearMiss().hint(word, KINDS) if isinstance(word, str) else ""
        raise FaultMistake(UNKNOWN_KIND_OF_FAULT(place=place, value=repr(word), hint=near, names=list(KINDS)), "kind")
    name = mapping.get("name", "")
    if not isinstance(name, str) or " " in name or not name.isprintable():
        raise FaultMistake(WRONG_NAME_OF_A_FAULT(place=place, value=repr(name)), "name")
    place = f"{place} ({kind.name})"
    given: dict[str, FaultValue] = {}
    for key, value in mapping.items():
        if key not in ("kind", "name"):
            parameter = kind.parameter(key)
            if parameter is None:
                names = [parameter.name for parameter in kind.parameters]
                raise FaultMistake(UNKNOWN_PARAMETER_OF_A_FAULT(place=place, key=key, names=names), key)
            try:
                given[key] = check(parameter, value, f"{place}: {key}")
            except Misuse as error:
                raise FaultMistake(text_of(error), key) from None
    for parameter in kind.parameters:
        if parameter.is_required and parameter.name not in given:
            raise FaultMistake(
                MISSING_PARAMETER_OF_A_FAULT(
                    place=place, name=parameter.name, what=text_of(parameter.meaning[:1].lower() + parameter.meaning[1:])
                )
            )
    if "nth" in given and "every" in given:
        raise FaultMistake(NTH_AND_EVERY(place=place), "every")
    fault = Fault(kind, given, name)
    begin, end = fault.get("from_s") or fault.get("at_s") or 0.0, fault.get("until_s")
    if isinstance(begin, float) and isinstance(end, float) and end < begin:
        raise FaultMistake(FAULT_ENDS_BEFORE_ITS_BEGIN(place=place, end=end, begin=begin), "until_s")
    return fault


NO_FAULT_IN_A_LINE = Message("simulation.no-fault-in-a-line", "a fault is {form}, such as {example!r}; kinds are {names}")
FAULT_WITHOUT_A_VALUE = Message("simulation.fault-without-a-value", "fault {line!r}: {word!r} is not NAME=VALUE")
PARAMETER_IS_GIVEN_TWICE = Message("simulation.parameter-is-given-twice", "fault {line!r}: {key} is given twice")


def read(line: str) -> Fault:
    """The fault in a line such as ``crc unit=1 nth=3``. `Misuse` as for `parse`."""
    words = line.split()
    if not words:
        raise Misuse(NO_FAULT_IN_A_LINE(form=GRAMMAR, example=EXAMPLE, names=list(KINDS)))
    mapping: dict[str, object] = {"kind": words[0]}
    kind = KINDS.get(words[0])
    for word in words[1:]:
        key, equals, text = word.partition("=")
        if not equals or not key:
            raise Misuse(FAULT_WITHOUT_A_VALUE(line=line, word=word))
        if key in mapping:
            raise Misuse(PARAMETER_IS_GIVEN_TWICE(line=line, key=key))
        parameter = kind.parameter(key) if kind is not None else None
        mapping[key] = text if parameter is None else _value(parameter, text)
    return parse(mapping)


def _value(parameter: Parameter, text: str) -> object:
    """A number where the text is one; everything else is for `check` to refuse."""
    if parameter.form in (ParameterForm.WHOLE, ParameterForm.NUMBER):
        with suppress(Misuse):
            return read_integer(text) if parameter.form is ParameterForm.WHOLE else read_number(text)
    return text


def schema() -> dict[str, object]:
    """JSON schema of a ``[[fault]]`` table of a TOML file."""
    return {"oneOf": [_object(kind) for kind in KINDS.values()]}


def _object(kind: FaultKind) -> dict[str, object]:
    properties: dict[str, object] = {"kind": {"const": kind.name, "description": kind.meaning}, "name": {"type": "string"}}
    properties |= {parameter.name: _property(parameter) for parameter in kind.parameters}
    required = ["kind", *(parameter.name for parameter in kind.parameters if parameter.is_required)]
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _property(parameter: Parameter) -> dict[str, object]:
    shown: dict[str, object] = {"description": parameter.meaning}
    numeric = {"minimum": parameter.least, "maximum": parameter.most}
    match parameter.form:
        case ParameterForm.WHOLE | ParameterForm.NUMBER:
            kind = "integer" if parameter.form is ParameterForm.WHOLE else "number"
            shown |= {"type": kind, **{key: bound for key, bound in numeric.items() if bound is not None}}
        case ParameterForm.SPAN:
            shown["type"] = ["integer", "string"]
        case _:
            shown["type"] = "string"
            if parameter.words:
                shown["enum"] = list(parameter.words)
    if parameter.default is not None:
        shown["default"] = parameter.default
    return shown
