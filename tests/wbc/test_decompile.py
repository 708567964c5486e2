"""Decompiling and building again gives the same bytes, whatever the records are."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from steptwin.errors import Misuse
from steptwin.wbc.check import check
from steptwin.wbc.decompile import MARK, Decompiled, ImageError, decompile, program_of, read_image
from steptwin.wbc.image import SIZE, build, image_of
from steptwin.wbc.positions import parse_positions


def again(decompiled: Decompiled) -> bytes | None:
    """What building gives of the texts a user would have in files."""
    positions, wrong = parse_positions(decompiled.positions.text)
    assert wrong == []
    checked = check(decompiled.text, positions)
    assert checked.executable is not None, checked.errors
    return build(checked.executable, positions, inferred=True)[0]


def image(records: str, rows: str = "") -> bytes:
    slots = [bytes.fromhex(line).ljust(16, b"\0") for line in records.splitlines() if line.strip()]
    return image_of(slots, [bytes.fromhex(line) for line in rows.splitlines() if line.strip()])


KNOWN = """
    01 06 01 00 00 FE 00 00 80 3F F9 F9
    02 02 03 00 00 00 3D FE 00 00 80 3F 05 00 03 00
    01 00 03 00 00 FF CD CC CC 3D F9 F9
    04 00 00 00 00 00 00 00 00 00 00 00 05 00
    08 FE 00 00 A0 40
    03
    05 0C 01 00 00 00 3C FE 00 00 80 40 08 00
    15
    06 0C 01 00 00 00 3C FE 00 00 80 40 06 00
    16 FE 00 00 80 3F
    0E 06 02 FE 00 00 A0 C1
    09 01 00
    0B 01 0C 00
    0A
"""
KNOWN_ROWS = """
    00 03 00 00 80 3F 00 00 20 40 00 00 00 00 00 00 00 00
    00 0A 00 00 80 3F 00 00 A0 C1 00 00 00 00 CD CC CC 3D
"""
KNOWN_TEXT = """\
// Decompiled from a compiled image: labels and names of positions are invented.
SET M1 = 1
L1:
IF IN3 = 1
    SET OUT3 = 0.1
ELSE
    DELAY 5
ENDIF
WHILE StatM1 < 4
    WAITPOS
ENDWHILE
MOVEPTP @P1
HOME M2 -20
JUMP L1
INT_IN2:
RETURN
"""


def test_known_records_become_statements() -> None:
    found = decompile(image(KNOWN, KNOWN_ROWS))
    assert found.text == KNOWN_TEXT
    assert found.positions.text == "P0;1;2.5;x;x\nP1;x;-20;x;0.1\n"
    assert found.unknown == 0
    assert again(found) == image(KNOWN, KNOWN_ROWS)


def test_wbc_40_inferred_statements_are_marked() -> None:
    records = (
        "01 06 01 00 00 FE 00 00 80 3F F9 F9\n11 06 01 FE 00 00 20 41\n15\n07 09 01 00 00 00 3E FE 00 00 80 3F\n13 06 01\n1C\n"
    )
    found = decompile(image(records))
    assert found.text.splitlines()[1:] == [
        "SET M1 = 1",
        "PABS M1 10  // inferred",
        "WAITPOS",
        "WAIT PosM1 > 1  // inferred",
        "BRAKE M1  // inferred",
        "PROGRESET  // inferred",
    ]
    assert (found.unknown, found.inferred) == (0, 4)
    assert again(found) == image(records)


def unknown(records: str, rows: str = "") -> list[str]:
    """The lines that stay data; the round trip is checked on the way."""
    found = decompile(image(records, rows))
    assert again(found) == image(records, rows)
    return [line for line in found.text.splitlines() if line.startswith("//!")]


@pytest.mark.parametrize(
    "record",
    [
        "0C 01 02 03",  # unknown operation
        "1D",
        "13 06 05",  # M5
        "13 06 01 01",  # BRAKE with something behind it
        "17 FE 00 00 80 3F",  # a row that does not exist
        "01 01 03 00 00 FE 00 00 80 3F F9 F9",  # OUTPUTS has no number
        "0A 00 00 01",  # RETURN with something behind it
        "15 00 00 00 00 00 00 00 00 00 00 00 00 00 00 01",
        "01 11 01 00 00 FE 00 00 80 3F F9 F9",  # unknown register class
        "01 03 00 00 00 FE 00 00 80 3F F9 F9",  # INPUTS as destination
        "01 00 09 00 00 FE 00 00 80 3F F9 F9",  # OUT9
        "01 02 01 00 00 FE 00 00 80 3F F9 F9",  # an input as destination
        "01 00 01 00 00 FE 00 00 00 3F F9 F9",  # a fraction marked as whole
        "01 00 01 00 00 FF 00 00 80 3F F9 F9",  # a whole number marked as fraction
        "01 00 01 00 00 FF 00 00 C0 7F F9 F9",  # not a number
        "01 00 01 00 00 FE 00 00 80 3F F9 F8",  # something where no operator stands
        "07 02 01 00 00 00 21 FE 00 00 80 3F",  # unknown condition
        "07 02 01 00 00 00 3D FF 00 00 C0 7F",  # not a number on the right
        "02 02 01 00 00 00 3D FE 00 00 80 3F 00 00",  # IF without ENDIF
        "03",  # ENDIF without IF
        "05 02 01 00 00 00 3D FE 00 00 80 3F 09 00",  # WHILE beyond the program
        "09 01 00",  # JUMP beyond the program
        "0B 1F 00 00",  # there is no IN32
        "0B 00 01 00",  # an entry that names another slot
        "0E 06 05 FE 00 00 80 3F",  # M5
        "0E 05 01 FE 00 00 80 3F",
        "16 FE 00 00 80 3F",  # a row that does not exist
    ],
)
def test_a_record_the_builder_would_not_write_stays_data(record: str) -> None:
    assert unknown(record) == [f"//!record {bytes.fromhex(record).ljust(16, bytes(1)).hex().upper()}"]


def test_a_jump_to_a_handler_has_the_name_of_its_interrupt() -> None:
    data = image("09 01 00\n0B 04 01 00\n0A\n")
    found = decompile(data)
    assert found.text.splitlines()[1:] == ["JUMP INT_IN5", "INT_IN5:", "RETURN"]
    assert again(found) == data


def test_a_jump_to_a_handler_that_no_input_has_keeps_its_label() -> None:
    """There is no IN32."""
    data = image("09 01 00\n0B 1F 01 00\n0A\n")
    found = decompile(data)
    assert found.text.splitlines()[1:3] == ["JUMP L1", "L1:"]
    assert found.unknown == 1
    assert again(found) == data


def test_an_else_beyond_its_block_stays_data() -> None:
    assert len(unknown("02 02 01 00 00 00 3D FE 00 00 80 3F 02 00 09 00\n15\n03\n")) == 2


def test_blocks_in_blocks_are_written_as_blocks() -> None:
    text = """\
