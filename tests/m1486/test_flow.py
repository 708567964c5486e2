"""The flow through a program against walks through it: whatever a walk meets, the analysis must have foreseen."""

from __future__ import annotations

import random
from collections.abc import Iterator

from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.m1486.commands import find
from steptwin.m1486.flow import Settings, defaults, follow
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.structure import CommandStream, streams
from steptwin.m1486.syntax import JumpCondition, parse
from steptwin.m1486.variants import variant

B = variant("B")
COMMANDS = (
    "J1", "J2", "J3", "J", "I1H1", "I2L2", "I3H3", "'1", "'2", "'3", "'", ".", "E", "M1", "M4", "M64", "Q1", "Q4", "V300",
    "F64", "F", ":1", ":2", ":3", "?12", "?17", "<1", "+1", "-2", "*3", "/2", "T40", "C40",
)  # fmt: skip
PIECES = st.lists(
    st.sampled_from(COMMANDS).map(lambda c: [c])
    | st.lists(st.sampled_from(COMMANDS), max_size=3).map(lambda body: ["L2", *body, "E"]),
    max_size=5,
).map(lambda pieces: [command for piece in pieces for command in piece])
SETTINGS = {"M": "microstep", "Q": "qualification", "V": "velocity", "F": "distance", ":": "variable"}


def after(key: str, number: int, state: Settings, chance: random.Random) -> Settings:
    """What a command that goes on to the next one leaves behind."""
    wrong_multiple = key == "F" and number % (64 // (state.microstep or 64))
    if find(key, number, B) is None or wrong_multiple:
        return state  # refused
    if key in SETTINGS:
        return state._replace(**{SETTINGS[key]: number})
    if key in "TC":
        return state._replace(runsign=int(key == "T"))
    if key in "?<":
        return state._replace(variable=chance.randrange(2 ** (16 if key == "<" else number % 10)))
    variable = state.variable or 0
    results = {"+": variable + number, "-": variable - number, "*": variable * number, "/": variable // number}
    return state._replace(variable=results[key] % 2**24)


def walk(stream: CommandStream, chance: random.Random) -> Iterator[tuple[int, Settings]]:
    """One way through the program: lines, readings and registers by chance; ends where the chip would stop."""
    at, state, home = 0, defaults(B, STEP_DIRECTION)._replace(variable=0), -1
    left: dict[int, int] = {}
    for _ in range(200):
        if at >= len(stream.commands):
            return
        yield at, state
        command = stream.commands[at]
        key, number = command.key, (state.variable if command.from_variable else command.number) or 0
        target: int | None = at + 1
        if key == "J":
            target = stream.resolve(at, number)
        elif isinstance(command.argument, JumpCondition):
            target = stream.resolve(at, command.argument.label) if chance.random() < 0.5 else target
        elif key == "'":
            target, home = (stream.resolve(at, number) if home < 0 else None), at
        elif key == ".":
            target, home = (home + 1 if home >= 0 else None), -1
        elif key == "L":
            left[at] = number
        elif key == "E":
            begin = stream.loops.get(at)
            if begin is None or begin not in left:
                return
            left[begin] -= 1
            target = begin + 1 if left[begin] > 0 else target
        elif key not in "[]@" and number:
            state = after(key, number, state, chance)
        if target is None:
            return
        at = target


@settings(max_examples=100)
@given(PIECES, PIECES, PIECES, PIECES, st.integers(0, 2**32))
# The internal variable is 2^24 - 1: with M64 a right multiple, but no distance.
@example([], [], [], [":1", "-2", "L2", "M64", "E", "F"], 0)
def test_every_walk_is_foreseen(first: list[str], second: list[str], third: list[str], fourth: list[str], seed: int) -> None:
    lines = ["[", *first, "@1", *second, "@2", *third, "@3", *fourth, "]"]
    (stream,) = streams(parse("\n".join(lines)).program)
    flow = follow(stream, B, STEP_DIRECTION)
    for turn in range(5):
        for index, state in walk(stream, random.Random(seed + turn)):
            foreseen = flow.states.get(index, set())
            assert any(all(f is None or f == s for f, s in zip(known, state, strict=True)) for known in foreseen), (
                f"{stream.commands[index]} is reached with {state}, foreseen is {foreseen}"
            )


def flow_of(text: str) -> tuple[CommandStream, dict[int, set[Settings]]]:
    (stream,) = streams(parse(text).program)
    return stream, follow(stream, B, STEP_DIRECTION).states


def test_values_are_exact_while_they_are_few() -> None:
    _, states = flow_of("?12\n*10\n+1\nF")
    assert {s.variable for s in states[3]} == {1, 11, 21, 31}


def test_the_variable_is_calculated_modulo_its_24_bits() -> None:
    _, states = flow_of(":100\n/7\n-20\n*3\n+20\nF")
    assert [{s.variable for s in states[index]} for index in range(1, 6)] == [{100}, {14}, {2**24 - 6}, {2**24 - 18}, {2}]


def test_the_values_of_five_lines_are_few() -> None:
    _, states = flow_of("?15\n+1")
    assert {s.variable for s in states[1]} == set(range(32))


def test_what_differs_is_unknown_where_there_are_many() -> None:
    _, states = flow_of("M4\n?16\n+1")
    assert {(s.microstep, s.variable) for s in states[2]} == {(4, None)}
    _, states = flow_of("M4\n?15\n*7\nT46\n+11\nF")
    assert {(s.microstep, s.variable) for s in states[5]} == {(4, None)}


def test_settings_that_belong_together_stay_together() -> None:
    _, states = flow_of("[\nI1H1\nM64\nQ4\nJ2\n@1\nM2\nQ2\n@2\nR\n]")
    assert {(s.microstep, s.qualification) for s in states[9]} == {(64, 4), (2, 2)}


def test_a_refused_number_changes_nothing() -> None:
    _, states = flow_of("M3\nR")
    assert {s.microstep for s in states[1]} == {1}


def test_m_11_a_jump_to_a_label_that_is_missing_is_left_out_where_the_program_may_go_on() -> None:
    jump = "[\n{first}\nI1H1\n?17\nM4\nJ\nQ4\n@1\nR\n]"
    _, states = flow_of(jump.format(first="T44"))
    assert {(s.microstep, s.qualification) for s in states[6]} == {(4, 1)}
    _, states = flow_of(jump.format(first="T45"))
    assert 6 not in states


def test_m_11_a_call_of_a_label_that_is_missing_is_no_subroutine_where_the_program_may_go_on() -> None:
    (stream,) = streams(parse("[\nT44\n?17\n'\nM4\n.\n@2\nJ2\n@1\nJ\nM8\n.\n]").program)
    flow = follow(stream, B, STEP_DIRECTION)
    keys = [command.key for command in stream.commands]
    first, second = (index for index, key in enumerate(keys) if key == ".")
    assert (flow.lone_returns, flow.endless_calls) == ({first}, [])
    assert second in flow.states


def test_a_function_of_an_unknown_number_may_be_any() -> None:
    _, states = flow_of("?17\nT\nR")
    assert {(s.runsign, s.lines_operand, s.register_operand) for s in states[2]} == {(None, None, None)}
