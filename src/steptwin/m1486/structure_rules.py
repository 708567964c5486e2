"""Structural rules of one chip's program: brackets, memory, labels, loops, what an EEPROM stores."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.m1486 import findings
from steptwin.m1486.commands import When, find, when
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.syntax import JumpCondition
from steptwin.m1486.variants import VARIANTS, Store, Variant
from steptwin.messages import Message

LABELS_THERE_ARE = Message("m1486.labels-there-are", "labels there are: {known}")
THERE_ARE_NO_LABELS = Message("m1486.there-are-no-labels", "there are no labels")
EEPROM_FILE = Message("m1486.eeprom-file", "an EEPROM file begins with [ and ends with ]")
ERASE_FIRST = Message("m1486.erase-first", "erase with \\ first, sent alone")
LABEL_IS_OVERWRITTEN = Message("m1486.label-is-overwritten", "label {label} lies {bits} bits back and has been overwritten")
ENCLOSE_BOTH = Message("m1486.enclose-both", "enclose both in [ ]")
FOLLOWS_THE_FILE = Message("m1486.follows-the-file", "it follows the ] that runs this file")
THERE_IS_NO_LABEL = Message("m1486.there-is-no-label", "there is no label {label}")
AT_MOST_LEVELS = Message("m1486.at-most-levels", "at most {most} levels")
LOOP_IS_OVERWRITTEN = Message("m1486.loop-begins-too-far-back", "the loop begins {bits} bits back and has been overwritten")
MEMORY_HOLDS = Message("m1486.memory-holds", "the memory of {title} holds {bits} bits")
ONE_COMMAND_IS_OUTSIDE = Message("m1486.one-command-is-outside", "1 command stands outside [ ] and will not run at power-up")
COMMANDS_ARE_OUTSIDE = Message("m1486.commands-are-outside", "{count} commands stand outside [ ] and will not run at power-up")
LABEL_IS_DEFINED_LATER = Message("m1486.label-is-defined-later", "label {label} is defined later than this command runs")
FILE_INSIDE_FILE = Message("m1486.file-inside-file", "[ inside [ ]")
CLOSE_THE_FIRST_FILE = Message("m1486.close-the-first-file", "close the first file with ]")
CLOSE_WITHOUT_OPEN = Message("m1486.close-without-open", "] without [")
OPEN_BEGINS_WHAT_CLOSE_RUNS = Message("m1486.open-begins-what-close-runs", "[ begins what ] runs")
FILE_FITS_OTHERS = Message("m1486.file-fits-others", "at most {most} bits on {title}; it fits {larger}")
AT_MOST_BITS_ON = Message("m1486.at-most-bits-on", "at most {most} bits on {title}")
SEND_IT_ALONE = Message("m1486.send-it-alone", "send it alone and wait {seconds} s: {title} erases its EEPROM")
L_WITHOUT_E = Message("m1486.l-without-e", "L without E")
E_ENDS_WHAT_L_REPEATS = Message("m1486.e-ends-what-l-repeats", "E ends what L repeats")
E_WITHOUT_L = Message("m1486.e-without-l", "E without L")
L_BEGINS_WHAT_E_ENDS = Message("m1486.l-begins-what-e-ends", "L begins what E ends")
LEADS_INTO_A_LOOP_FROM_OUTSIDE = Message("m1486.leads-into-a-loop-from-outside", "{command} leads into a loop from outside")
ITS_E_WOULD_FIND_NO_L = Message("m1486.its-e-would-find-no-l", "its E would find no L")
SECOND_FILE = Message("m1486.second-file", "a second file for the same EEPROM")
OPEN_WITHOUT_CLOSE = Message("m1486.open-without-close", "[ without ]")
CLOSE_RUNS_WHAT_OPEN_BEGAN = Message("m1486.close-runs-what-open-began", "] runs what [ began")
FILE_TAKES = Message("m1486.file-takes", "this file takes {bits} bits")
RESET_INSIDE_FILE = Message("m1486.reset-inside-file", "reset inside [ ]")
SEND_IT_BEFORE = Message("m1486.send-it-before", "send it before [")
ACTS_WHILE_SENT = Message("m1486.acts-while-sent", "{command} inside [ ] acts while the file is being sent, once")
LOOP_ON_LEVEL = Message("m1486.loop-on-level", "loop on level {depth}")
LEADS_OUT_OF_A_LOOP = Message("m1486.leads-out-of-a-loop", "{command} leads out of a loop")
LOOP_STAYS_UNFINISHED = Message("m1486.loop-stays-unfinished", "the loop stays unfinished")
RESET_WITH_OTHERS = Message("m1486.reset-with-others", "reset together with other commands")
MANUAL_SHOWS_ONE_LEVEL = Message("m1486.manual-shows-one-level", "the manual shows one level")

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
            message = LABEL_IS_OVERWRITTEN(label=label, bits=bits)
            yield findings.LABEL_OVERWRITTEN(span, message, MEMORY_HOLDS(title=variant.title, bits=variant.memory_bits))
        return
    later = [at for at in stream.labels.get(label, ()) if at > index and stream.resets[at] == stream.resets[index]]
    if later:
        hint = ENCLOSE_BOTH() if stream.in_file[index] is None else FOLLOWS_THE_FILE()
        yield findings.LABEL_NOT_THERE_YET(span, LABEL_IS_DEFINED_LATER(label=label), hint)
        return
    known = sorted(stream.visible_labels(index))
    hint = LABELS_THERE_ARE(known=known) if known else THERE_ARE_NO_LABELS()
    yield findings.NO_SUCH_LABEL(span, THERE_IS_NO_LABEL(label=label), hint)


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
        yield findings.FILE_IN_FILE(span, FILE_INSIDE_FILE(), CLOSE_THE_FIRST_FILE(), Fix(span, ""))
    for index in stream.lone_closes:
        span = stream.commands[index].span
        yield findings.FILE_NOT_OPEN(span, CLOSE_WITHOUT_OPEN(), OPEN_BEGINS_WHAT_CLOSE_RUNS(), Fix(span, ""))
    for file in stream.files:
        if file.closes is None:
            end = stream.commands[-1].span.end
            fix = Fix(Span(end, end), "\n]")
            yield findings.FILE_NOT_CLOSED(
                stream.commands[file.opens].span, OPEN_WITHOUT_CLOSE(), CLOSE_RUNS_WHAT_OPEN_BEGAN(), fix
            )


def _memory(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    for file in stream.files:
        if file.bits > variant.memory_bits:
            larger = [v.title for v in VARIANTS if v.clock == variant.clock and v.memory_bits >= file.bits]
            most, title = variant.memory_bits, variant.title
            hint = FILE_FITS_OTHERS(most=most, title=title, larger=larger) if larger else AT_MOST_BITS_ON(most=most, title=title)
            yield findings.FILE_TOO_LARGE(stream.commands[file.opens].span, FILE_TAKES(bits=file.bits), hint)


def _resets(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    alone = all(command.key == "\\" for command in stream.commands)
    for index, command in enumerate(stream.commands):
        if command.key != "\\":
            continue
        if stream.in_file[index] is not None:
            yield findings.RESET_IN_FILE(command.span, RESET_INSIDE_FILE(), SEND_IT_BEFORE())
        elif variant.store is Store.EEPROM and not alone:
            seconds = variant.erase_ns // 1_000_000_000
            hint = SEND_IT_ALONE(seconds=seconds, title=variant.title)
            yield findings.RESET_WITH_OTHERS(command.span, RESET_WITH_OTHERS(), hint)


def _immediate(stream: CommandStream) -> Iterator[Diagnostic]:
    for index, command in enumerate(stream.commands):
        if stream.in_file[index] is not None and when(command.key, command.number) is When.RECEIVED:
            yield findings.ACTS_AT_ONCE(command.span, ACTS_WHILE_SENT(command=command))


def _loops(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    for index in stream.open_loops:
        yield findings.LOOP_OPEN(stream.commands[index].span, L_WITHOUT_E(), E_ENDS_WHAT_L_REPEATS())
    for index in stream.lone_ends:
        span = stream.commands[index].span
        yield findings.LOOP_END_ALONE(span, E_WITHOUT_L(), L_BEGINS_WHAT_E_ENDS(), Fix(span, ""))
    for index, depth in stream.depth.items():
        if depth > LOOP_LEVELS:
            hint = AT_MOST_LEVELS(most=LOOP_LEVELS)
            yield findings.LOOPS_TOO_DEEP(stream.commands[index].span, LOOP_ON_LEVEL(depth=depth), hint)
        elif depth > 1:
            yield findings.LOOPS_NESTED(stream.commands[index].span, LOOP_ON_LEVEL(depth=depth), MANUAL_SHOWS_ONE_LEVEL())
    for end, begin in stream.loops.items():
        if bits := _overwritten(stream, end, begin, variant):
            message = LOOP_IS_OVERWRITTEN(bits=bits)
            hint = MEMORY_HOLDS(title=variant.title, bits=variant.memory_bits)
            yield findings.LABEL_OVERWRITTEN(stream.commands[end].span, message, hint)


def _crossing(stream: CommandStream, index: int, label: int) -> Iterator[Diagnostic]:
    target = stream.resolve(index, label)
    if target is None:
        return
    command = stream.commands[index]
    here, there = set(stream.loops_around(index)), set(stream.loops_around(target))
    if there - here:
        yield findings.LOOP_CROSSED(command.span, LEADS_INTO_A_LOOP_FROM_OUTSIDE(command=command), ITS_E_WOULD_FIND_NO_L())
    elif here - there and command.key != "'":
        yield findings.LOOP_CROSSED(command.span, LEADS_OUT_OF_A_LOOP(command=command), LOOP_STAYS_UNFINISHED())


def _stored_file(stream: CommandStream) -> Iterator[Diagnostic]:
    outside = [c for i, c in enumerate(stream.commands) if stream.in_file[i] is None and c.key not in "[]\\K"]
    if outside:
        count = len(outside)
        message = ONE_COMMAND_IS_OUTSIDE() if count == 1 else COMMANDS_ARE_OUTSIDE(count=count)
        hint = EEPROM_FILE()
        yield findings.NOT_IN_FILE(outside[0].span, message, hint)
    for file in stream.files[1:]:
        hint = ERASE_FIRST()
        yield findings.SECOND_FILE(stream.commands[file.opens].span, SECOND_FILE(), hint)