WHILE IN1 = 1
    IF IN2 = 1
        WHILE IN3 = 1
            WAITPOS
        ENDWHILE
    ELSE
        IF IN4 = 1
            WAITPOS
        ENDIF
    ENDIF
ENDWHILE
IF IN5 = 1
    WAITPOS
ENDIF
"""
    table, _ = parse_positions("")
    checked = check(text, table)
    assert checked.executable is not None
    data, findings = build(checked.executable, table, inferred=True)
    assert findings == []
    assert data is not None
    found = decompile(data)
    assert found.text.splitlines()[1:] == text.splitlines()


def test_blocks_that_do_not_nest_stay_data() -> None:
    condition = "00 01 00 00 00 3D FE 00 00 80 3F"
    records = f"""
        02 {condition} 02 00 00 00
        05 {condition} 03 00
        03
        06 {condition} 01 00
    """
    assert len(unknown(records)) == 2


@pytest.mark.parametrize(
    "row",
    [
        "00 10 00 00 80 3F 00 00 00 00 00 00 00 00 00 00 00 00",  # a fifth axis
        "00 00 00 00 80 3F 00 00 00 00 00 00 00 00 00 00 00 00",  # a value that is neither given nor kept
        "00 01 00 00 C0 7F 00 00 00 00 00 00 00 00 00 00 00 00",  # not a number
    ],
)
def test_a_row_no_table_can_express_stays_data(row: str) -> None:
    assert unknown("15", row) == [f"//!position 0 {row.replace(' ', '')}"]


def test_damage_is_named() -> None:
    good = image(KNOWN, KNOWN_ROWS)
    with pytest.raises(ImageError, match="20093 bytes instead of 20094"):
        read_image(good[:-1])
    with pytest.raises(ImageError, match="CRC of the commands"):
        read_image(b"\x09" + good[1:])
    with pytest.raises(ImageError, match="CRC of the positions"):
        read_image(good[:16_004] + b"\x01" + good[16_005:])
    with pytest.raises(ImageError, match="1001 commands, permitted are 0…1000"):
        read_image(good[:16_000] + b"\xe9\x03" + good[16_002:])
    with pytest.raises(ImageError, match="228 positions, permitted are 0…227"):
        read_image(good[:20_090] + b"\xe4\x00" + good[20_092:])
    with pytest.raises(ImageError, match="after the 14 commands"):
        read_image(good[:15_999] + b"\x01" + good[16_000:])


@given(st.binary(max_size=64))
def test_no_bytes_make_it_fail_otherwise(data: bytes) -> None:
    for candidate in (data, data.ljust(SIZE, b"\0")):
        with pytest.raises(ImageError):
            decompile(candidate)


def slot_number(limit: int) -> st.SearchStrategy[bytes]:
    return st.integers(0, limit).map(lambda n: struct.pack("<H", n))


reals = st.one_of(
    st.integers(-300, 300).map(lambda n: b"\xfe" + struct.pack("<f", n)),
    st.floats(width=32).map(lambda x: b"\xff" + struct.pack("<f", x)),
)
registers = st.tuples(st.sampled_from((*range(17), 20)), st.integers(0, 9)).map(bytes)
values = st.one_of(reals, registers.map(lambda pair: pair + b"\0\0\0"))
signs = st.sampled_from((b"=", b"<", b">", b"!"))
conditions = st.tuples(values, signs, values).map(b"".join)


@st.composite
def images(draw: DrawFn) -> bytes:
    """Images of records that are right, nearly right or anything."""
    count = draw(st.integers(0, 12))
    slots = slot_number(count)
    record = st.one_of(
        st.binary(min_size=16, max_size=16),
        st.tuples(st.just(b"\1"), registers, st.just(b"\0\0"), values, st.just(b"\xf9\xf9")).map(b"".join),
        st.tuples(st.just(b"\2"), conditions, slots, slots).map(b"".join),
        st.sampled_from((b"\3", b"\x0a", b"\x15")),
        slots.map(lambda slot: b"\4".ljust(12, b"\0") + slot),
        st.tuples(st.sampled_from((b"\5", b"\6")), conditions, slots).map(b"".join),
        conditions.map(lambda condition: b"\7" + condition),
        st.tuples(st.sampled_from((b"\x08", b"\x16")), values).map(b"".join),
        slots.map(lambda slot: b"\x09" + slot),
        st.tuples(st.just(b"\x0b"), st.binary(min_size=1, max_size=1), slots).map(b"".join),
        st.tuples(st.just(b"\x0e\x06"), st.binary(min_size=1, max_size=1), values).map(b"".join),
        st.tuples(
            st.integers(0x0F, 0x14).map(lambda op: bytes((op, 6))), st.integers(0, 5).map(lambda n: bytes((n,))), values
        ).map(b"".join),
        st.tuples(st.integers(0x13, 0x14), st.just(6), st.integers(0, 5)).map(bytes),
        st.tuples(st.integers(0x16, 0x1D).map(lambda op: bytes((op,))), values).map(b"".join),
        st.just(b"\x1c"),
    )
    records = draw(st.lists(record, min_size=count, max_size=count))
    row = st.one_of(
        st.binary(min_size=18, max_size=18),
        st.tuples(st.integers(0, 15).map(lambda mask: bytes((0, mask))), st.binary(min_size=16, max_size=16)).map(b"".join),
    )
    return image_of([record.ljust(16, b"\0") for record in records], draw(st.lists(row, max_size=4)))


@settings(max_examples=80)
@given(images())
def test_round_trip(data: bytes) -> None:
    assert again(decompile(data)) == data


def test_an_image_that_is_to_be_run() -> None:
    source, positions, doubts = program_of(image(KNOWN, KNOWN_ROWS), "a.wbc")
    assert (source.name, source.text, len(positions.rows), doubts) == ("a.wbc", KNOWN_TEXT, 2, [])


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ("15\n13 06 01\n", "1 statement is inferred from the order of the vendor's keywords (WBC-40)"),
        ("13 06 01\n13 06 02\n1C\n", "3 statements are inferred from the order of the vendor's keywords (WBC-40)"),
    ],
)
def test_wbc_40_inferred_statements_of_a_program_are_a_doubt(records: str, message: str) -> None:
    source, _, (doubt,) = program_of(image(records), "a.wbc")
    assert (doubt.code, doubt.message) == ("W260", message)
    assert source.text[doubt.span.start : doubt.span.end] == MARK
    assert source.text.index(MARK) == doubt.span.start


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (image("1D\n15\n"), "cannot run a.wbc: 1 of its records is not known; 'steptwin decompile' shows the others"),
        (image("1D\n15\n1D 01\n"), "cannot run a.wbc: 2 of its records are not known; 'steptwin decompile' shows the others"),
        (b"12", "cannot run a.wbc: not a compiled image: 2 bytes instead of 20094"),
    ],
)
def test_images_that_cannot_be_run(data: bytes, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        program_of(data, "a.wbc")
    assert str(refused.value) == message
