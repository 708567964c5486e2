"""Faults read from a table of a TOML file or a line of text."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from steptwin.errors import Misuse
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


def parse(mapping: Mapping[str, object], place: str = "fault") -> Fault:
    """The fault in ``{"kind": "crc", "unit": 1, "nth": 3}``. `FaultMistake` names key, value, range, and ``place``."""
    word = mapping.get("kind")
    kind = KINDS.get(word) if isinstance(word, str) else None
    if kind is None:
        near = NearMiss().hint(word, KINDS) if isinstance(word, str) else ""
        raise FaultMistake(f"{place}: kind = {word!r}{near}: permitted are {', '.join(KINDS)}", "kind")
    name = mapping.get("name", "")
    if not isinstance(name, str) or " " in name or not name.isprintable():
        raise FaultMistake(f"{place}: name = {name!r}: permitted is text that can be printed, without blanks", "name")
    place = f"{place} ({kind.name})"
    given: dict[str, FaultValue] = {}
    for key, value in mapping.items():
        if key not in ("kind", "name"):
            parameter = kind.parameter(key)
            if parameter is None:
                names = ", ".join(parameter.name for parameter in kind.parameters)
                raise FaultMistake(f"{place}: there is no {key!r}: parameters are {names}", key)
            try:
                given[key] = check(parameter, value, f"{place}: {key}")
            except Misuse as error:
                raise FaultMistake(str(error), key) from None
    for parameter in kind.parameters:
        if parameter.is_required and parameter.name not in given:
            raise FaultMistake(f"{place}: {parameter.name} is missing: {parameter.meaning[:1].lower()}{parameter.meaning[1:]}")
    if "nth" in given and "every" in given:
        raise FaultMistake(f"{place}: nth and every exclude each other", "every")
    fault = Fault(kind, given, name)
    begin, end = fault.get("from_s") or fault.get("at_s") or 0.0, fault.get("until_s")
    if isinstance(begin, float) and isinstance(end, float) and end < begin:
        raise FaultMistake(f"{place}: until_s = {end:g} is before the fault begins at {begin:g} s", "until_s")
    return fault


def read(line: str) -> Fault:
    """The fault in a line such as ``crc unit=1 nth=3``. `Misuse` as for `parse`."""
    words = line.split()
    if not words:
        raise Misuse(f"a fault is {GRAMMAR}, such as {EXAMPLE!r}; kinds are {', '.join(KINDS)}")
    mapping: dict[str, object] = {"kind": words[0]}
    kind = KINDS.get(words[0])
    for word in words[1:]:
        key, equals, text = word.partition("=")
        if not equals or not key:
            raise Misuse(f"fault {line!r}: {word!r} is not NAME=VALUE")
        if key in mapping:
            raise Misuse(f"fault {line!r}: {key} is given twice")
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
