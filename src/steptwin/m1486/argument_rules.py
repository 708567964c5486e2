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
from steptwin.messages import Message, MessageText

IS_OUT_OF_RANGE = Message("m1486.is-out-of-range", "{argument} is out of range")
IS_LINES_TO = Message("m1486.is-lines-to", "{number} is lines {first} to {last}")
NO_LINE = Message("m1486.no-line", "no line: the count in {number} is 0")
IS_LINE = Message("m1486.is-line", "{number} is line {first}")
FREE_LINES_ARE = Message("m1486.free-lines-are", "free lines are {free}")
BOTH = Message("m1486.both", "{one}; {other}")
ON_OTHERS = Message("m1486.on-others", "{permitted} on {title}; {others} would take it")
ON = Message("m1486.on", "{permitted} on {title}")
BELONGS_TO_INTERFACE = Message("m1486.belongs-to-interface", "{lines} belongs to the {title} interface")
BELONG_TO_INTERFACE = Message("m1486.belong-to-interface", "{lines} belong to the {title} interface")
LABEL_IS_OUT_OF_RANGE = Message("m1486.label-is-out-of-range", "label {label} is out of range")
ADDRESS_IS_OUT_OF_RANGE = Message("m1486.address-is-out-of-range", "address {number:X} is out of range")
CARRY_IS_SET_BY_ARITHMETIC = Message(
    "m1486.carry-is-set-by-arithmetic", "flag {carry}, the carry, is set and cleared by + and - only; {hint}"
)
FUNCTION_IS_RESERVED = Message("m1486.function-is-reserved", "function {number} is reserved")
NO_MEANING = Message("m1486.no-meaning", "the manual gives it no meaning")
BYTE_IS_RESERVED = Message("m1486.byte-is-reserved", "byte {number} is reserved")
BYTES_WITH_A_MEANING = Message("m1486.bytes-with-a-meaning", "bytes with a meaning are {known}")

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
    message = IS_OUT_OF_RANGE(argument=f"{key} {grouped(number)}")
    kind = rows(key)[0].kind
    if kind in (ArgType.LABEL, ArgType.ADDRESS):
        is_label = kind is ArgType.LABEL
        message = LABEL_IS_OUT_OF_RANGE(label=grouped(number)) if is_label else ADDRESS_IS_OUT_OF_RANGE(number=number)
        hint = _on(hint, key, number, variant)
    elif number == CARRY and any(spec.kind is ArgType.FLAG for spec in rows(key)):
        hint = CARRY_IS_SET_BY_ARITHMETIC(carry=CARRY, hint=hint)
    elif kind is ArgType.LINES:
        hint = BOTH(one=_lines_reached(number), other=hint)
    elif number == 0 and key in _INSTEAD_OF_ZERO:
        fix = Fix(command.span, _INSTEAD_OF_ZERO[key])
    elif kind is ArgType.NUMBER:
        fix = _nearest(command, number, variant)
    return findings.OUT_OF_RANGE(command.argument_span, message, hint, fix)


def _nearest(command: ChipCommand, number: int, variant: Variant) -> Fix | None:
    """The end of the range that a number is beyond."""
    permitted = rows(command.key)[0].permitted(variant)
    if len(rows(command.key)) > 1 or not isinstance(permitted, range):
        return None
    return Fix(command.argument_span, str(permitted[0] if number < permitted[0] else permitted[-1]))


def _lines_reached(number: int) -> MessageText:
    """Name for a number that names no lines."""
    first, count = divmod(number, 10)
    if count == 0:
        return NO_LINE(number=number)
    if count == 1:
        return IS_LINE(number=number, first=first)
    return IS_LINES_TO(number=number, first=first, last=first + count - 1)


def _on(permitted: MessageText, key: str, number: int, variant: Variant) -> MessageText:
    """Permitted numbers of the variant, and the variants that would take the number."""
    title = variant.title
    others = [v.title for v in VARIANTS if v.clock == variant.clock and find(key, number, v)]
    return ON_OTHERS(permitted=permitted, title=title, others=others) if others else ON(permitted=permitted, title=title)


def _label_of_condition(condition: JumpCondition, variant: Variant, labels: Mapping[int, int]) -> Iterator[Diagnostic]:
    if find("J", condition.label, variant) is None:
        hint = _on(range_text(rows("J")[0], variant), "J", condition.label, variant)
        fix = Fix(condition.label_span, str(labels[condition.label])) if condition.label in labels else None
        yield findings.OUT_OF_RANGE(condition.label_span, LABEL_IS_OUT_OF_RANGE(label=grouped(condition.label)), hint, fix)


def _reserved(command: ChipCommand, spec: CommandSpec, number: int) -> Diagnostic | None:
    if spec.kind is ArgType.FUNCTION and is_reserved(number):
        return findings.RESERVED(command.argument_span, FUNCTION_IS_RESERVED(number=number), NO_MEANING())
    if spec.kind is ArgType.UPLOAD and number not in UPLOADS:
        known = list(UPLOADS)
        return findings.RESERVED(command.argument_span, BYTE_IS_RESERVED(number=number), BYTES_WITH_A_MEANING(known=known))
    return None


def _occupied(command: ChipCommand, spec: CommandSpec, number: int, interface: Interface) -> Diagnostic | None:
    taken = [line for line in spec.lines(number) if line in interface.occupied]
    if not taken:
        return None
    # M-21: commands that write such a line, or wait for it, are refused; reading it is possible and of no use.
    refuses = ChipState.LINES in spec.use.writes or spec.use.waits in (Wait.LINE, Wait.SEEK)
    finding = findings.LINE_OCCUPIED if refuses else findings.LINE_READ_OCCUPIED
    free = lines_text([line for line in LINES if line not in interface.occupied])
    message = BELONGS_TO_INTERFACE if len(taken) == 1 else BELONG_TO_INTERFACE
    return finding(command.argument_span, message(lines=lines_text(taken), title=interface.title), FREE_LINES_ARE(free=free))
