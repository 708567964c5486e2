"""Completions and signatures of M1486 programs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from steptwin.diagnostics import Span
from steptwin.lsp.answers import Completion, CompletionKind, Completions, Signature
from steptwin.lsp.m1486 import texts
from steptwin.m1486.commands import TABLE, ArgType, CommandSpec, range_text, rows
from steptwin.m1486.functions import FUNCTIONS, USER_FLAGS, function, is_reserved
from steptwin.m1486.lines import LINES, SHARED_PINS, Interface
from steptwin.m1486.registers import REGISTERS, UPLOADS
from steptwin.m1486.variants import Variant

_COMMAND = re.compile(r"\s*(G[+-]|XG|[^\s0-9;])\s*(.*)", re.DOTALL | re.IGNORECASE)
_CONDITION = re.compile(r"\s*[0-9]+\s*[HL]\s*([0-9]*)\Z", re.IGNORECASE)
_ARGUMENTS = {
    ArgType.NUMBER: "number",
    ArgType.LABEL: "label",
    ArgType.ADDRESS: "address",
    ArgType.LINE: "line",
    ArgType.LINES: "lines",
    ArgType.FUNCTION: "function",
    ArgType.FLAG: "flag",
    ArgType.REGISTER: "register",
    ArgType.UPLOAD: "byte",
}


def items(line: str, column: int, start: int, labels: Mapping[str, str], around: tuple[Variant, Interface]) -> Completions:
    """The completions at a column of a line that begins at ``start``; ``labels`` are those there are, each with its text."""
    before = line[:column]
    if ";" in before:
        return Completions(())
    found = _COMMAND.match(before)
    if found is None:
        span = Span(start + len(before) - len(before.lstrip()), start + column)
        return Completions(tuple(_commands(span, around[0])) if not before.strip() else ())
    key, typed = found[1].upper(), found[2]
    if not rows(key):
        return Completions(())
    if not typed and before.endswith(found[1]):
        # The letter alone: another command may be meant, such as G+ after G.
        span = Span(start + found.start(1), start + column)
        more = [item for item in _commands(span, around[0]) if item.label.startswith(key)]
        return Completions((*more, *_numbers(key, Span(start + column, start + column), labels, around)))
    condition = _CONDITION.match(typed)
    if key == "I" and condition is not None:
        digits = condition[1]
        return Completions(tuple(_labels(Span(start + column - len(digits), start + column), labels)))
    digits = typed.strip()
    if digits and not digits.isdecimal():
        return Completions(())
    return Completions(tuple(_numbers(key, Span(start + column - len(digits), start + column), labels, around)))


def _commands(span: Span, variant: Variant) -> Iterator[Completion]:
    seen: set[str] = set()
    for spec in TABLE:
        if spec.key in seen:
            continue
        seen.add(spec.key)
        names = " / ".join(dict.fromkeys(row.name for row in rows(spec.key)))
        text = "\n\n".join(texts.letter_text(row, variant) for row in rows(spec.key))
        yield Completion(spec.key, CompletionKind.KEYWORD, span, names, text)


def _numbers(key: str, span: Span, labels: Mapping[str, str], around: tuple[Variant, Interface]) -> Iterator[Completion]:
    variant, interface = around
    for spec in rows(key):
        match spec.kind:
            case ArgType.LABEL if key != "@":
                yield from _labels(span, labels)
            case ArgType.LABEL:
                free = next((n for n in spec.permitted(variant) if str(n) not in labels), None)
                if free is not None:
                    yield Completion(str(free), CompletionKind.LABEL, span, "not used yet")
            case ArgType.LINE | ArgType.CONDITION:
                yield from _lines(span, interface)
            case ArgType.FUNCTION:
                for number in FUNCTIONS:
                    if not is_reserved(number):
                        yield Completion(
                            str(number), CompletionKind.FUNCTION, span, function(number).name, texts.function_text(number)
                        )
            case ArgType.FLAG:
                yield from (Completion(str(number), CompletionKind.VARIABLE, span, "user flag") for number in USER_FLAGS)
            case ArgType.REGISTER:
                yield from (
                    Completion(str(register.number), CompletionKind.REGISTER, span, register.name) for register in REGISTERS
                )
            case ArgType.UPLOAD:
                yield from (Completion(str(number), CompletionKind.VALUE, span, text) for number, text in UPLOADS.items())
            case _ if isinstance(spec.values, tuple) and spec.kind is ArgType.NUMBER:
                yield from (Completion(str(number), CompletionKind.VALUE, span, spec.name) for number in spec.values)
            case _:
                continue


def _labels(span: Span, labels: Mapping[str, str]) -> Iterator[Completion]:
    for label, text in labels.items():
        yield Completion(label, CompletionKind.LABEL, span, text, rank=0)


def _lines(span: Span, interface: Interface) -> Iterator[Completion]:
    for number in LINES:
        if number not in interface.occupied:
            yield Completion(str(number), CompletionKind.REGISTER, span, f"B{number}", SHARED_PINS.get(number, ""), rank=3)


def signature(line: str, column: int, variant: Variant) -> Signature | None:
    """Parameters of the command whose number is being typed."""
    before = line[:column]
    found = _COMMAND.match(before) if ";" not in before else None
    specs = rows(found[1].upper()) if found is not None else ()
    if found is None or not specs or specs[0].kind is ArgType.NONE:
        return None
    if specs[0].kind is ArgType.CONDITION:
        parameters = ["line or flag", "H or L", "label"]
        active = 0 if not re.search("[HL]", found[2], re.IGNORECASE) else 2
        return Signature(f"I {' '.join(parameters)}", f"Takes {range_text(specs[0], variant)}.", parameters, active)
    parameter = " or ".join(dict.fromkeys(_ARGUMENTS[spec.kind] for spec in specs))
    text = "\n\n".join(_takes(spec, variant) for spec in specs)
    return Signature(f"{specs[0].key} {parameter}", text, [parameter], 0)


def _takes(spec: CommandSpec, variant: Variant) -> str:
    return f"**{spec.name}** {spec.effect} Takes {range_text(spec, variant)}."
