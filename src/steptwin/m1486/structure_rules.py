"""Rules on how the commands of one chip hang together: brackets, memory, labels, loops, what an EEPROM stores."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.m1486 import findings
from steptwin.m1486.commands import When, find, when
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.syntax import JumpCondition
from steptwin.m1486.variants import VARIANTS, Store, Variant

LOOP_LEVELS = 4
"""Levels of loop that work (M-5)."""


def structure_rules(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    yield from _brackets(stream)
    yield from _memory(stream, variant)
    yield from _resets(stream, variant)
    yield from _immediate(stream)
    yield from _loops(stream, variant)
    for index, command in enumerate(stream.commands):
        label = written_label(command)
        if label is not None and find("J", label, variant) is not None:
            yield from label_problem(stream, index, label, variant)
            yield from _crossing(stream, index, label)
    if variant.store is Store.EEPROM:
        yield from _stored_file(stream)


def label_problem(stream: CommandStream, index: int, label: int, variant: Variant) -> Iterator[Diagnostic]:
    """Why the command at ``index`` does not find ``label``."""
    command = stream.commands[index]
    span = command.argument.label_span if isinstance(command.argument, JumpCondition) else command.argument_span
    target = stream.resolve(index, label)
    if target is not None:
        if bits := _overwritten(stream, index, target, variant):
            message = f"label {label} lies {bits} bits back and has been overwritten"
            yield findings.LABEL_OVERWRITTEN(span, message, f"the memory of {variant.title} holds {variant.memory_bits} bits")
        return
    later = [at for at in stream.labels.get(label, ()) if at > index and stream.resets[at] == stream.resets[index]]
    if later:
        hint = "enclose both in [ ]" if stream.in_file[index] is None else "it follows the ] that runs this file"
        yield findings.LABEL_NOT_THERE_YET(span, f"label {label} is defined later than this command runs", hint)
        return
    known = sorted(stream.visible_labels(index))
    hint = f"labels there are: {', '.join(map(str, known))}" if known else "there are no labels"
    yield findings.NO_SUCH_LABEL(span, f"there is no label {label}", hint)


def _overwritten(stream: CommandStream, index: int, target: int, variant: Variant) -> int:
    """How many bits back ``target`` lies if the ring has overwritten it when the command at ``index`` runs; otherwise 0 (M-12).

    Of a file that does not fit at all, only that is reported.
    """
    number = stream.in_file[index]
    if number is not None and stream.files[number].bits > variant.memory_bits:
        return 0
    bits = stream.bits_since(target, index)
    return bits if bits > variant.memory_bits else 0


def _brackets(stream: CommandStream) -> Iterator[Diagnostic]:
    for index in stream.nested_opens:
        span = stream.commands[index].span
        yield findings.FILE_IN_FILE(span, "[ inside [ ]", "close the first file with ]", Fix(span, ""))
    for index in stream.lone_closes:
        span = stream.commands[index].span
        yield findings.FILE_NOT_OPEN(span, "] without [", "[ begins what ] runs", Fix(span, ""))
    for file in stream.files:
        if file.closes is None:
            end = stream.commands[-1].span.end
            fix = Fix(Span(end, end), "\n]")
            yield findings.FILE_NOT_CLOSED(stream.commands[file.opens].span, "[ without ]", "] runs what [ began", fix)


def _memory(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    for file in stream.files:
        if file.bits > variant.memory_bits:
            larger = [v.title for v in VARIANTS if v.clock == variant.clock and v.memory_bits >= file.bits]
            hint = f"at most {variant.memory_bits} bits on {variant.title}"
            if larger:
                hint += f"; it fits {', '.join(larger)}"
            yield findings.FILE_TOO_LARGE(stream.commands[file.opens].span, f"this file takes {file.bits} bits", hint)


def _resets(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    alone = all(command.key == "\\" for command in stream.commands)
    for index, command in enumerate(stream.commands):
        if command.key != "\\":
            continue
        if stream.in_file[index] is not None:
            yield findings.RESET_IN_FILE(command.span, "reset inside [ ]", "send it before [")
        elif variant.store is Store.EEPROM and not alone:
            seconds = variant.erase_ns // 1_000_000_000
            hint = f"send it alone and wait {seconds} s: {variant.title} erases its EEPROM"
            yield findings.RESET_WITH_OTHERS(command.span, "reset together with other commands", hint)


def _immediate(stream: CommandStream) -> Iterator[Diagnostic]:
    for index, command in enumerate(stream.commands):
        if stream.in_file[index] is not None and when(command.key, command.number) is When.RECEIVED:
            yield findings.ACTS_AT_ONCE(command.span, f"{command} inside [ ] acts while the file is being sent, once")


def _loops(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    for index in stream.open_loops:
        yield findings.LOOP_OPEN(stream.commands[index].span, "L without E", "E ends what L repeats")
    for index in stream.lone_ends:
        span = stream.commands[index].span
        yield findings.LOOP_END_ALONE(span, "E without L", "L begins what E ends", Fix(span, ""))
    for index, depth in stream.depth.items():
        if depth > LOOP_LEVELS:
            hint = f"at most {LOOP_LEVELS} levels"
            yield findings.LOOPS_TOO_DEEP(stream.commands[index].span, f"loop on level {depth}", hint)
        elif depth > 1:
            yield findings.LOOPS_NESTED(stream.commands[index].span, f"loop on level {depth}", "the manual shows one level")
    for end, begin in stream.loops.items():
        if bits := _overwritten(stream, end, begin, variant):
            message = f"the loop begins {bits} bits back and has been overwritten"
            hint = f"the memory of {variant.title} holds {variant.memory_bits} bits"
            yield findings.LABEL_OVERWRITTEN(stream.commands[end].span, message, hint)


def _crossing(stream: CommandStream, index: int, label: int) -> Iterator[Diagnostic]:
    target = stream.resolve(index, label)
    if target is None:
        return
    command = stream.commands[index]
    here, there = set(stream.loops_around(index)), set(stream.loops_around(target))
    if there - here:
        yield findings.LOOP_CROSSED(command.span, f"{command} leads into a loop from outside", "its E would find no L")
    elif here - there and command.key != "'":
        yield findings.LOOP_CROSSED(command.span, f"{command} leads out of a loop", "the loop stays unfinished")


def _stored_file(stream: CommandStream) -> Iterator[Diagnostic]:
    outside = [c for i, c in enumerate(stream.commands) if stream.in_file[i] is None and c.key not in "[]\\K"]
    if outside:
        count = "1 command stands" if len(outside) == 1 else f"{len(outside)} commands stand"
        hint = "an EEPROM file begins with [ and ends with ]"
        yield findings.NOT_IN_FILE(outside[0].span, f"{count} outside [ ] and will not run at power-up", hint)
    for file in stream.files[1:]:
        hint = "erase with \\ first, sent alone"
        yield findings.SECOND_FILE(stream.commands[file.opens].span, "a second file for the same EEPROM", hint)
