"""The compiled image, against bytes typed from its description: every record of the documented operations."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.wbc.check import check
from steptwin.wbc.image import build
from steptwin.wbc.positions import parse_positions

PROGRAM = """\
#pump OUT3
#slow 2,5
M1 = ON
AccM1 = slow
SET LimRM2 = VmaxM3
HOME M1 -20
WAITPOS
CFGINT_IN2 = RIS_FALL
MAIN:
WAIT IN6 = 1
IF StatM1 > 3
    pump = ON
ELSE
    pump = OFF
ENDIF
WHILE OUT8 < IN1
    DELAY 0,5
ENDWHILE
IF DecM4 = LimLM1
ENDIF
MOVEPTP @top
MOVEPTP 1
JUMP MAIN
INT_IN2:
DELAY AccM2
RETURN
"""

# Slot by slot, from section 8 of the language reference; what a row leaves out is zero.
RECORDS = """\
01 06 01 00 00 FE 00 00 80 3F F9 F9
01 07 01 00 00 FF 00 00 20 40 F9 F9
01 10 02 00 00 0A 03 00 00 00 F9 F9
0E 06 01 FE 00 00 A0 C1
15
01 14 02 00 00 FE 00 00 40 40 F9 F9
07 02 06 00 00 00 3D FE 00 00 80 3F
02 0C 01 00 00 00 3E FE 00 00 40 40 0B 00 09 00
01 00 03 00 00 FE 00 00 80 3F F9 F9
04 00 00 00 00 00 00 00 00 00 00 00 0B 00
01 00 03 00 00 FE 00 00 00 00 F9 F9
03
05 00 08 00 00 00 3C 02 01 00 00 00 0E 00
08 FF 00 00 00 3F
06 00 08 00 00 00 3C 02 01 00 00 00 0C 00
02 08 04 00 00 00 3D 0F 01 00 00 00 10 00 00 00
03
16 FE 00 00 00 00
16 FE 00 00 80 3F
09 06 00
0B 01 14 00
08 07 02 00 00 00
0A
"""

TABLE = "top;1;2,5;x;x\nrest;x;-20;x;0.5\n"
# Mask with the high byte first, then four values; x keeps the value of the row before, 0 in the first row.
ROWS = """\
00 03 00 00 80 3F 00 00 20 40 00 00 00 00 00 00 00 00
00 0A 00 00 80 3F 00 00 A0 C1 00 00 00 00 00 00 00 3F
"""


def crc_modbus(data: bytes) -> int:
    """CRC-16/MODBUS by its definition, bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def built(text: str, table: str = "") -> bytes:
    positions, wrong = parse_positions(table)
    assert wrong == []
    checked = check(text, positions)
    assert checked.executable is not None, checked.errors
    data, diagnostics = build(checked.executable, positions)
    assert diagnostics == []
    assert data is not None
    return data


def refused(text: str, table: str = "") -> list[tuple[str, str]]:
    """Code and source text of what the builder names."""
    positions, _ = parse_positions(table)
    checked = check(text, positions)
    assert checked.executable is not None, checked.errors
    data, diagnostics = build(checked.executable, positions)
    assert data is None
    return [
        (d.message.removesuffix(" has no documented form in the image"), text[d.span.start : d.span.end]) for d in diagnostics
    ]


def test_every_documented_operation_byte_for_byte() -> None:
    records = [bytes.fromhex(line).ljust(16, b"\0") for line in RECORDS.splitlines()]
    rows = [bytes.fromhex(line) for line in ROWS.splitlines()]
    image = built(PROGRAM, TABLE)
    assert len(image) == 20_094
    slots = [image[n : n + 16] for n in range(0, 16 * len(records), 16)]
    assert [slot.hex(" ") for slot in slots] == [record.hex(" ") for record in records]
    commands, table = b"".join(records), b"".join(rows)
    expected = b"".join(
        (
            commands + bytes(16_000 - len(commands)),
            b"\x17\x00" + crc_modbus(commands).to_bytes(2, "big"),
            table + bytes(227 * 18 - len(table)),
            b"\x02\x00" + crc_modbus(table).to_bytes(2, "big"),
        )
    )
    assert image[16_000:16_004] == expected[16_000:16_004]
    assert image[16_004:20_090] == expected[16_004:20_090]
    assert image == expected


def test_an_empty_program_has_the_crc_of_nothing() -> None:
    assert built("") == bytes(16_002) + b"\xff\xff" + bytes(4086 + 2) + b"\xff\xff"


def test_labels_take_no_slot() -> None:
    image = built("A:\nB:\nOUT1 = ON\nC:\nJUMP C\n")
    assert image[16:19] == bytes.fromhex("09 01 00")
    assert image[16_000:16_002] == b"\x02\x00"


