"""Program control: loops, jumps, subroutines, conditions, waits (manual chapter VII.1)."""

from __future__ import annotations

from steptwin.controller import MILLISECOND, Nanos
from steptwin.m1486.effects import CommandHost, Effect, Makers, WrongData, refusing
from steptwin.m1486.functions import CARRY, USER_FLAGS
from steptwin.m1486.syntax import JumpCondition
from steptwin.messages import Message

LOOP_LEVELS = 4
"""M-5: most levels of nested loops."""

MAKERS = Makers()


TOO_MANY_LOOPS = Message("m1486.too-many-loops", "more than {most} loops inside one another")


@MAKERS.does("Loop", computes=True)
def _loop(chip: CommandHost, count: int, _place: int, following: int) -> Effect:
    program = chip.program

    def run(now: Nanos) -> int:
        starts, counts = program.loop_starts, program.loop_counts
        if following in starts:
            # M-35: a jump has left this loop, and leads to its beginning again.
            level = starts.index(following)
            del starts[level:], counts[level:]
        if len(counts) >= LOOP_LEVELS:
            raise WrongData(TOO_MANY_LOOPS(most=LOOP_LEVELS))
        counts.append(count)
        starts.append(following)
        return following

    return run


END_OUTSIDE_A_LOOP = Message("m1486.end-outside-a-loop", "E outside a loop")
LOOP_IS_OVERWRITTEN = Message("m1486.loop-is-overwritten", "the beginning of the loop has been overwritten")


@MAKERS.does("End of loop", computes=True)
def _end_of_loop(chip: CommandHost, _number: int, _place: int, following: int) -> Effect:
    program = chip.program

    def run(now: Nanos) -> int:
        counts = program.loop_counts
        if not counts:
            raise WrongData(END_OUTSIDE_A_LOOP())  # M-20
        left = counts[-1] - 1
        if left:
            counts[-1] = left
            start = program.loop_starts[-1]
            if start >= 0:
                return start
        counts.pop()
        start = program.loop_starts.pop()
        if left and start < 0:
            raise WrongData(LOOP_IS_OVERWRITTEN())
        return following

    return run


NO_LABEL = Message("m1486.no-label", "there is no label {label}")


@MAKERS.does("Jump", computes=True, is_linked=True)
def _jump(chip: CommandHost, label: int, _place: int, _following: int) -> Effect:
    target = chip.memory.labels.get(label)
    if target is None:
        return refusing(NO_LABEL(label=label))  # M-17
    return lambda now: target


SUBROUTINE_IN_A_SUBROUTINE = Message("m1486.subroutine-in-a-subroutine", "a subroutine inside a subroutine")


@MAKERS.does("Subroutine", computes=True, is_linked=True)
def _call(chip: CommandHost, label: int, _place: int, following: int) -> Effect:
    target = chip.memory.labels.get(label)
    if target is None:
        return refusing(NO_LABEL(label=label))  # M-17
    program = chip.program

    def run(now: Nanos) -> int:
        if program.back is not None:
            raise WrongData(SUBROUTINE_IN_A_SUBROUTINE())
        program.back = following
        return target

    return run


DOT_OUTSIDE_A_SUBROUTINE = Message("m1486.dot-outside-a-subroutine", "a dot outside a subroutine")
CALL_IS_OVERWRITTEN = Message("m1486.call-is-overwritten", "the command after the call has been overwritten")


@MAKERS.does("End of subroutine", computes=True)
def _return(chip: CommandHost, _number: int, _place: int, _following: int) -> Effect:
    program = chip.program

    def run(now: Nanos) -> int:
        back = program.back
        if back is None:
            raise WrongData(DOT_OUTSIDE_A_SUBROUTINE())  # M-20
        program.back = None
        if back < 0:
            raise WrongData(CALL_IS_OVERWRITTEN())
        return back

    return run


WAITS = Message("m1486.waits", "waits {duration:g} ms")


@MAKERS.does("Wait")
def _wait(chip: CommandHost, milliseconds: int, _place: int, following: int) -> Effect:
    duration = milliseconds * MILLISECOND // chip.variant.clock

    def run(now: Nanos) -> int:
        chip.program.wait_until(now + duration)
        chip.event("wait", WAITS(duration=duration / MILLISECOND), now, ("duration", duration))
        return following

    return run


@MAKERS.does("Clear kill")
def _clear_kill(_chip: CommandHost, _number: int, _place: int, following: int) -> Effect:
    # C75 acts when it is received. A program that executes it is not stopped.
    return lambda now: following


def condition(chip: CommandHost, asked: JumpCondition, following: int) -> tuple[Effect, bool]:
    """The closure of ``I``, and whether it only computes."""
    line, high, label = asked.line, asked.high, asked.label
    target = chip.memory.labels.get(label)
    # M-17: a missing label matters only when the condition holds.
    jump: Effect = refusing(NO_LABEL(label=label)) if target is None else lambda now: target
    unit, io = chip.unit, chip.io

    def if_line(now: Nanos) -> int:
        return jump(now) if (io.levels[line] == 1) is high else following

    def if_interface_line(now: Nanos) -> int:
        return jump(now) if (chip.level(line, now) == 1) is high else following

    def if_flag(now: Nanos) -> int:
        return jump(now) if unit.flags[line - USER_FLAGS.start] is high else following

    def if_carry(now: Nanos) -> int:
        return jump(now) if unit.carry is high else following

    if line == CARRY:
        return if_carry, True
    if line in USER_FLAGS:
        return if_flag, True
    if line in chip.interface.occupied:
        return if_interface_line, False
    return if_line, True
