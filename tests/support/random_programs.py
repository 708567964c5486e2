"""Programs in the language WBC by chance: all statements and registers, blocks, subroutines, interrupts; and mistakes in them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from chance import Chance

from steptwin.diagnostics import SourceText
from steptwin.wbc.check import check
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.positions import PositionTable

NAME = re.compile(r"⟨([a-z]\w*)⟩")
WORDS: Mapping[str, Sequence[str]] = {
    "variable": ("count", "Speed_1", "x", "target"),
    "axis": ("M⟨#1..4⟩", "M⟨#1..2⟩"),
    "output": ("OUT⟨#1..8⟩",),
    "input": ("IN⟨#1..8⟩", "IN⟨#1..20⟩"),
    "memory": ("$I⟨#0..9⟩", "$D⟨4|6|8⟩", "$R⟨4|6|10⟩", "$I⟨#0..499⟩", "$R⟨0|498|2⟩"),
    "number": ("⟨#-9..9⟩", "⟨#0..100⟩", "⟨-30.00..30.00⟩", "⟨0.1..2.0⟩", "⟨1|0|-1|32767|-32769|65536|0,5⟩"),
    "changing": ("PosM⟨#1..4⟩", "VactM⟨#1..4⟩", "TIMA⟨#1..16⟩", "TIMB⟨#1..16⟩", "ENC⟨#1..4⟩", "XENC⟨#1..4⟩", "AIN⟨#1..2⟩"),
    "setting": ("AccM⟨#1..4⟩", "DecM⟨#1..4⟩", "VmaxM⟨#1..4⟩", "LimLM⟨#1..4⟩", "LimRM⟨#1..4⟩"),
    "other": ("⟨input⟩", "⟨output⟩", "StatM⟨#1..4⟩", "M⟨#1..4⟩", "⟨INPUTS|OUTPUTS|VisionX|VisionNew|VisionNo|VisionY|VisionA⟩"),
    "row0": ("PTPM⟨#1..4⟩", "⟨CircX|CircY|CircR|CircA|LinX|LinY|LinVel|LinAcc⟩"),
    "readable": ("⟨variable⟩", "⟨variable⟩", "⟨memory⟩", "⟨changing⟩", "⟨other⟩", "⟨setting⟩", "⟨row0⟩", "⟨fast|back|pump⟩"),
    "value": ("⟨number⟩", "⟨readable⟩"),
    "target": ("⟨variable⟩", "⟨variable⟩", "⟨memory⟩", "⟨row0⟩", "PosM⟨#1..4⟩", "ENC⟨#1..4⟩", "TIMA⟨#1..3⟩", "TIMB⟨#1..3⟩"),
    "sign": ("⟨=|<|>|<=|>=⟩",),
    "switch": ("⟨ON|OFF|1|0⟩",),
    "status": ("⟨M_POS_OK|M_ON|M_SPEED|M_OFF|4|10|M_HOMING|M_POS_LIML⟩",),
    "condition": (
        "⟨input⟩ = ⟨switch⟩",
        "StatM⟨#1..4⟩ ⟨sign⟩ ⟨status⟩",
        "⟨variable⟩ ⟨sign⟩ ⟨value⟩",
        "⟨changing⟩ ⟨sign⟩ ⟨number⟩",
        "⟨memory⟩ ⟨sign⟩ ⟨value⟩",
        "⟨value⟩ ⟨sign⟩ ⟨readable⟩",
    ),
    "comes": (
        "TIMA⟨#1..4⟩ ⟨>|>=⟩ ⟨#1..30⟩",
        "⟨input⟩ = ⟨switch⟩",
        "StatM⟨#1..4⟩ ⟨<|=|>=⟩ ⟨status⟩",
        "PosM⟨#1..2⟩ ⟨<|>⟩ ⟨number⟩",
    ),
    "assignment": (
        "⟨target⟩ = ⟨value⟩",
        "SET ⟨target⟩ = ⟨value⟩ ⟨+|-|*⟩ ⟨value⟩",
        "⟨target⟩ = ⟨value⟩ ⟨<<|>>|&&⟩ ⟨value⟩",
        "⟨variable⟩ = ⟨variable⟩ ⟨+|-|*⟩ ⟨number⟩",
        "⟨variable⟩ = ⟨value⟩ ⟨/|%⟩ ⟨1|2|3|-2|0.5|3|-7|TIMA1⟩",
        "⟨variable⟩ = ⟨value⟩ ⟨shift⟩ ⟨#0..9⟩",
        "⟨variable⟩ = ⟨sin|cos|tg|ctg|SIN|asin|acos|sqrt⟩(⟨readable⟩)",
        "⟨target⟩ = ⟨min|max⟩(⟨value⟩, ⟨value⟩)",
        "⟨output⟩ = ⟨switch⟩",
        "⟨output⟩ = ⟨value⟩",
        "OUTPUTS = ⟨#0..255⟩",
        "⟨setting⟩ = ⟨1.0..500.0⟩",
        "LimLM⟨#1..4⟩ = ⟨-20.0..-1.0⟩",
        "⟨axis⟩ = ⟨ON|ON|ON|OFF⟩",
        "CFGINT_⟨event⟩ = ⟨INT_OFF|RIS|FALL|RIS_FALL|INT_HIGH⟩",
    ),
    "shift": ("<<", ">>", "&", "|", "&&", "||"),
    "event": ("IN⟨#1..8⟩", "⟨MODBUS|TICK|TICK100|TICK1000⟩", "M⟨#1..4⟩"),
    "row": ("@⟨P0|TOP|home_row|Q|LINE|ARC|ROUND⟩", "⟨#0..6⟩", "⟨0|count⟩"),
    "action": (
        "WAIT ⟨comes⟩",
        "DELAY ⟨0.01|0,05|0.2|0.005|x⟩",
        "HOME ⟨axis⟩ ⟨-20.0..-1.0⟩",
        "HOME ⟨axis⟩ ⟨15,5|fast|back⟩",
        "⟨VABS|VREL⟩ ⟨axis⟩ ⟨-40.0..40.0⟩",
        "⟨PABS|PREL⟩ ⟨axis⟩ ⟨-20.00..20.00⟩",
        "⟨PABS|PREL|VABS|VREL⟩ ⟨axis⟩ ⟨readable⟩",
        "⟨BRAKE|STOP⟩ ⟨axis⟩",
        "MOVEPTP ⟨row⟩",
        "⟨MOVELIN|MOVELIN_REL⟩ ⟨@LINE|@P0|0|4⟩",
        "⟨MOVETOCIRC|DOCIRC⟩ ⟨@ROUND|@Q|0|6⟩",
        "DOARC ⟨@ARC|5⟩",
        "⟨MOVEPTP|MOVEPTP|MOVELIN|DOCIRC|DOARC⟩ ⟨row⟩",
        "WAITPOS",
        "PULSE(⟨output⟩, ⟨0,02|0.3|x⟩)",
    ),
    "statement": ("⟨assignment⟩", "⟨assignment⟩", "⟨action⟩", "⟨action⟩", "⟨action⟩"),
}
"""Lines as people bring them along from other languages."""
CONSTANTS = ("#fast 60", "#back -7,5", "#pump OUT3", "#start IN6")
ROWS = (
    "P0;1;2;3;1",
    "TOP;10,5;-20.25;7;x",
    "home_row;0;0;x;x",
    "Q;10;5;2.5;90",
    "LINE;4;-3;12.5;0",
    "ARC;3;3;6;1",
    "ROUND;5;5;4;-360",
)
SUBROUTINES = ("BLINK", "grip", "Move_2")
EVENTS = ("IN1", "IN2", "IN7", "MODBUS", "TICK", "TICK100", "TICK1000", "M1", "M2")


def written(chance: Chance, text: str) -> str:
    """A text whose gaps have names of `WORDS`."""
    while found := NAME.search(text):
        text = text[: found.start()] + chance.one(WORDS[found[1]]) + text[found.end() :]
    return chance.filled(text)


def _block(chance: Chance, depth: int, jumps: Sequence[str]) -> list[str]:
    lines: list[str] = []
    for _ in range(1 + chance.below(5)):
        kind = chance.below(7)
        if kind == 0 and depth:
            lines += [f"IF {written(chance, '⟨condition⟩')}", *_block(chance, depth - 1, jumps)]
            if chance.below(2):
                lines += ["ELSE", *_block(chance, depth - 1, jumps)]
            lines.append("ENDIF")
        elif kind == 1 and depth:
            lines += [f"WHILE {written(chance, '⟨condition⟩')}", *_block(chance, depth - 1, jumps), "ENDWHILE"]
        elif kind == 2 and jumps:
            lines.append(f"JUMP {chance.one(jumps)}")
        else:
            lines.append(written(chance, "⟨statement⟩"))
    return lines


def rows(chance: Chance) -> str:
    """A position table that has the rows of which programs speak."""
    return "".join(f"{row}\n" for row in (*ROWS, *(chance.filled(f"R{n};⟨-9.0..9.0⟩;⟨#0..9⟩;x;⟨0.5..3.0⟩") for n in range(3))))


def program(chance: Chance) -> str:
    """A program without mistakes of form. It may divide by 0, or wait for ever."""
    subroutines = SUBROUTINES[: chance.below(4)]
    events = sorted({chance.one(EVENTS) for _ in range(chance.below(4))})
    lines = [*CONSTANTS[: 3 + chance.below(2)]]
    lines += [f"M{axis} = ON" for axis in range(1, 5) if chance.below(6)]
    lines += [written(chance, f"{name} = ⟨number⟩") for name in WORDS["variable"]]
    for event in events:
        mode = "⟨RIS|FALL|RIS_FALL⟩" if event.startswith("IN") else "⟨HIGH|INT_HIGH⟩"
        lines.append(chance.filled(f"CFGINT_{event} = {mode}"))
    lines += ["MAIN:", *(f"JUMP {name}" for name in subroutines), *_block(chance, 2, subroutines), *_block(chance, 2, ())]
    lines += [f"$R{20 + 2 * number} = {name}" for number, name in enumerate(WORDS["variable"])]
    lines.append(chance.one(("JUMP MAIN", "JUMP MAIN", "JUMP MAIN", "END", "PROGRESET")))
    for number, name in enumerate(subroutines):
        lines += [f"{name}:", *_block(chance, 1, subroutines[number + 1 :]), "RETURN"]
    for event in events:
        lines += [f"{chance.one(('INT_', 'HARDINT_'))}{event}:", *_block(chance, 1, ()), "RETURN"]
    return "\n".join(lines) + "\n"


def sound(text: str, table: PositionTable, firmware: str = "1.70") -> str:
    """The program without the lines that have errors, which no block begins or ends with."""
    for _ in range(20):
        wrong = {
            SourceText("", text).position(found.span.start)[0]
            for found in check(text, table, dialect=dialect_for(firmware)).errors
        }
        if not wrong:
            return text
        text = "".join(f"{line}\n" for number, line in enumerate(text.splitlines(), 1) if number not in wrong)
    raise AssertionError(f"always wrong:\n{text}")
