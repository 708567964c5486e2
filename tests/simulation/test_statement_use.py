"""What statements of programs read and change: worked out by hand from what each of them does."""

from __future__ import annotations

import pytest
from mic488_rig import loaded

from steptwin.m1486.commanduse import ChipState
from steptwin.m1486.syntax import parse
from steptwin.simulation.kinds.m1486.statement_use import use_of as use_of_chip
from steptwin.simulation.kinds.mic488.statement_use import use_of
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementUse


def axis(number: int | str) -> Resource:
    return Resource(ResourceKind.AXIS, str(number))


def pin(name: str) -> Resource:
    return Resource(ResourceKind.PIN, name)


def origin(number: int | str) -> Resource:
    return Resource(ResourceKind.ORIGIN, str(number))


def value(name: str) -> Resource:
    return Resource(ResourceKind.VALUE, name)


ANY_AXIS, ANY_PIN = axis(""), pin("")
PROGRAM = Resource(ResourceKind.PROGRAM, "")
SIGNALS = pin("BOOST"), pin("DIRECTION"), pin("B1")
SPEEDS = tuple(map(value, ("start_stop", "acceleration", "velocity", "profile")))
OPERANDS = (value("variable"),)
"""Of + - * /, while functions 46 and 58 make no lines and no register of the number."""

WBC = """\
x = AIN2 + $D4
OUT3 = IN5
PULSE(OUT2, x)
PABS M2 x
BRAKE M4
MOVEPTP @A
IF IN1 = ON
    OUTPUTS = INPUTS
ELSE
    ACCM3 = 5
ENDIF
WHILE POSM1 < x
    DELAY x
ENDWHILE
WAIT STATM2 = 4
WAITPOS
JUMP L
L:
PROGRESET
END
INT_IN6:
x = 1
RETURN
INT_M3:
RETURN
INT_MODBUS:
x = 2
RETURN
"""
WBC_USES = [
    StatementUse((pin("AIN2"), value("$D4")), (value("x"),)),
    StatementUse((pin("IN5"),), (pin("OUT3"),)),
    StatementUse((value("x"),), (pin("OUT2"),), lasts=True),
    StatementUse((value("x"),), (axis(2),), acts_by=(origin(2),)),
    StatementUse((), (axis(4),)),
    StatementUse((), (ANY_AXIS,), acts_by=(origin(""),)),
    StatementUse((pin("IN1"),), governs=range(7, 10)),  # IF: up to its ENDIF
    StatementUse((ANY_PIN,), (ANY_PIN,)),
    StatementUse(),
    StatementUse((), (axis(3), value("AccM3")), keeps=True),
    StatementUse(),
    StatementUse((axis(1), origin(1), value("x")), governs=range(12, 13), is_loop=True),
    StatementUse((value("x"),), waits=True),
    StatementUse((axis(1), origin(1), value("x")), governs=range(12, 13), is_loop=True),  # ENDWHILE
    StatementUse((axis(2),), waits=True),
    StatementUse((ANY_AXIS,), waits=True),
    StatementUse(jumps=17),
    StatementUse((), (ANY_AXIS, ANY_PIN, PROGRAM)),
    StatementUse((), (ANY_AXIS, ANY_PIN, PROGRAM)),
    StatementUse(
        (pin("IN6"),), waits=True, governs=range(20, 22), acts_by=(value("CFGINT_IN6"),), edges=((1, 1.0), (2, 0.0))
    ),  # up to its RETURN
    StatementUse((), (value("x"),)),
    StatementUse(),
    StatementUse((axis(3),), waits=True, governs=range(23, 24), acts_by=(value("CFGINT_M3"),)),
    StatementUse(),
    StatementUse(
        (Resource(ResourceKind.REQUEST, "USER_REGISTER"),), waits=True, governs=range(25, 27), acts_by=(value("CFGINT_MODBUS"),)
    ),
    StatementUse((), (value("x"),)),
    StatementUse(),
    StatementUse((), (ANY_AXIS, ANY_PIN, PROGRAM)),  # the end
]


