"""A file of sections and keys as text: what is not changed is written byte for byte, what is changed keeps its surroundings."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from vendor_config import VENDOR

from steptwin.errors import Misuse
from steptwin.mic488.config import (
    ControllerConfig,
    examine_config,
    read_config,
)
from steptwin.mic488.inifile import IniFile


def parse(text: str) -> IniFile:
    return IniFile.parse(text.encode(), "m.cfg")


ENDS = st.sampled_from(["\n", "\r\n", "\r", ""])


NAMES = st.sampled_from(["Axis0", "axis0", "AXIS1", "IN0", "AIN0", "WBC_PROGRAM", "Vision", "", " x "])


KEYS = st.sampled_from(["Gear", "gear", "Acc", "InKL", "ID", "Foo", "", "a b"])


VALUES = st.sampled_from(["1", "0,5", "", " 7 ", "x;y", "5 ; note", "100 # note", "ąę", "=", "[x]", "\x85", "\xa0"])


LINES = st.one_of(
    NAMES.map("[{}]".format),
    NAMES.map("[{}".format),
    st.tuples(KEYS, st.sampled_from(["=", " = ", "=\t", ""]), VALUES).map("".join),
    st.sampled_from([";", "; comment", "# c", "// c", "", "   ", "noise", "\x0b", "\u2028"]),
)


TEXTS = st.lists(st.tuples(LINES, ENDS).map("".join)).map("".join)


FILES = st.one_of(st.binary(max_size=200), TEXTS.map(lambda t: t.encode()), TEXTS.map(lambda t: t.encode("cp1250", "replace")))


@given(FILES)
@example(VENDOR)
@example(b"\xef\xbb\xbf[Axis0]\r\nGear=2")
@example(bytes(range(256)))
@example(b"[Axis0]\rGear=2\r")
def test_an_unmodified_file_is_written_byte_for_byte(data: bytes) -> None:
    file = IniFile.parse(data)
    assert file.to_bytes() == data
    examine_config(file)


@given(FILES, NAMES, KEYS, st.sampled_from(["1", "0,5", "", "x y", "a;b", "ü"]))
@example(VENDOR, "Axis0", "Dec", "1")
@example(b"[Axis0]\nGear=1", "Axis0", "Acc", "5")
def test_setting_a_key_changes_that_value_only(data: bytes, section: str, key: str, value: str) -> None:
    file = IniFile.parse(data)
    try:
        changed = file.with_value(section, key, value)
    except Misuse:
        return
    assert changed.get(section, key) == value
    names = {(e.section.lower(), e.key.lower()) for e in (*file.entries, *changed.entries)} - {(section.lower(), key.lower())}
    assert all(changed.get(*name) == file.get(*name) for name in names)
    entry = file.find(section, key)
    old, new = file.source.text, changed.source.text
    if entry is not None:
        span = entry.value_span
        assert new == old[: span.start] + value + old[span.end :]
    else:
        extra = len(new) - len(old)
        assert any(new[:i] + new[i + extra :] == old for i in range(len(old) + 1))


def test_headers_know_their_place() -> None:
    text = "  [Axis0] ; first\n\n[ M 2 ]\n[open"
    file = parse(text)
    assert [text[header.span.start : header.span.end] for header in file.headers] == ["[Axis0]", "[ M 2 ]", "[open"]
    assert [finding.span for finding in file.findings if finding.code == "C002"] == [file.headers[2].span]


def test_setting_a_value_keeps_the_comment_behind_it() -> None:
    changed = IniFile.parse(VENDOR).with_value("axis0", "DEC", "3,5")
    assert changed.to_bytes() == VENDOR.replace(b"Dec = 200   ; ham", b"Dec = 3,5   ; ham")
    assert read_config(changed).axes[0].dec == 3.5


def test_a_new_key_joins_its_section_with_the_file_s_line_ends() -> None:
    changed = IniFile.parse(VENDOR).with_value("Axis1", "Acc", "7")
    assert changed.to_bytes() == VENDOR.replace(b"gear=12800\r\n", b"gear=12800\r\nAcc=7\r\n")


def test_a_new_section_goes_to_the_end() -> None:
    assert parse("[A]\nx=1").with_value("B", "y", "2").to_bytes() == b"[A]\nx=1\n[B]\ny=2\n"
    assert parse("").with_value("B", "y", "2").to_bytes() == b"[B]\r\ny=2\r\n"
    assert parse(";").with_value("B", "y", "2").to_bytes() == b";\r\n[B]\r\ny=2\r\n"
    assert IniFile.parse(b"\xef\xbb\xbf").with_value("B", "y", "2").to_bytes() == b"\xef\xbb\xbf[B]\r\ny=2\r\n"
    assert parse("[B]\n\n[C]\n").with_value("b", "y", "2").to_bytes() == b"[B]\ny=2\n\n[C]\n"


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("Axis0", "Gear", "1\n2"),
        ("Axis0", "Gear", " 1"),
        ("Axis0", "Gear", "1 ; x"),
        ("Axis0", "a=b", "1"),
        ("Axis0", ";a", "1"),
        ("Axis0", "[a]", "1"),
        ("Axis0", "", "1"),
        ("A]B", "a", "1"),
        ("New\n[Axis0]", "a", "1"),
    ],
)
def test_what_would_not_read_back_is_refused(section: str, key: str, value: str) -> None:
    with pytest.raises(Misuse, match="it would not read back"):
        parse("[Axis0]\nGear=5\n").with_value(section, key, value)


def test_characters_the_file_cannot_hold_are_refused() -> None:
    with pytest.raises(Misuse, match="has characters that"):
        IniFile.parse(VENDOR, "m.cfg").with_value("Vision", "Camera", "\N{SNOWMAN}")


def test_a_long_line_is_read_in_no_time() -> None:
    text = "[Axis0]\nGear=1" + " " * 200_000 + "x\n" + "a" * 200_000 + "\n" + "k " * 100_000 + "=1"
    assert read_config(parse(text.replace("Gear=1", "Note=1"))) == ControllerConfig()
