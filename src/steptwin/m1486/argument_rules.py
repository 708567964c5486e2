"""Rules for the number of a single command: permitted, reserved, a free line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from steptwin.diagnostics import Diagnostic, Fix
from steptwin.m1486 import findings
from steptwin.m1486.commands import ArgType, CommandSpec, find, grouped, permitted_text, range_text, rows
from steptwin.m1486.commanduse import ChipState, Wait
from steptwin.m1486.functions import CARRY, is_reserved
from steptwin.m1486.lines import LINES, Interface
from steptwin.m1486.registers import UPLOADS
from steptwin.m1486.structure import is_computed
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import VARIANTS, Variant

_INSTEAD_OF_ZERO = {"=": "C100", "G": "H"}
"""Zero is no distance and no position; other commands express the intention."""


def free_labels(commands: Iterable[ChipCommand], variant: Variant) -> Mapping[int, int]:
    """For labels that the variant does not have others that are free; empty if there are too few, or labels are computed."""
    used: set[int] = set()
    for command in commands:
        if is_computed(command):
            return {}
        if isinstance(command.argument, JumpCondition):
            used.add(command.argument.label)
        elif command.number is not None and rows(command.key)[0].kind is ArgType.LABEL:
            used.add(command.number)
    wrong = sorted(label for label in used if label > variant.labels)
    free = [label for label in range(1, variant.labels + 1) if label not in used]
    return dict(zip(wrong, free, strict=False)) if len(wrong) <= len(free) else {}


def argument_rules(
    command: ChipCommand, variant: Variant, interface: Interface, labels: Mapping[int, int]
) -> Iterator[Diagnostic]:
    """Findings about the number written in the command. ``labels``: see `free_labels`."""
    number = command.number
    if number is None:
        return
    problem = number_problem(command, number, variant, interface)
    if problem is not None:
        is_label = rows(command.key)[0].kind is ArgType.LABEL and number in labels
        yield replace(problem, fix=Fix(command.argument_span, str(labels[number]))) if is_label else problem
    if isinstance(command.argument, JumpCondition):
        yield from _label_of_condition(command.argument, variant, labels)


def number_problem(command: ChipCommand, number: int, variant: Variant, interface: Interface) -> Diagnostic | None:
    """The error of ``number`` as the argument of the command, written or from the internal variable."""
    spec = find(command.key, number, variant)
    if spec is None:
        return _out_of_range(command, number, variant)
    return _reserved(command, spec, number) or _occupied(command, spec, number, interface)


def lines_text(lines: range | list[int]) -> str:
    return ", ".join(f"B{line}" for line in lines)


def _out_of_range(command: ChipCommand, number: int, variant: Variant) -> Diagnostic:
    key = command.key
    hint = permitted_text(key, variant)
    fix = None
    subject = f"{key} {grouped(number)}"
    kind = rows(key)[0].kind
    if kind in (ArgType.LABEL, ArgType.ADDRESS):
        subject = f"label {grouped(number)}" if kind is ArgType.LABEL else f"address {number:X}"
        hint += f" on {variant.title}{_others_that_take(key, number, variant)}"
    elif number == CARRY and any(spec.kind is ArgType.FLAG for spec in rows(key)):
        hint = f"flag {CARRY}, the carry, is set and cleared by + and - only; {hint}"
    elif kind is ArgType.LINES:
        hint = f"{_lines_reached(number)}; {hint}"
    elif number == 0 and key in _INSTEAD_OF_ZERO:
        fix = Fix(command.span, _INSTEAD_OF_ZERO[key])
    elif kind is ArgType.NUMBER:
        fix = _nearest(command, number, variant)
    return findings.OUT_OF_RANGE(command.argument_span, f"{subject} is out of range", hint, fix)


def _nearest(command: ChipCommand, number: int, variant: Variant) -> Fix | None:
    """The end of the range that a number is beyond."""
    permitted = rows(command.key)[0].permitted(variant)
    if len(rows(command.key)) > 1 or not isinstance(permitted, range):
        return None
    return Fix(command.argument_span, str(permitted[0] if number < permitted[0] else permitted[-1]))


def _lines_reached(number: int) -> str:
    """What a number that names no lines would name."""
    first, count = divmod(number, 10)
    if count == 0:
        return f"no line: the count in {number} is 0"
    if count == 1:
        return f"{number} is line {first}"
    return f"{number} is lines {first} to {first + count - 1}"


def _others_that_take(key: str, number: int, variant: Variant) -> str:
    others = [v.title for v in VARIANTS if v.clock == variant.clock and find(key, number, v)]
    return f"; {', '.join(others)} would take it" if others else ""


def _label_of_condition(condition: JumpCondition, variant: Variant, labels: Mapping[int, int]) -> Iterator[Diagnostic]:
    if find("J", condition.label, variant) is None:
        hint = f"{range_text(rows('J')[0], variant)} on {variant.title}{_others_that_take('J', condition.label, variant)}"
        fix = Fix(condition.label_span, str(labels[condition.label])) if condition.label in labels else None
        yield findings.OUT_OF_RANGE(condition.label_span, f"label {grouped(condition.label)} is out of range", hint, fix)


def _reserved(command: ChipCommand, spec: CommandSpec, number: int) -> Diagnostic | None:
    if spec.kind is ArgType.FUNCTION and is_reserved(number):
        return findings.RESERVED(command.argument_span, f"function {number} is reserved", "the manual gives it no meaning")
    if spec.kind is ArgType.UPLOAD and number not in UPLOADS:
        known = ", ".join(map(str, UPLOADS))
        return findings.RESERVED(command.argument_span, f"byte {number} is reserved", f"bytes with a meaning are {known}")
    return None


def _occupied(command: ChipCommand, spec: CommandSpec, number: int, interface: Interface) -> Diagnostic | None:
    taken = [line for line in spec.lines(number) if line in interface.occupied]
    if not taken:
        return None
    # M-21: commands that write such a line, or wait for it, are refused; reading it is possible and of no use.
    refuses = ChipState.LINES in spec.use.writes or spec.use.waits in (Wait.LINE, Wait.SEEK)
    finding = findings.LINE_OCCUPIED if refuses else findings.LINE_READ_OCCUPIED
    free = lines_text([line for line in LINES if line not in interface.occupied])
    verb = "belongs" if len(taken) == 1 else "belong"
    message = f"{lines_text(taken)} {verb} to the {interface.title} interface"
    return finding(command.argument_span, message, f"free lines are {free}")