def test_a_thousand_lines_fill_the_image() -> None:
    assert built("OUT1 = ON\n" * 1000)[16_000:16_002] == b"\xe8\x03"
    positions, _ = parse_positions("")
    checked = check("OUT1 = ON\n" * 1001, positions)
    assert checked.executable is not None
    data, diagnostics = build(checked.executable, positions)
    assert data is None
    assert [(d.code, d.span.start) for d in diagnostics] == [("W161", 10_000)]


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("PABS M1 5", "PABS"),
        ("PREL M1 5", "PREL"),
        ("VABS M1 5", "VABS"),
        ("VREL M1 5", "VREL"),
        ("BRAKE M1", "BRAKE"),
        ("STOP M1", "STOP"),
        ("END", "END"),
        ("PROGRESET", "PROGRESET"),
        ("MOVELIN @P", "MOVELIN"),
        ("MOVELIN_REL @P", "MOVELIN_REL"),
        ("MOVETOCIRC @P", "MOVETOCIRC"),
        ("DOCIRC @P", "DOCIRC"),
        ("DOARC @P", "DOARC"),
        ("PULSE(OUT1, 2)", "PULSE"),
        ("OUT1 = IN1 + IN2", "the operator +"),
        ("AccM1 = sin(AccM2)", "the function SIN"),
        ("OUT1 = PosM1", "the register PosM1"),
        ("$I5 = 1", "the register $I5"),
        ("OUTPUTS = 1", "the register OUTPUTS"),
        ("WAIT StatM1 >= 3", "the comparison >="),
    ],
)
def test_what_is_not_documented_is_refused_by_name(line: str, name: str) -> None:
    assert refused(f"M1 = ON\n{line}\n", "P;1;2;3;1\n") == [(name, line)]


# WBC-40: op, then the operands of HOME and MOVEPTP; classes in the order of the registers.
INFERRED = """\
0F 06 01 FE 00 00 20 41  VABS M1 10
10 06 02 FE 00 00 A0 C0  VREL M2 -5
11 06 03 FF 00 00 20 40  PABS M3 2,5
12 06 04 07 01 00 00 00  PREL M4 AccM1
13 06 01                 BRAKE M1
14 06 04                 STOP M4
17 FE 00 00 00 00        MOVELIN @P
18 FE 00 00 00 00        MOVELIN_REL @P
19 FE 00 00 00 00        MOVETOCIRC @P
1A FE 00 00 00 00        DOCIRC @P
1B FE 00 00 00 00        DOARC @P
1C                       PROGRESET
01 01 00 00 00 FE 00 00 80 3F F9 F9  OUTPUTS = 1
01 07 02 00 00 03 00 00 00 00 F9 F9  AccM2 = INPUTS
01 07 02 00 00 04 02 00 00 00 F9 F9  AccM2 = AIN2
07 05 00 00 00 00 3D FE 00 00 00 00  WAIT STATUS = 0
01 09 03 00 00 FE 00 00 00 00 F9 F9  PosM3 = 0
07 0B 01 00 00 00 3E FE 00 00 00 00  WAIT VactM1 > 0
01 0D 04 00 00 FE 00 00 00 00 F9 F9  ENC4 = 0
07 0E 01 00 00 00 3C FE 00 00 00 00  WAIT XENC1 < 0
"""


@pytest.mark.parametrize("row", INFERRED.splitlines())
def test_wbc_40_inferred_forms_are_written_only_on_request(row: str) -> None:
    record, line = row.split("  ", 1)
    text = f"M1 = ON\nM2 = ON\nM3 = ON\nM4 = ON\n{line.strip()}\n"
    positions, _ = parse_positions("P;1;2;3;1\n")
    executable = check(text, positions).executable
    assert executable is not None
    data, diagnostics = build(executable, positions)
    assert data is None
    assert [(d.code, d.hint) for d in diagnostics] == [("W160", "--inferred writes it in a form that was never seen (WBC-40)")]
    data, diagnostics = build(executable, positions, inferred=True)
    assert diagnostics == []
    assert data is not None
    assert data[64:80].hex(" ") == bytes.fromhex(record).ljust(16, b"\0").hex(" ")


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        *((line, None) for line in ("END", "PULSE(OUT1, 2)", "OUT1 = IN1 + IN2", "$I5 = 1")),
        ("WAIT StatM1 >= 3", "< is its opposite: an IF with < and its branches exchanged does the same"),
        ("WAIT StatM1 <= 3", "> is its opposite: an IF with > and its branches exchanged does the same"),
    ],
)
def test_wbc_40_what_cannot_be_inferred_stays_refused(line: str, hint: str | None) -> None:
    executable = check(f"M1 = ON\n{line}\n").executable
    assert executable is not None
    data, diagnostics = build(executable, parse_positions("")[0], inferred=True)
    assert data is None
    assert [(d.code, d.hint) for d in diagnostics] == [("W160", hint)]


def test_variables_and_other_interrupts_are_refused() -> None:
    assert refused("x = IN1\nOUT1 = x\n") == [("the variable x", "x = IN1"), ("the variable x", "OUT1 = x")]
    text = "CFGINT_IN1 = RIS\nWAIT IN1 = 1\nJUMP A\nA:\nWAIT IN2 = 1\nJUMP A\nHARDINT_IN1:\nRETURN\nINT_TICK:\nRETURN\n"
    assert refused(text) == [("the label HARDINT_IN1", "HARDINT_IN1:"), ("the label INT_TICK", "INT_TICK:")]


def test_every_reason_is_named_at_once() -> None:
    assert [name for name, _ in refused("PABS M1 5\nM1 = ON\nEND\n")] == ["PABS", "END"]


def test_a_table_that_the_image_cannot_hold_is_refused() -> None:
    executable = check("OUT1 = ON\n").executable
    assert executable is not None
    for rows, refusal in ((227, None), (228, "228 rows of positions: the image holds 227")):
        table, _ = parse_positions("".join(f"p{n};1;2;3;4\n" for n in range(rows)))
        if refusal is None:
            assert len(build(executable, table)[0] or b"") == 20_094
        else:
            with pytest.raises(Misuse, match=refusal):
                build(executable, table)
