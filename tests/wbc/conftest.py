"""Random programs that mean something: every name is known, every block closed, every line reached."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

VARIABLES = ("count", "Speed_1", "x", "target", "n2")
CONSTANTS = {"fast": "60", "Slow": "2,5", "back": "-70", "pump": "OUT3", "start": "IN6"}
ROWS = ("P0;1;2;3;1", "TOP;10,5;-20.25;7;0", "home_row;0;0;1;1", "Q;100;50;25;1")
SIGNS = ("=", "<", ">", "<=", ">=")
OPERATORS = ("+", "-", "*", "/", "%", "&", "|", "&&", "||", "<<", ">>")
SYMBOLS = {*SIGNS, *OPERATORS, "(", ")", ":"}
AXES = (1, 2, 3, 4)

Tokens = list[str]


@dataclass(frozen=True)
class GeneratedProgram:
    text: str
    positions: str


whole = st.integers(-300, 300).map(str)
decimal = st.tuples(st.integers(-300, 300), st.sampled_from(",."), st.integers(0, 99)).map(lambda n: f"{n[0]}{n[1]}{n[2]}")
number = st.one_of(whole, decimal)
positive = st.one_of(st.integers(1, 300).map(str), st.integers(1, 300).map(lambda n: f"{n},25"))
axis = st.sampled_from(AXES).map(lambda n: f"M{n}")
output = st.integers(1, 8).map(lambda n: f"OUT{n}")
user_register = st.one_of(
    st.integers(0, 1999).map(lambda n: f"$I{n}"),
    st.integers(0, 999).map(lambda n: f"$D{2 * n}"),
    st.integers(0, 999).map(lambda n: f"$R{2 * n}"),
)
quantity = st.tuples(st.sampled_from(("PosM", "VactM", "AccM", "DecM", "VmaxM", "XENC", "ENC")), st.sampled_from(AXES)).map(
    lambda pair: f"{pair[0]}{pair[1]}"
)
readable = st.one_of(
    st.sampled_from(VARIABLES),
    quantity,
    user_register,
    st.integers(1, 20).map(lambda n: f"IN{n}"),
    st.integers(1, 2).map(lambda n: f"AIN{n}"),
    st.sampled_from(("OUTPUTS", "INPUTS", "VisionX", "LinVel", "fast", "Slow", "back")),
)
value = st.one_of(number, readable)
binary_input = st.one_of(st.integers(1, 20).map(lambda n: f"IN{n}"), output, st.just("start"))


@st.composite
def conditions(draw: DrawFn, *, waits: bool = False) -> Tokens:
    """A condition that can become true and false; with ``waits`` by itself."""
    kind = draw(st.integers(0, 2 if waits else 3))
    if kind == 0:
        return [draw(binary_input), "=", draw(st.sampled_from(("ON", "OFF", "1", "0", "OPEN", "CLOSE")))]
    if kind == 1:
        status = draw(st.sampled_from(("M_POS_OK", "M_ON", "M_HOMING", "4", "10")))
        return [f"StatM{draw(st.sampled_from(AXES))}", draw(st.sampled_from(("=", "<"))), status]
    if kind == 2:
        return [f"TIMA{draw(st.integers(1, 16))}", draw(st.sampled_from((">", ">="))), draw(st.integers(1, 500).map(str))]
    return [draw(st.sampled_from(VARIABLES)), draw(st.sampled_from(SIGNS)), draw(value)]


@st.composite
def assignments(draw: DrawFn) -> Tokens:
    kind = draw(st.integers(0, 5))
    word = ["SET"] if draw(st.booleans()) else []
    if kind == 0:
        target = draw(st.one_of(output, st.just("pump")))
        return [*word, target, "=", draw(st.sampled_from(("ON", "OFF", "1", "count", "IN3")))]
    if kind == 1:
        return [*word, draw(st.sampled_from(("AccM1", "DecM2", "VmaxM3", "VmaxM4"))), "=", draw(positive)]
    target = draw(st.one_of(st.sampled_from(VARIABLES), user_register, st.sampled_from(("PosM1", "LimRM2", "LinX", "PTPM3"))))
    if kind == 2:
        function = draw(st.sampled_from(("sin", "cos", "tg", "ctg", "asin", "acos", "sqrt")))
        return [*word, target, "=", function, "(", draw(readable.filter(lambda name: name not in CONSTANTS)), ")"]
    if kind == 3:
        function = draw(st.sampled_from(("min", "max")))
        return [*word, target, "=", function, "(", draw(readable), ",", draw(value), ")"]
    if kind == 4:
        operator = draw(st.sampled_from(OPERATORS))
        right = draw(readable if operator in "/%" else value)
        return [*word, target, "=", draw(value), operator, right]
    return [*word, target, "=", draw(readable)]


@st.composite
def simple_statements(draw: DrawFn, subroutines: tuple[str, ...]) -> Tokens:
    kind = draw(st.integers(0, 10 if subroutines else 9))
    if kind <= 3:
        return draw(assignments())
    if kind == 4:
        return ["WAIT", *draw(conditions(waits=True))]
    if kind == 5:
        return ["DELAY", draw(st.sampled_from(("0.01", "0,5", "1", "count", "PosM1")))]
    if kind == 6:
        keyword = draw(st.sampled_from(("VABS", "VREL", "PABS", "PREL")))
        return [keyword, draw(axis), draw(value)]
    if kind == 7:
        return draw(
            st.one_of(
                st.tuples(st.sampled_from(("BRAKE", "STOP")), axis).map(list),
                st.tuples(st.just("HOME"), axis, st.sampled_from(("-20", "15,5", "fast"))).map(list),
                st.just(["WAITPOS"]),
            )
        )
    if kind == 8:
        keyword = draw(st.sampled_from(("MOVEPTP", "MOVELIN", "MOVELIN_REL", "MOVETOCIRC", "DOCIRC", "DOARC")))
        row = draw(st.sampled_from(("@P0", "@TOP", "@home_row", "@Q", "0", "3", "count")))
        return [keyword, row]
    if kind == 9:
        return ["PULSE", "(", draw(output), ",", draw(st.sampled_from(("0,5", "2", "count"))), ")"]
    return ["JUMP", draw(st.sampled_from(subroutines))]


@st.composite
def bodies(draw: DrawFn, subroutines: tuple[str, ...], depth: int = 2) -> list[Tokens]:
    lines: list[Tokens] = []
    for _ in range(draw(st.integers(1, 5))):
        kind = draw(st.integers(0, 5)) if depth else 2
        if kind == 0:
            lines += [["IF", *draw(conditions())], *draw(bodies(subroutines, depth - 1))]
            if draw(st.booleans()):
                lines += [["ELSE"], *draw(bodies(subroutines, depth - 1))]
            lines.append(["ENDIF"])
        elif kind == 1:
            lines += [["WHILE", *draw(conditions())], *draw(bodies(subroutines, depth - 1)), ["ENDWHILE"]]
        else:
            lines.append(draw(simple_statements(subroutines)))
    return lines


EVENTS = {
    **{f"IN{n}": (f"CFGINT_IN{n}", ("RIS", "FALL", "RIS_FALL", "3")) for n in range(1, 9)},
    "MODBUS": ("CFGINT_MODBUS", ("INT_HIGH", "4")),
    "TICK": ("CFGINT_TICK", ("HIGH",)),
    "TICK1000": ("CFGINT_TICK1000", ("HIGH",)),
    "M2": ("CFGINT_M2", ("INT_HIGH",)),
}


@st.composite
def whole_programs(draw: DrawFn) -> GeneratedProgram:
    subroutines = ("BLINK", "grip", "Move_2")[: draw(st.integers(0, 3))]
    events = draw(st.lists(st.sampled_from(sorted(EVENTS)), max_size=3, unique=True))
    lines: list[Tokens] = [["#", name, text] for name, text in CONSTANTS.items()]
    lines += [[f"M{n}", "=", "ON"] for n in AXES]
    lines += [["SET", name, "=", draw(number)] for name in VARIABLES]
    for event in events:
        register, modes = EVENTS[event]
        lines.append([register, "=", draw(st.sampled_from(modes))])
    lines += [["MAIN", ":"], *([["JUMP", name] for name in subroutines]), *draw(bodies(subroutines))]
    lines += [[f"$R{2 * index}", "=", name] for index, name in enumerate(VARIABLES)]
    lines.append(draw(st.sampled_from((["END"], ["JUMP", "MAIN"], ["PROGRESET"]))))
    for index, name in enumerate(subroutines):
        lines += [[name, ":"], *draw(bodies(subroutines[index + 1 :], 1)), ["RETURN"]]
    for event in events:
        prefix = draw(st.sampled_from(("INT_", "HARDINT_")))
        lines += [[prefix + event, ":"], *draw(bodies((), 1)), ["RETURN"]]
    return GeneratedProgram("".join(draw(written(line)) for line in lines), "".join(row + "\n" for row in ROWS))


@st.composite
def written(draw: DrawFn, tokens: Tokens) -> str:
    """A line with these words, in one of the ways people write."""
    style = draw(st.integers(0, 63))
    case = (str, str.upper, str.lower, str.swapcase)[style & 3]
    blank, tight = ("\t" if style & 4 else " "), bool(style & 8)
    text = "  " if style & 16 else ""
    for number, token in enumerate(tokens):
        previous = tokens[number - 1] if number else ""
        joined = number == 0 or previous in ("#", "(") or (tight and previous != "," and {previous, token} & SYMBOLS)
        text += ("" if joined else blank) + case(token)
    end = "  // what it does" if style & 32 else ""
    return text + end + "\n" + ("\n" if style == 63 else "")


@pytest.fixture(scope="session")
def programs() -> SearchStrategy[GeneratedProgram]:
    """Valid programs in every style of writing, with the position table they use."""
    return whole_programs()
