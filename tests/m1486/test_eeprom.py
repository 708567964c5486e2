"""The stored file as bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.errors import Misuse
from steptwin.m1486.eeprom import image_of, pack, unpack
from steptwin.m1486.memory import StoredFile
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import variant

E1, E2 = variant("E1"), variant("E2")
codes = st.binary(max_size=E1.memory_bits // 8)
labels = st.dictionaries(st.integers(1, 80), st.integers(0, 250), max_size=80)


@given(codes, labels)
def test_what_was_packed_is_unpacked(code: bytes, labels: dict[int, int]) -> None:
    image = StoredFile(code, {label: min(place, len(code)) for label, place in labels.items()})
    assert unpack(pack(image), E1) == image


def test_a_label_beyond_byte_255() -> None:
    image = StoredFile(bytes(0x180), {1: 0x17F})
    assert unpack(pack(image), E2) == image


def test_the_file_that_was_stored_last_runs_at_power_up() -> None:
    bench = Bench("E1", address=1)
    for command, answer in (("u20", b"\x45"), ("u15", b"\x02")):
        bench.file(command)
        assert bench.run(1) == answer
        bench.chip.power_cycle(bench.now)
        assert bench.run(1) == answer


def test_nothing_is_no_file() -> None:
    assert unpack(b"", E1) is None


@given(st.binary(min_size=1, max_size=60))
def test_any_bytes_are_a_file_or_refused(data: bytes) -> None:
    try:
        image = unpack(data, E1)
    except Misuse:
        return
    assert image is not None
    assert pack(image)[:2] == data[:2]


def test_a_file_that_does_not_fit_the_variant_is_refused() -> None:
    with pytest.raises(Misuse, match="takes 2008 bits: M1486E1 has 2000"):
        unpack(pack(StoredFile(bytes(251), {})), E1)
    for size, kind in ((250, E1), (251, E2)):
        assert unpack(pack(StoredFile(bytes(size), {})), kind) is not None
    with pytest.raises(Misuse, match="labels that M1486C does not have: permitted are 1 to 15"):
        unpack(pack(StoredFile(b"R", {16: 0})), variant("C"))


def test_a_program_becomes_the_file_that_downloading_it_gives() -> None:
    for text in ("[\n@3\nR ; go\nj3\n]\n", "@3\nR\nj3"):
        assert unpack(image_of(parse(text).program, E1), E1) == StoredFile(b"RJ\x03", {3: 0})


@pytest.mark.parametrize("text", ["[\nR\n]\n[\nR\n]", "x3\nR", "R\nk", "\\\nR", "R\nc75"])
def test_a_program_that_is_more_than_one_file_is_refused(text: str) -> None:
    with pytest.raises(Misuse, match="cannot be stored"):
        image_of(parse(text).program, E1)


def test_a_program_that_is_out_of_range_is_refused() -> None:
    with pytest.raises(Misuse, match="V9 is out of range: permitted is 16 to 20 000"):
        image_of(parse("V9").program, E1)
    with pytest.raises(Misuse, match="@81 is out of range: permitted is 1 to 80"):
        image_of(parse("@81").program, E1)
    with pytest.raises(Misuse, match="takes 2008 bits: M1486E1 has 2000"):
        image_of(parse("R\n" * 251).program, E1)