def test_statements_of_wbc() -> None:
    steps = loaded(WBC, "A;1;2;3;4\n")[0].steps
    assert [use_of(steps, number) for number in range(len(steps) + 1)] == WBC_USES


@pytest.mark.parametrize(("value", "level"), [("ON", 1.0), ("0", 0.0), ("7", 1.0), ("IN1", None), ("x", None)])
def test_levels_that_a_statement_always_sets(value: str, level: float | None) -> None:
    steps = loaded(f"x = 0\nOUT2 = {value}\n")[0].steps
    assert use_of(steps, 1).sets == level


@pytest.mark.parametrize(
    ("text", "use"),
    [
        ("O3", StatementUse((pin("B3"),), waits=True)),
        ("Z21", StatementUse((pin("B21"),), waits=True)),
        ("T2", StatementUse(writes=(pin("B2"),), sets=1.0)),
        ("C1", StatementUse(writes=(pin("B1"),), sets=0.0)),
        ("T", StatementUse((value("variable"),), (ANY_PIN, *SIGNALS), keeps=True)),
        ("T40", StatementUse(writes=(*SIGNALS, value("function40")))),
        ("T41", StatementUse(writes=(value("function41"),))),
        ("C42", StatementUse(writes=(value("function42"), PROGRAM))),  # LIMIT that is low holds it
        ("T80", StatementUse(writes=(value("flag80"),), keeps=True)),
        ("!12", StatementUse((value("variable"), value("register10")), (pin("B1"), pin("B2")))),
        ("?12", StatementUse((pin("B1"), pin("B2")), (value("variable"),))),
        (":5", StatementUse(writes=(value("variable"),))),
        ("+5", StatementUse(OPERANDS, (value("variable"), value("flag87")), keeps=True)),
        ("-5", StatementUse(OPERANDS, (value("variable"), value("flag87")), keeps=True)),
        ("*5", StatementUse(OPERANDS, (value("variable"),))),
        ("/5", StatementUse(OPERANDS, (value("variable"), value("register10")))),
        ("<1", StatementUse((value("register1"),), (value("variable"),))),
        (">1", StatementUse((value("variable"),), (value("register1"),))),
        (">9", StatementUse((value("variable"),), (axis(1),))),
        ("=64", StatementUse(writes=(axis(1),))),
        ("N2", StatementUse(writes=(pin("N"),))),
        ("J", StatementUse((value("variable"),), governs=range(1 << 16))),
        ("I80H1", StatementUse((value("flag80"),), governs=range(1 << 16))),
        ("U1", StatementUse(waits=True)),
        ("I3H1", StatementUse((pin("B3"),), governs=range(1 << 16))),
        ("W100", StatementUse(waits=True)),
        ("R", StatementUse((axis(1),), (axis(1), *SIGNALS, PROGRAM), waits=True, acts_by=(value("distance"),), made_by=SPEEDS)),
        (")4", StatementUse((axis(1), pin("B4")), (axis(1), *SIGNALS, PROGRAM), waits=True, made_by=SPEEDS[:1])),
        ("(4", StatementUse((axis(1), pin("B4")), (axis(1), *SIGNALS, PROGRAM), waits=True, made_by=SPEEDS[:1])),
        ("V300", StatementUse(writes=(value("velocity"),))),
        ("F640", StatementUse(writes=(value("distance"),))),
        ("D", StatementUse(writes=(value("distance"),), acts_by=(value("distance"),))),
        ("@7", StatementUse()),
    ],
)
def test_commands_of_a_chip(text: str, use: StatementUse) -> None:
    (command,) = parse(text).program.all_commands
    assert use_of_chip(command) == use


def test_operands_of_calculations() -> None:
    (command,) = parse("+5").program.all_commands
    reads = use_of_chip(command, ChipState.LINES | ChipState.REGISTERS).reads
    assert reads == (ANY_PIN, value("variable"), value("register5"))
