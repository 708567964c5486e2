from __future__ import annotations

import pytest

from steptwin.m1486.structure import CommandFile, CommandStream, streams
from steptwin.m1486.syntax import parse


def only_stream(text: str) -> CommandStream:
    (stream,) = streams(parse(text).program)
    return stream


def test_a_single_chip_gets_everything() -> None:
    stream = only_stream("F64\nXG\nR")
    assert stream.address is None
    assert [str(c) for c in stream.commands] == ["F64", "R"]


def test_each_chip_gets_what_follows_its_address_and_what_is_for_all() -> None:
    chips = streams(parse("M1\nXA\nF64\nX3\nB64\nXG\nR").program)
    assert {c.address: [str(x) for x in c.commands] for c in chips} == {3: ["M1", "B64", "R"], 10: ["M1", "F64", "R"]}


def test_files_and_what_stands_in_them() -> None:
    stream = only_stream("F64\n[\nR\nW5\n]\nD\n[\nR")
    assert stream.files == [CommandFile(1, 4, 40), CommandFile(6, None, 8)]
    assert stream.in_file == [None, None, 0, 0, 0, None, None, 1]
    assert [stream.present(i) for i in range(8)] == [0, 1, 4, 4, 4, 5, 6, 7]


def test_loops_pair_by_nesting() -> None:
    stream = only_stream("L2\nL3\nR\nE\nE\nE\nL4")
    assert stream.loops == {3: 1, 4: 0}
    assert (stream.lone_ends, stream.open_loops) == ([5], [6])
    assert stream.loops_around(2) == [1, 0]
    assert stream.depth == {0: 1, 1: 2, 6: 1}


def test_the_latest_label_that_has_arrived_counts() -> None:
    stream = only_stream("@1\nJ1\n@1\nJ1\n[\nJ2\n@2\n]\n@2\n\\\nJ1")
    assert stream.resolve(1, 1) == 0
    assert stream.resolve(3, 1) == 2
    assert stream.resolve(5, 2) == 6
    assert stream.resolve(10, 1) is None
    assert stream.visible_labels(5) == {1: 2, 2: 6}


def test_a_reset_ends_open_loops() -> None:
    stream = only_stream("L2\n\\\nE")
    assert (stream.open_loops, stream.lone_ends, stream.loops) == ([0], [2], {})


@pytest.mark.parametrize("leaves", ["J", "'", "J2", "'2"])
def test_loops_are_not_nested_where_a_jump_leaves_one_or_may_do_so(leaves: str) -> None:
    assert only_stream("[\n@1\nL2\n@3\nR\nE\n@2\nJ1\n]").are_loops_nested
    assert not only_stream(f"[\nL2\nR\n{leaves}\nE\n@2\nR\n]").are_loops_nested


def test_bits_between_a_label_and_what_the_chip_has() -> None:
    stream = only_stream("@1\nR\nJ1\n[\nF1\nJ1\nR\n]")
    assert stream.bits_since(0, 2) == 24
    assert stream.bits_since(2, 2) == 16
    assert stream.bits_since(0, 5) == 24 + 32 + 16 + 8
