"""Rules for the paths of a program: moves that cannot start, numbers from the internal variable, unreachable code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby

from steptwin.diagnostics import Diagnostic, Fix, Severity, Span
from steptwin.m1486 import findings
from steptwin.m1486.argument_rules import BELONG_TO_INTERFACE, FREE_LINES_ARE, lines_text, number_problem
from steptwin.m1486.commands import (
    CALCULATING,
    DIVIDEND_LIMIT,
    FREE_DIVISORS,
    PROFILE_RANGE,
    TO,
    ArgType,
    When,
    find,
    grouped,
    rows,
    when,
)
from steptwin.m1486.commanduse import ChipState, Control, Motion
from steptwin.m1486.findings import ChipFinding
from steptwin.m1486.flow import FlowAnalysis, Settings, follow, value
from steptwin.m1486.lines import LINES, RUNSIGN_LINE, Interface, line_group
from steptwin.m1486.microsteps import HIGHEST_SPEED, PAIRS, UNIT, low_range_limit, microstep_size
from steptwin.m1486.registers import GENERAL
from steptwin.m1486.structure import CommandStream, is_computed, written_label
from steptwin.m1486.structure_rules import label_problem
from steptwin.m1486.successors import flow_of
from steptwin.m1486.syntax import ChipCommand
from steptwin.m1486.variants import Variant
from steptwin.messages import Message, MessageText, text_of

SIZE_OF_MICROSTEP = Message("m1486.size-of-microstep", "with M{microstep} a microstep is {size} minimum microsteps")
WITH_MICROSTEP_GO = Message("m1486.with-microstep-go", "with M{microstep} go {names}")
V_IS_NOT_ABOVE_S = Message("m1486.v-is-not-above-s", "V {velocity} is not above S {start_stop}")
V_IS_ABOVE_HIGHEST = Message(
    "m1486.v-is-above-highest", "V {velocity} is above {highest} step/s, the highest speed with Q{qualification}"
)
ENDS_IN_FINE_STEPS = Message(
    "m1486.ends-in-fine-steps",
    "the distance {distance} ends in steps of M{m} at {speed} step/s, above the {limit:g} step/s of M{m}",
)
P_IS_BETWEEN = Message("m1486.p-is-between", "P {profile} is above {high} and not above V {velocity}")
PROFILES = Message("m1486.profiles", "{low} to {high} step/s, or above V for no parabolic part")
A_IS_LARGE = Message(
    "m1486.a-is-large", "A {acceleration} is large for S {start_stop}; the table of permitted pairs is not available"
)
SAFE_ACCELERATION = Message("m1486.safe-acceleration", "up to {times} times S is taken to be safe")
AT_MOST_EXCEPT_FOR = Message("m1486.at-most-except-for", "at most {most}, except for {divisors}")
THE_DISTANCE = Message("m1486.the-distance", "the distance")
IS_NOT_A_MULTIPLE_OF = Message("m1486.is-not-a-multiple-of", "{what} {distance} is not a multiple of {size}")
NO_PAIR = Message("m1486.no-pair", "M{microstep} does not permit Q{qualification}")
NO_RAMP = Message("m1486.no-ramp", "the move runs at V without a ramp")
Q1_REACHES_V = Message("m1486.q1-reaches-v", "Q1 goes as far as V")
COARSE_STEPS = Message(
    "m1486.coarse-steps", "a multiple of {coarse} is made in steps of Q{q}; S up to {limit:g} step/s goes with any distance"
)
VARIABLE_IS = Message("m1486.variable-is", "the internal variable is {variable}")
WRITES_RUNSIGN_LINE = Message("m1486.writes-runsign-line", "{command} writes B{line} while function 40 (Runsign) is ON")
ON_SOME_PATHS = Message("m1486.on-some-paths", "on some paths {message}")
BOTH_OPERANDS = Message("m1486.both-operands", "functions 46 and 58 are both ON")
OPERAND_COMES_FROM_THE_LINES = Message("m1486.operand-comes-from-the-lines", "the operand comes from the lines")
GROUPS_OF_LINES = Message("m1486.groups-of-lines", "first line and count, such as 14 for lines 1 to 4, up to line 21")
IS_NOT_AN_OPERAND_REGISTER = Message(
    "m1486.is-not-an-operand-register", "{number} is not an operand register, and function 58 is ON"
)
STARTED_AGAIN = Message(
    "m1486.started-again", "the file comes to its end from label {label} and finds this J behind it, again and again"
)
REGISTERS_ARE_SHARED = Message(
    "m1486.registers-are-shared", "on {title} the registers lie in the last {bits} bits of the command memory"
)
SAFE_AFTER_RESET = Message(
    "m1486.safe-after-reset", "safe with \\ as the first command and at most {limit} bits; these are {bits} bits"
)
NAMES_NO_LINES = Message("m1486.names-no-lines", "{number} names no lines, and function 46 is ON")
VARIABLE_CAN_GIVE = Message("m1486.variable-can-give", "the internal variable can give: {message}")
C40_GIVES_THE_LINE_BACK = Message("m1486.c40-gives-the-line-back", "C40 gives the line back")
INSIDE_A_SUBROUTINE = Message("m1486.inside-a-subroutine", "{command} inside a subroutine")
ONE_LEVEL_ONLY = Message("m1486.one-level-only", "one level only")
DOT_WITHOUT_A_CALL = Message("m1486.dot-without-a-call", "this dot is reached without a call")
JUMP_OVER_THE_SUBROUTINE = Message("m1486.jump-over-the-subroutine", "jump over the subroutine")
DOES_NOT_COME_BACK = Message("m1486.does-not-come-back", "{command} does not come back")
SUBROUTINE_ENDS_WITH_A_DOT = Message("m1486.subroutine-ends-with-a-dot", "a subroutine ends with a dot")
LABEL_IS_GIVEN_TWICE = Message("m1486.label-is-given-twice", "label {label} is given a second time")
NEVER_REACHED_ONE = Message("m1486.never-reached-one", "this command is never reached")
NEVER_REACHED_MORE = Message("m1486.never-reached-more", "these {count} commands are never reached")
VARIABLE_GIVES = Message("m1486.variable-may-give", "the internal variable gives: {message}")
END_WITH_A_LOOP = Message("m1486.end-with-a-loop", "end it with a loop, such as @9 W1000 J9, which wrong data end")
NOTHING_JUMPS_TO_LABEL = Message("m1486.nothing-jumps-to-label", "nothing jumps to label {label}")
LATER_ONE_COUNTS = Message("m1486.later-one-counts", "the later one counts")

ACCELERATION_PER_START_STOP = 65
"""Ratio of acceleration to start/stop speed above which the missing table would be needed (M-4)."""

_Fault = tuple[ChipFinding, MessageText, MessageText | None]
"""An error because of a setting: the finding, the message, the hint."""
_Rule = Callable[[ChipCommand, Settings], _Fault | None]


def flow_rules(stream: CommandStream, variant: Variant, interface: Interface) -> Iterator[Diagnostic]:
    flow = follow(stream, variant, interface)
    for index, states in sorted(flow.states.items()):
        command = stream.commands[index]
        for rule in _RULES:
            yield from _judge(command, states, rule)
        if _calculates(command):
            yield from _judge(command, states, lambda c, s: _operand(c, s, interface))
        if command.from_variable:
            yield from _from_variable(stream, index, states, variant, interface)
        if ChipState.LINES in command.use.writes:
            yield from _runsign(command, states, variant)
    yield from _calls(stream, flow)
    yield from _labels(stream, flow)
    yield from _never_reached(stream, flow)
    yield from _started_again(stream, variant, interface)
    yield from _shared_registers(stream, flow, variant)


def _calculates(command: ChipCommand) -> bool:
    return rows(command.key)[0].name in CALCULATING


def _judge(command: ChipCommand, states: set[Settings], rule: _Rule) -> Iterator[Diagnostic]:
    """An error if it occurs with every setting, else a warning if it can occur."""
    faults = [rule(command, state) for state in states]
    found = sorted({fault for fault in faults if fault is not None}, key=lambda fault: fault[1])
    if not found:
        return
    finding, message, hint = found[0]
    if finding.severity is Severity.ERROR and None in faults:
        finding, message = findings.MAY_FAIL, ON_SOME_PATHS(message=message)
    span = command.span if command.number is None else command.argument_span
    fix = None
    if finding is findings.NOT_A_MULTIPLE and command.number is not None:
        fix = Fix(command.argument_span, _nearest_multiple(command.number, states))
    yield finding(span, message, hint, fix)


def _distance(command: ChipCommand, state: Settings) -> _Fault | None:
    is_move = command.use.motion is Motion.MOVE
    distance = state.distance if is_move else value(command, state) if rows(command.key)[0].unit == UNIT else None
    if not distance or state.microstep is None:
        return None
    size = microstep_size(state.microstep)
    if distance % size == 0:
        return None
    what = THE_DISTANCE() if is_move else command.key
    hint = SIZE_OF_MICROSTEP(microstep=state.microstep, size=size)
    return findings.NOT_A_MULTIPLE, IS_NOT_A_MULTIPLE_OF(what=what, distance=grouped(distance), size=size), hint


def _nearest_multiple(distance: int, states: set[Settings]) -> str:
    """The nearest distance that is right with every setting; one of them at least is known."""
    size = max(microstep_size(state.microstep) for state in states if state.microstep is not None)
    return str(max(size, (distance + size // 2) // size * size))


def _pair(command: ChipCommand, state: Settings) -> _Fault | None:
    if command.use.motion not in (Motion.MOVE, Motion.SEEK) or state.microstep is None or state.qualification is None:
        return None
    allowed = PAIRS[state.microstep]
    if state.qualification in allowed:
        return None
    names = [f"Q{q}" for q in allowed]
    hint = WITH_MICROSTEP_GO(microstep=state.microstep, names=names)
    return findings.FORBIDDEN_PAIR, NO_PAIR(microstep=state.microstep, qualification=state.qualification), hint


def _no_ramp(command: ChipCommand, state: Settings) -> _Fault | None:
    if (
        command.use.motion is not Motion.MOVE
        or state.velocity is None
        or state.start_stop is None
        or state.velocity > state.start_stop
    ):
        return None
    message = V_IS_NOT_ABOVE_S(velocity=state.velocity, start_stop=state.start_stop)
    return findings.NO_RAMP, message, NO_RAMP()


def _too_fast(command: ChipCommand, state: Settings) -> _Fault | None:
    if command.use.motion is not Motion.MOVE or state.velocity is None or state.qualification is None or state.microstep is None:
        return None
    highest = HIGHEST_SPEED[state.qualification]
    if state.velocity <= highest or state.velocity <= low_range_limit(state.microstep):
        return None
    message = V_IS_ABOVE_HIGHEST(velocity=state.velocity, highest=highest, qualification=state.qualification)
    return findings.SPEED_ABOVE_Q, message, Q1_REACHES_V()


def _fine_end(command: ChipCommand, state: Settings) -> _Fault | None:
    """M-39: the rest of a distance below one step of Q."""
    m, q, distance = state.microstep, state.qualification, state.distance
    if (
        command.use.motion is not Motion.MOVE
        or m is None
        or q is None
        or distance is None
        or state.start_stop is None
        or state.velocity is None
    ):
        return None
    speed, limit = min(state.start_stop, state.velocity), low_range_limit(m)
    fine, coarse = microstep_size(m), microstep_size(q)
    if q not in PAIRS[m] or distance % fine or distance % coarse == 0 or speed <= limit:
        return None
    message = ENDS_IN_FINE_STEPS(distance=grouped(distance), m=m, speed=speed, limit=limit)
    return (
        findings.ENDS_IN_FINE_STEPS,
        message,
        COARSE_STEPS(coarse=coarse, q=q, limit=limit),
    )


def _profile(command: ChipCommand, state: Settings) -> _Fault | None:
    if command.use.motion is not Motion.MOVE or state.profile is None or state.velocity is None:
        return None
    if state.profile in PROFILE_RANGE or state.profile > state.velocity:
        return None
    low, high = PROFILE_RANGE[0], PROFILE_RANGE[-1]
    message = P_IS_BETWEEN(profile=state.profile, high=high, velocity=state.velocity)
    hint = PROFILES(low=low, high=high)
    return findings.PROFILE_OUT_OF_RANGE, message, hint


def _acceleration(command: ChipCommand, state: Settings) -> _Fault | None:
    # M-4: nothing is enforced; the table with the limits is missing.
    if command.use.motion is not Motion.MOVE or state.acceleration is None or state.start_stop is None:
        return None
    if state.acceleration <= ACCELERATION_PER_START_STOP * state.start_stop:
        return None
    message = A_IS_LARGE(acceleration=state.acceleration, start_stop=state.start_stop)
    hint = SAFE_ACCELERATION(times=ACCELERATION_PER_START_STOP)
    return findings.NO_ACCELERATION_TABLE, message, hint


_RULES: tuple[_Rule, ...] = (_distance, _pair, _no_ramp, _too_fast, _fine_end, _profile, _acceleration)


def _operand(command: ChipCommand, state: Settings, interface: Interface) -> _Fault | None:
    """The number after + - * / where functions 46 and 58 make it lines or a register, and the dividend."""
    number = value(command, state)
    if number is None:
        return None
    if state.lines_operand and state.register_operand:
        return findings.BOTH_OPERANDS, BOTH_OPERANDS(), OPERAND_COMES_FROM_THE_LINES()
    if state.lines_operand:
        lines = line_group(number)
        if lines is None:
            hint = GROUPS_OF_LINES()
            return findings.OUT_OF_RANGE, NAMES_NO_LINES(number=number), hint
        taken = [line for line in lines if line in interface.occupied]
        if taken:
            message = BELONG_TO_INTERFACE(lines=lines_text(taken), title=interface.title)
            free = lines_text([line for line in LINES if line not in interface.occupied])
            return findings.LINE_READ_OCCUPIED, message, FREE_LINES_ARE(free=free)
        return None
    if state.lines_operand is None or state.register_operand is None:
        return None
    if state.register_operand and number not in GENERAL:
        return findings.OUT_OF_RANGE, IS_NOT_AN_OPERAND_REGISTER(number=number), TO(low=1, high=8)
    if command.key == "/" and not state.register_operand:
        return _dividend(number, state)
    return None


def _dividend(divisor: int, state: Settings) -> _Fault | None:
    if state.variable is None or state.variable <= DIVIDEND_LIMIT or divisor in FREE_DIVISORS:
        return None
    divisors = sorted(FREE_DIVISORS)
    hint = AT_MOST_EXCEPT_FOR(most=grouped(DIVIDEND_LIMIT), divisors=divisors)
    return findings.DIVIDEND_TOO_LARGE, VARIABLE_IS(variable=grouped(state.variable)), hint


def _from_variable(
    stream: CommandStream, index: int, states: set[Settings], variant: Variant, interface: Interface
) -> Iterator[Diagnostic]:
    """A command whose number is the internal variable: the numbers it can be."""
    command = stream.commands[index]
    numbers = [state.variable for state in states]
    problems = [None if n is None else _variable_problem(stream, index, n, variant, interface) for n in numbers]
    found = [p for p in problems if p is not None]
    if not found:
        return
    first = min(found, key=lambda p: p.message)
    if len(found) == len(problems):
        yield replace(first, span=command.span, message=VARIABLE_GIVES(message=first.message), fix=None)
    else:
        yield findings.MAY_FAIL(
            command.span, VARIABLE_CAN_GIVE(message=first.message), None if first.hint is None else text_of(first.hint)
        )


def _variable_problem(
    stream: CommandStream, index: int, number: int, variant: Variant, interface: Interface
) -> Diagnostic | None:
    command = stream.commands[index]
    problem = number_problem(command, number, variant, interface)
    if problem is None and is_computed(command):
        problem = next(label_problem(stream, index, number, variant), None)
    return problem if problem is not None and problem.severity is Severity.ERROR else None


def _runsign(command: ChipCommand, states: set[Settings], variant: Variant) -> Iterator[Diagnostic]:
    for state in states:
        number = value(command, state)
        spec = None if number is None else find(command.key, number, variant)
        if number is None or spec is None or not state.runsign or RUNSIGN_LINE not in spec.lines(number):
            continue
        message = WRITES_RUNSIGN_LINE(command=command, line=RUNSIGN_LINE)
        yield findings.RUNSIGN_LINE_USED(command.span, message, C40_GIVES_THE_LINE_BACK())
        return


def _calls(stream: CommandStream, flow: FlowAnalysis) -> Iterator[Diagnostic]:
    for index in flow.nested_calls:
        command = stream.commands[index]
        yield findings.NESTED_CALL(command.span, INSIDE_A_SUBROUTINE(command=command), ONE_LEVEL_ONLY())
    for index in flow.lone_returns:
        yield findings.RETURN_ALONE(stream.commands[index].span, DOT_WITHOUT_A_CALL(), JUMP_OVER_THE_SUBROUTINE())
    for index in flow.endless_calls:
        command = stream.commands[index]
        yield findings.NEVER_RETURNS(command.span, DOES_NOT_COME_BACK(command=command), SUBROUTINE_ENDS_WITH_A_DOT())


def _labels(stream: CommandStream, flow: FlowAnalysis) -> Iterator[Diagnostic]:
    """Labels of a file, or of what comes between resets, that nothing jumps to, and those given twice: one finding for each."""
    used = set().union(*flow.targets.values())
    for index, command in enumerate(stream.commands):
        label = written_label(command)
        target = None if label is None else stream.resolve(index, label)
        used |= set() if target is None else {target}
    for label, places in stream.labels.items():
        for _, group in groupby(places, lambda at: (stream.in_file[at], stream.resets[at])):
            first, *others = group
            if used.isdisjoint((first, *others)):
                span = stream.commands[first].span
                yield findings.LABEL_UNUSED(span, NOTHING_JUMPS_TO_LABEL(label=label), None, Fix(span, ""))
                continue
            for later in others:
                message = LABEL_IS_GIVEN_TWICE(label=label)
                yield findings.LABEL_TWICE(stream.commands[later].span, message, LATER_ONE_COUNTS())


def _never_reached(stream: CommandStream, flow: FlowAnalysis) -> Iterator[Diagnostic]:
    """One warning for each run of commands that no path leads to."""
    queued = [at for at, command in enumerate(stream.commands) if when(command.key, command.number) is When.QUEUED]
    for is_reached, group in groupby(queued, lambda at: at in flow.states):
        if not is_reached:
            run = [stream.commands[at] for at in group]
            count = len(run)
            message = NEVER_REACHED_ONE() if count == 1 else NEVER_REACHED_MORE(count=count)
            yield findings.NEVER_REACHED(Span(run[0].span.start, run[-1].span.end), message)


def _started_again(stream: CommandStream, variant: Variant, interface: Interface) -> Iterator[Diagnostic]:
    """A J behind a file that starts it at a label from which the file comes to its end, and so to this J again."""
    for index, command in enumerate(stream.commands):
        if command.use.control is not Control.JUMP or stream.in_file[index] is not None or not stream.files:
            continue
        label = written_label(command)
        target = None if label is None else stream.resolve(index, label)
        if target is None or stream.in_file[target] is None:
            continue
        if index in flow_of(stream, variant, interface).reached((target,)):
            message = STARTED_AGAIN(label=label)
            yield findings.STARTED_AGAIN(command.span, message, END_WITH_A_LOOP())


def _shared_registers(stream: CommandStream, flow: FlowAnalysis, variant: Variant) -> Iterator[Diagnostic]:
    """Registers 1 to 8 where they lie in the command memory: safe after a reset and with a short file only (chapter VII.7)."""
    limit = variant.memory_bits - variant.shared_bits
    if not variant.shared_bits or (stream.commands and stream.commands[0].key == "\\" and stream.bits <= limit):
        return
    for index, states in sorted(flow.states.items()):
        command = stream.commands[index]
        is_register = rows(command.key)[0].kind is ArgType.REGISTER
        moves = is_register and any((value(command, s) or 0) in GENERAL for s in states)
        operates = _calculates(command) and any(s.register_operand for s in states)
        if moves or operates:
            message = REGISTERS_ARE_SHARED(title=variant.title, bits=variant.shared_bits)
            hint = SAFE_AFTER_RESET(limit=limit, bits=stream.bits)
            first = stream.commands[0].span.start
            fix = Fix(Span(first, first), "\\\n") if stream.bits <= limit else None
            yield findings.REGISTERS_SHARED(command.span, message, hint, fix)
            return
