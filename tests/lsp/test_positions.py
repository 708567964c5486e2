"""Lines and columns in the three encodings; the expected columns come from encoding the text."""

from __future__ import annotations

from time import process_time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.lsp.positions import Encoding, LineIndex

texts = st.text(st.sampled_from("aB1 \tżЖ€😀\u2028\f\r\n\ud800"), max_size=40)


def column(before: str, encoding: Encoding) -> int:
    match encoding:
        case Encoding.UTF8:
            return len(before.encode("utf-8", "surrogatepass"))
        case Encoding.UTF16:
            return len(before.encode("utf-16-le", "surrogatepass")) // 2
        case Encoding.UTF32:
            return len(before)


@given(texts, st.sampled_from(Encoding))
def test_every_place_has_a_position_and_comes_back(text: str, encoding: Encoding) -> None:
    lines = LineIndex(text)
    for place in range(len(text) + 1):
        line, found = lines.position(place, encoding)
        before = text[lines.starts[line] : place]
        assert found == column(before, encoding)
        if place <= lines.end(line):
            assert lines.place(line, found, encoding) == place


@given(texts, st.integers(0, 10), st.integers(0, 50), st.sampled_from(Encoding))
def test_any_position_is_a_place_on_its_line(text: str, line: int, column: int, encoding: Encoding) -> None:
    lines = LineIndex(text)
    place = lines.place(line, column, encoding)
    if line < len(lines.starts):
        assert lines.starts[line] <= place <= lines.end(line)
    else:
        assert place == len(text)


@pytest.mark.parametrize(
    ("encoding", "column", "place"),
    [
        (Encoding.UTF16, 2, 1),  # inside the pair of the emoji: its beginning
        (Encoding.UTF16, 3, 2),
        (Encoding.UTF8, 3, 1),
        (Encoding.UTF8, 5, 2),
        (Encoding.UTF32, 2, 2),
        (Encoding.UTF16, 99, 3),  # beyond the line: its end, before the line end
    ],
)
def test_columns_of_an_emoji(encoding: Encoding, column: int, place: int) -> None:
    assert LineIndex("a😀b\r\nc").place(0, column, encoding) == place


def test_lines_end_as_the_protocol_says() -> None:
    lines = LineIndex("a\r\nb\rc\nd\u2028e\x0cf\n")
    assert [lines.line(number) for number in range(len(lines.starts))] == ["a", "b", "c", "d\u2028e\x0cf", ""]


@given(texts, st.integers(0, 30), st.integers(0, 10), st.text(alphabet="ab\r\n😀", max_size=6))
@example("a\r\nb", 2, 0, "x").via("between the halves of a line end")
@example("a\rb", 2, 0, "\n").via("its other half")
@example("a\r\n\nb", 1, 1, "").via("one half is left")
def test_a_changed_text_is_that_text(text: str, start: int, length: int, typed: str) -> None:
    start = min(start, len(text))
    end = min(start + length, len(text))
    changed = LineIndex(text).changed(start, end, typed)
    whole = LineIndex(text[:start] + typed + text[end:])
    assert (changed.text, changed.contents, changed.starts) == (whole.text, whole.contents, whole.starts)
    places = range(len(whole.text) + 1)
    assert [changed.position(place, Encoding.UTF16) for place in places] == [
        whole.position(place, Encoding.UTF16) for place in places
    ]


def test_a_long_line_with_letters_beyond_ascii_takes_no_time_for_each_character() -> None:
    lines = LineIndex("ą " * 200_000)
    begin = process_time()
    for place in range(399_000, 399_100):
        line, column = lines.position(place, Encoding.UTF16)
        assert lines.place(line, column, Encoding.UTF16) == place
    assert process_time() - begin < 4.0, "6 s, character by character"
