"""Quick fixes: every code of every checker has one that mends what it is for, or a reason why it has none."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.lsp.test_editorsession import Shelf

from steptwin.diagnostics import Span
from steptwin.lsp import navigation
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.table import UNUSED_ROW
from steptwin.m1486 import findings
from steptwin.wbc.findings import FINDINGS

SOURCES = Path(__file__).parents[2] / "src/steptwin"
WBC, CHIP, CFG, CSV, TOML = (f"file:///m/m.{ending}" for ending in ("prg", "m1486", "cfg", "csv", "toml"))
LOOP = "MAIN:\n"
A_TABLE = '[[mic488]]\nname = "table"\n'
AN_AXIS = A_TABLE + '[[axis]]\nname = "x"\ndrive = "table.M1"\n'

FIXED = [
    ("W101", WBC, "x = 1;\nOUT1 = x\n", "x = 1\nOUT1 = x\n"),
    ("W101", WBC, "MAIN: OUT1 = ON\nEND\n", "MAIN: \nOUT1 = ON\nEND\n"),
    ("W102", WBC, "prędkość = 1\nOUT1 = prędkość\n", "predkosc = 1\nOUT1 = predkosc\n"),
    ("W103", WBC, "M1 = ON\nMOVEPTP row\n", "M1 = ON\nMOVEPTP @row\n"),
    ("W104", WBC, "speed = 1\nOUT1 = speed\nOUT2 = sped\n", "speed = 1\nOUT1 = speed\nOUT2 = speed\n"),
    ("W105", WBC, "MAIN LOOP:\nJUMP MAIN_LOOP\n", "MAIN_LOOP:\nJUMP MAIN_LOOP\n"),
    ("W106", WBC, "10:\nOUT1 = ON\nJUMP 10\n", "L10:\nOUT1 = ON\nJUMP L10\n"),
    ("W110", WBC, "MAIN:\nJUMP MIAN\n", "MAIN:\nJUMP MAIN\n"),
    ("W111", WBC, "JUMP LAST\nLAST:\n", "JUMP LAST\nLAST:\nEND\n"),
    ("W112", WBC, "CFGINT_IN1 = RIS\nEND\nINT_IN1:\nOUT1 = ON\n", "CFGINT_IN1 = RIS\nEND\nINT_IN1:\nOUT1 = ON\nRETURN\n"),
    ("W113", WBC, "WAIT IN1\n", "WAIT IN1 = ON\n"),
    ("W114", WBC, "WAIT (IN1 = 1)\n", "WAIT IN1 = 1\n"),
    ("W115", WBC, "OUT1 ON\n", "OUT1 = ON\n"),
    ("W115", WBC, "SET OUT1 ON\n", "SET OUT1 = ON\n"),
    ("W116", WBC, "x = 1\nx += 2\nOUT1 = x\n", "x = 1\nx = x + 2\nOUT1 = x\n"),
    ("W117", WBC, "SET $R0 = sqr(4)\n", "SET $R0 = sqrt(4)\n"),
    ("W119", WBC, "DELAY .5\n", "DELAY 0.5\n"),
    ("W120", WBC, "SET $R0 = sin(30\n", "SET $R0 = sin(30)\n"),
    ("W121", WBC, "M1 = ON\nPABS M1 20 mm\n", "M1 = ON\nPABS M1 20\n"),
    ("W122", WBC, "TIMA1 = 1000000\n", "TIMA1 = 999999\n"),
    ("W126", WBC, "M1 = ON\nMOVEPTP @rwo\n", "M1 = ON\nMOVEPTP @ROW\n"),
    ("W127", WBC, "M1 = ON\nPABS (M1, 20)\n", "M1 = ON\nPABS M1 20\n"),
    ("W128", WBC, "STOP 1\n", "STOP M1\n"),
    ("W130", WBC, "OUT1 = ON\nELSE\nEND\n", "OUT1 = ON\n\nEND\n"),
    ("W131", WBC, "OUT1 = ON\nENDIF\n", "OUT1 = ON\n\n"),
    ("W134", WBC, "OUT1 = ON\nENDWHILE\n", "OUT1 = ON\n\n"),
    ("W137", WBC, "GOTO MAIN\nMAIN:\nEND\n", "JUMP MAIN\nMAIN:\nEND\n"),
    ("W139", WBC, "CFGINT_IN1 = RIS\nEND\nHARDINT_IN1:\nRETURN\n", "CFGINT_IN1 = RIS\nEND\nINT_IN1:\nRETURN\n"),
    ("W141", WBC, "#speed = 5\n$I0 = speed\n", "#speed  5\n$I0 = speed\n"),
    ("W144", WBC, "DELAY (1)\n", "DELAY 1\n"),
    ("W150", CSV, "row;1;2\n", "row;1;2;x;x\n"),
    ("W151", CSV, "row;1;;x;1 000\n", "row;1;x;x;1000\n"),
    ("W154", CSV, "row;1;2;3;4\n\nb;1;2;3;4\n", "row;1;2;3;4\nb;1;2;3;4\n"),
    ("W206", WBC, "n = 1\nEND\n", "\nEND\n"),
    ("W206", WBC, "Vmax1 = 5\nEND\n", "VmaxM1 = 5\nEND\n"),
    ("W207", WBC, "PABS M1 100\n", "M1 = ON\nPABS M1 100\n"),
    ("W208", WBC, "CFGINT_IN3 = FALL\n", "CFGINT_IN3 = FALL\nEND\nINT_IN3:\nRETURN\n"),
    ("W211", WBC, "$I0 = 40000\n", "$I0 = 32767\n"),
    ("W212", WBC, "DELAY 0.001\n", "DELAY 0.01\n"),
    ("W214", WBC, "SET $R0 = min(1,2)\n", "SET $R0 = min(1, 2)\n"),
    ("W220", WBC, "INPUT1 = 1\nOUT1 = INPUT1\n", "IN1 = 1\nOUT1 = INPUT1\n"),
    ("W222", WBC, "DELAY 500\n", "DELAY 0.5\n"),
    ("W223", WBC, "M1 = ON\nVABS M1 -64.5\nWAIT IN1 = ON\n", "M1 = ON\nVABS M1 -20\nWAIT IN1 = ON\n"),
    ("W223", WBC, "VmaxM1 = 20,01\n", "VmaxM1 = 20\n"),
    ("W250", CSV, "górna;1;2;3;4\n", "gorna;1;2;3;4\n"),
    ("M101", CHIP, "S200\n120\nE\n", "S200\nL20\nE\n"),
    ("M102", CHIP, "F-640\nR\n", "B640\nR\n"),
    ("M102", CHIP, "F1O0\nR\n", "F100\nR\n"),
    ("M103", CHIP, "F64R\n", "F64\nR\n"),
    ("M104", CHIP, "R9\n", "R\n"),
    ("M106", CHIP, "@6\nI116\n", "@6\nI1L6\n"),
    ("M110", CHIP, "L256\nE\n", "L255\nE\n"),
    ("M110", CHIP, "@16\nJ16\n", "@1\nJ1\n"),
    ("M111", CHIP, "M1\nQ1\nF7\nR\n", "M1\nQ1\nF64\nR\n"),
    ("M124", CHIP, "F64\nR\nE\n", "F64\nR\n\n"),
    ("M130", CHIP, "[\nF64\nR\n", "[\nF64\nR\n]\n"),
    ("M131", CHIP, "F64\nR\n]\n", "F64\nR\n\n"),
    ("M132", CHIP, "[\n[\nF64\nR\n]\n", "[\n\nF64\nR\n]\n"),
    ("M202", CHIP, "F12 800\nR\n", "F12800\nR\n"),
    ("M206", CHIP, "@1\nF64\nR\n", "\nF64\nR\n"),
    ("M216", CHIP, ">3\n", "\\\n>3\n"),
    ("C001", CFG, "[Axis0]\nsomething\nGear=2\n", "[Axis0]\n; something\nGear=2\n"),
    ("C002", CFG, "[Axis0]\nGear=2\n[Axis1\n", "[Axis0]\nGear=2\n[Axis1]\n"),
    ("C003", CFG, "[Axis0]\nGear=2\nGear=3\n", "[Axis0]\nGear=2\n; Gear=3\n"),
    ("C005", CFG, "[Axis0]\nGaer=2\n", "[Axis0]\nGear=2\n"),
    ("C006", CFG, "[Axis0]\nGear=1 000\n", "[Axis0]\nGear=1000\n"),
    ("C007", CFG, "[Axis0]\nMotResol=3200.4\n", "[Axis0]\nMotResol=3200\n"),
    ("C008", CFG, "[Axis0]\nGear=2\n[AIN0]\nID=300\n", "[Axis0]\nGear=2\n[AIN0]\nID=247\n"),
    ("C008", CFG, "[AIN0]\nBaud=38000\n", "[AIN0]\nBaud=38400\n"),
    ("D002", TOML, '[mic488]\nname = "table"\n', A_TABLE),
    ("D003", TOML, AN_AXIS + 'kind = "linaer"\n', AN_AXIS + 'kind = "linear"\n'),
    ("D004", TOML, AN_AXIS + "pich = 5.0\n", AN_AXIS + "pitch = 5.0\n"),
    (
        "D007",
        TOML,
        A_TABLE + '[[source]]\nto = "table.AIN1"\nvalue = 1\nphase = 90\n',
        A_TABLE + '[[source]]\nto = "table.AIN1"\nvalue = 1\n',
    ),
    (
        "D008",
        TOML,
        A_TABLE + "[[event]]\nat = 1\nsteps = [{ prss = 1 }]\n",
        A_TABLE + "[[event]]\nat = 1\nsteps = [{ press = 1 }]\n",
    ),
    ("D009", TOML, AN_AXIS.replace('"table.M1"', '"tabel.M1"'), AN_AXIS),
]

_NAME = "the author has to choose a name"
_PART = "what is missing is not known"
_PLACE = "where it belongs is not known"
_WAY = "there are several ways out, which move the machine differently"
_LIMIT = "it is more than the controller holds: something has to go"
_OTHER = "the controller has none: the author has to choose another one"
_IMAGE = "it is about an image, not about a text"
NOT_FIXED = {
    **dict.fromkeys(("W107", "W108", "W142", "W152", "D006"), _NAME),
    **dict.fromkeys(("W109", "W118", "M105", "D005"), _PART),
    **dict.fromkeys(("W132", "W133", "W135", "M123", "M127", "M208", "W217"), _PLACE),
    **dict.fromkeys(("W123", "W136", "W153", "M122", "M125", "M135"), _LIMIT),
    **dict.fromkeys(("W124", "W125", "W129", "W138", "W140", "W143", "M113", "M120", "M209", "M214"), _OTHER),
    **dict.fromkeys(("W145", "W160", "W161", "W216", "W260"), _IMAGE),
    **dict.fromkeys(("W146", "W209"), "the values of the row are the author's"),
    **dict.fromkeys(("W201", "W202", "W203", "W205", "W210", "W218", "W219", "W221", "W225", "W226"), _WAY),
    **dict.fromkeys(("W204", "M207"), "the code is needless, or the way to it is missing"),
    "W224": "which number is meant is the author's to say",
    "W213": "what is read instead depends on what it is for",
    "W215": "the position table is a file",
    UNUSED_ROW: "without it all later rows have other numbers",
    **dict.fromkeys(("M112", "M114", "M126", "M201", "M210", "M211", "M212", "M213", "M221", "M222", "M223"), _WAY),
    **dict.fromkeys(("M121", "M133", "M134", "M203", "M204", "M205", "M215", "M217", "M218", "M219", "M220"), _WAY),
    "C004": "the file is not text",
    **dict.fromkeys(("C009", "C010"), _WAY),
    "C011": "the file is of another kind",
    "D001": "the text cannot be read at this place",
    "D010": "the error is in another file, which has its own fix",
    "D011": "the number is in a data sheet",
}


def _codes() -> set[str]:
    """All codes of the tables and, of configurations and descriptions, in the sources that report them."""
    found = {*FINDINGS, *(finding.code for finding in findings.TABLE), UNUSED_ROW}
    for folder, letter in (("mic488", "C0"), ("simulation", "D0")):
        for file in (SOURCES / folder).rglob("*.py"):
            found.update(re.findall(rf'"({letter}\d\d)"', file.read_text()))
    return found


def test_every_code_has_a_fix_or_a_reason_why_it_has_none() -> None:
    fixed = {code for code, *_ in FIXED}
    assert fixed.isdisjoint(NOT_FIXED)
    assert fixed | set(NOT_FIXED) == _codes()


@pytest.mark.parametrize(("code", "uri", "text", "mended"), FIXED, ids=[f"{code}-{n}" for n, (code, *_) in enumerate(FIXED)])
def test_a_fix_mends_what_it_is_for(code: str, uri: str, text: str, mended: str) -> None:
    """All actions for a code, as an editor applies them."""
    old = "1.23" if code == "W139" else "1.70"
    world = f'[[mic488]]\nname = "m"\nfirmware = "{old}"\nprogram = "m.prg"\nconfig = "p.cfg"\n'
    gear = {"p_cfg": "[Axis0]\nGear=3200\n"} if code == "W223" else {}
    made = EditorSession(Shelf(w_toml=world, m_csv="ROW;1;x;x;x\n", **gear))
    made.open(uri, "", 1, text)
    actions = [action for action in navigation.fixes(made, uri, Span(0, len(text))) if action.mends.code == code]
    assert actions
    edits = sorted({edit for action in actions for edit in action.edits[uri]}, key=lambda edit: edit.span, reverse=True)
    for edit in edits:
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == mended
    made.open(uri, "", 2, text)
    left = made.analysis(uri)
    assert left is not None
    assert code not in {d.code for d in left.diagnostics()} or code == "W220"
