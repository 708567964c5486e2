"""PDUs in words: golden texts, and the promise never to raise."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.mic488.describe import AxisScale, Wording
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import FIRMWARES, register_map

MM = AxisScale("mm", 100.0)
REV = AxisScale("rev", 12800.0)


def wording(data_type: DataType = DataType.REAL, scales: tuple[AxisScale, ...] = (MM, MM, MM, MM), name: str = "1.70") -> Wording:
    return Wording(register_map(name), scales, data_type)


def pdu(text: str) -> bytes:
    return bytes.fromhex(text)


def real(*values: float) -> str:
    """REALs as registers: low word first, each big-endian."""
    halves = [struct.pack(">f", value).hex() for value in values]
    return "".join(h[4:] + h[:4] for h in halves)


# The frames of the manual, without slave address and CRC.
READ_INPUTS = "02 1388 0008"
OUT2_OFF = "05 1771 0000"
READ_POSITION_1_23 = "03 03FC 0002"
READ_POSITION_1_70 = "03 2724 0002"

REQUESTS = [
    (READ_INPUTS, "read IN1 … IN8"),
    (OUT2_OFF, "write OUT2 = OFF"),
    (READ_POSITION_1_70, "read M1_POS_ACT"),
    ("01 1770 0008", "read OUT1 … OUT8"),
    ("05 07D0 FF00", "write M1_EN = ON"),
    ("05 0836 FF00", "write USER_REG_ZERO = ON"),
    ("05 2710 FF00", "write 10000 (unmapped) = ON"),
    ("03 2724 0008", "read M1_POS_ACT … M4_POS_ACT"),
    (
        "03 2724 0028",
        "read M1_POS_ACT … M4_POS_ACT, M1_VEL_ACT … M4_VEL_ACT, M1_ACC … M4_ACC, M1_DEC … M4_DEC, M1_VMAX … M4_VMAX",
    ),
    ("03 271A 0004", "read M1_STATUS … M4_STATUS"),
    ("03 0000 000A", "read USER_REGISTER 0 … 9"),
    ("03 0007 0001", "read USER_REGISTER 7"),
    ("03 07CE 0004", "read USER_REGISTER 1998 … 1999, 2000…2001 (unmapped)"),
    ("03 2723 0002", "read 10019 (unmapped), half of M1_POS_ACT at 10020 (0x2724)"),
    ("06 2710 0001", "write DATA_TYPE = DINT (1)"),
    ("06 2710 0007", "write DATA_TYPE = 7"),
    ("06 2717 0007", "write AXIS_POS_ABS_TRIG = M1 M2 M3 (7)"),
    ("06 2720 0000", "write M_STOP = none (0)"),
    ("06 2711 0003", "write PROG_BANK_SEL = 3"),
    ("06 0005 FFFF", "write USER_REGISTER 5 = 65535"),
    ("03 2725 0004", "read half of M1_POS_ACT at 10021 (0x2725), M2_POS_ACT, half of M3_POS_ACT at 10024 (0x2728)"),
    ("06 2725 FFFB", "write half of M1_POS_ACT at 10021 (0x2725) = FFFB"),
    ("10 2754 0002 04" + real(2.5), "write M1_VEL_ABS = 2.5 mm/s"),
    ("10 2764 0006 0C" + real(10, 15, 20), "write M1_POS_ABS … M3_POS_ABS = 10, 15, 20 mm"),
    ("10 2734 0002 04" + real(1000), "write M1_ACC = 1000 mm/s²"),
    ("10 2713 0002 04 0001 0001", "write PROGRAM_CTRL = START (1); AXIS_CTR_MODE = TRIGGER (1)"),
    ("10 2774 0002 04 FFFF FFFF", "write ENC1_IMP = -1 imp"),
    ("2B 0E01", "function 43 (2Bh): not implemented by the device"),
    ("03 2724 0000", "function 3 (03h): quantity 0 is outside 1 to 125"),
    ("05 07D0 1234", "function 5 (05h): coil value 1234 is neither FF00 nor 0000"),
    ("", "empty request"),
]


@pytest.mark.parametrize(("frame", "text"), REQUESTS)
def test_requests(frame: str, text: str) -> None:
    assert wording().request(pdu(frame)) == text


def test_the_manual_s_frame_of_1_23() -> None:
    assert wording(name="1.23").request(pdu(READ_POSITION_1_23)) == "read M1_POS_ACT"


def test_mic_6_function_06_on_jog_speed_is_signed_and_in_units() -> None:
    assert wording(DataType.DINT).request(pdu("06 2721 FFFB")) == "write JOG_SPEED = -5 u/s"
    assert wording(DataType.DINT).request(pdu("10 2721 0002 04" + real(2.5))) == "write JOG_SPEED = 2.5 u/s"


RESPONSES = [
    ("03 2724 0008", "03 10" + real(12.5, 0, 0, 0), "read M1_POS_ACT … M4_POS_ACT = 12.5, 0, 0, 0 mm"),
    (
        "03 271A 0004",
        "03 08 0004 0003 0000 0007",
        "read M1_STATUS … M4_STATUS = position reached (4), moving to position (3), off (0), 7",
    ),
    (READ_INPUTS, "02 01 05", "read IN1 … IN8 = IN1, IN3 on"),
    (READ_INPUTS, "02 01 00", "read IN1 … IN8 = all off"),
    (READ_INPUTS, "02 01 FF", "read IN1 … IN8 = all on"),
    ("02 1388 0001", "02 01 01", "read IN1 = ON"),
    ("02 1399 0005", "02 01 12", "read IN18 … IN20 = IN19 on, 5020…5021 (unmapped) = 01"),
    ("03 0000 000A", "03 14" + "0001" * 10, "read USER_REGISTER 0 … 9 = 1, 1, 1, 1, 1, 1, 1, 1, … (10 words)"),
    ("03 0000 0008", "03 10" + "0001" * 8, "read USER_REGISTER 0 … 7 = 1, 1, 1, 1, 1, 1, 1, 1"),
    ("05 07D0 FF00", "05 07D0 FF00", "wrote M1_EN = ON"),
    ("06 2710 0001", "06 2710 0001", "wrote DATA_TYPE = DINT (1)"),
    ("10 2754 0002 04" + real(2.5), "10 2754 0002", "wrote M1_VEL_ABS"),
    ("03 2775 0001", "83 02", "exception 02 illegal data address (10101)"),
    ("06 2710 0007", "86 03", "exception 03 illegal data value (10000)"),
    ("2B 0E01", "AB 01", "exception 01 illegal function (function 43 (2Bh))"),
    ("03 2724 0002", "83 63", "exception 99 unknown exception (10020)"),
    # Not what was asked for: nothing is invented.
    ("03 2724 0002", "03 02 0007", "read registers 7"),
    ("03 2724 0002", "02 01 07", "read bits 07"),
    ("03 2724 0002", "03", "malformed: a response of 1 bytes is too short"),
]


@pytest.mark.parametrize(("asked", "frame", "text"), RESPONSES)
def test_responses(asked: str, frame: str, text: str) -> None:
    assert wording().response(pdu(frame), pdu(asked)) == text


def test_a_response_without_its_request_shows_what_can_be_known() -> None:
    assert wording().response(pdu("03 04 0001 0002")) == "read registers 1, 2"
    assert wording().response(pdu("01 01 0F")) == "read bits 0f"
    assert wording().response(pdu("83 02")) == "exception 02 illegal data address (function 3 (03h))"


def test_dint_shows_pulses_and_units() -> None:
    """Manual 4.9: 12800 imp/rev, 2.5 rev/s are 32000, 57600 imp are 4.5 rev."""
    words = wording(DataType.DINT, (REV, REV, MM, AxisScale("imp", 1.0)))
    assert words.request(pdu("10 2754 0002 04 7D00 0000")) == "write M1_VEL_ABS = 32000 imp/s (2.5 rev/s)"
    assert words.response(pdu("03 04 E100 0000"), pdu(READ_POSITION_1_70)) == "read M1_POS_ACT = 57600 imp (4.5 rev)"
    two = words.response(pdu("03 08 E100 0000 FFFF FFFF"), pdu("03 2726 0004"))
    assert two == "read M2_POS_ACT … M3_POS_ACT = 57600, -1 imp (4.5 rev, -0.01 mm)"
    assert words.response(pdu("03 04 E100 0000"), pdu("03 272A 0002")) == "read M4_POS_ACT = 57600 imp"


def test_axes_with_different_units_show_each_its_own() -> None:
    words = wording(scales=(MM, REV, MM, MM))
    assert words.response(pdu("03 08" + real(1.5, 2.5)), pdu("03 2724 0004")) == "read M1_POS_ACT … M2_POS_ACT = 1.5 mm, 2.5 rev"


def test_without_scales_the_unit_is_u() -> None:
    assert wording(scales=()).request(pdu("10 2754 0002 04" + real(2.5))) == "write M1_VEL_ABS = 2.5 u/s"


def test_numbers_that_are_none_are_shown() -> None:
    assert wording().request(pdu("10 2754 0002 04 0000 7FC0")) == "write M1_VEL_ABS = nan mm/s"


BYTES = st.binary(max_size=64)
NEAR = st.builds(
    lambda function, address, rest: struct.pack(">BH", function, address) + rest,
    st.sampled_from([1, 2, 3, 5, 6, 16]),
    st.one_of(st.integers(0, 0xFFFF), st.integers(990, 1140), st.integers(9990, 10140), st.integers(4990, 6010)),
    st.one_of(st.binary(max_size=20), st.integers(0, 300).map(lambda n: struct.pack(">H", n))),
)


@given(st.one_of(BYTES, NEAR), st.one_of(st.none(), BYTES, NEAR), st.sampled_from(list(FIRMWARES)), st.sampled_from(DataType))
def test_anything_can_be_put_into_words(frame: bytes, other: bytes | None, name: str, data_type: DataType) -> None:
    words = wording(data_type, (REV, MM), name)
    assert words.request(frame)
    assert words.response(frame, other)


@given(st.integers(9990, 10140), st.integers(1, 60), st.sampled_from(DataType), st.data())
def test_every_block_of_registers_can_be_put_into_words(
    address: int, count: int, data_type: DataType, data: st.DataObject
) -> None:
    content = data.draw(st.binary(min_size=2 * count, max_size=2 * count))
    words = wording(data_type, (REV, MM, MM, REV))
    asked = struct.pack(">BHH", 3, address, count)
    text = words.response(bytes((3, 2 * count)) + content, asked)
    assert text.startswith("read ")
    assert " = " in text
    written = words.request(struct.pack(">BHHB", 16, address, count, 2 * count) + content)
    assert written.removeprefix("write ") == text.removeprefix("read ")
