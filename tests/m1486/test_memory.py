"""The command memory: a ring (M-12), files, labels, registers that share it."""

from __future__ import annotations

import pytest
from m1486_rig import Bench

from steptwin.m1486.commands import memory_bits
from steptwin.m1486.memory import CommandMemory, FileState, StoredFile
from steptwin.m1486.variants import VARIANTS, variant


class Silent:
    def bytes_changed(self, first: int, count: int) -> None: ...
    def labels_changed(self) -> None: ...


def memory_of(kind: str) -> CommandMemory:
    return CommandMemory(variant(kind), Silent())


@pytest.mark.parametrize("kind", [v.name for v in VARIANTS])
def test_the_memory_has_the_bits_of_its_variant(kind: str) -> None:
    memory = memory_of(kind)
    assert 8 * memory.size == variant(kind).memory_bits
    assert memory.has_room(memory.size, memory.end)
    assert not memory.has_room(memory.size + 1, memory.end)


def test_m_12_commands_stay_until_the_ring_overwrites_them() -> None:
    memory = memory_of("A")
    memory.label(7)
    memory.store(b"\x01" * 4)
    memory.enable()
    for _ in range(26):
        assert memory.fetch(memory.labels[7]) == b"\x01" * 4
        memory.store(b"\x02" * 4)
        memory.enable()
    assert memory.labels == {7: 0}
    memory.store(b"\x03")
    assert memory.labels == {}
    assert memory.fetch(memory.size - 2) == b"\x02\x02\x03\x01"


def test_a_full_ring_is_not_an_empty_one() -> None:
    memory = memory_of("A")
    memory.open_file()
    for _ in range(27):
        assert memory.fits_file(4)
        memory.store(bytes(4))
    assert not memory.fits_file(1)
    assert memory.age(memory.end) == memory.size
    image = memory.close_file()
    assert image is not None
    assert len(image.code) == memory.size
    assert memory.age(memory.end) == 0


def test_labels_of_a_file_are_there_when_the_file_is() -> None:
    memory = memory_of("B")
    memory.store(b"R")
    memory.enable()
    memory.open_file()
    memory.label(3)
    memory.store(b"R")
    assert memory.labels == {}
    assert memory.close_file() == StoredFile(b"R", {3: 0})
    assert memory.labels == {3: 1}


def test_a_refused_file_leaves_nothing_behind() -> None:
    memory = memory_of("B")
    memory.open_file()
    memory.label(3)
    memory.store(b"R")
    memory.refuse_file()
    assert memory.file is FileState.REFUSED
    assert memory.close_file() is None
    assert (memory.labels, memory.write, memory.file) == ({}, 0, FileState.CLOSED)


@pytest.mark.parametrize("kind", ["A", "C"])
def test_registers_1_to_8_are_the_last_128_bits_of_the_memory(kind: str) -> None:
    memory = memory_of(kind)
    first = variant(kind).memory_bits // 8 - 16
    for number in range(1, 9):
        memory.set_register(number, 0x1100 * number + number)
    for number in range(1, 9):
        assert memory.register(number) == 0x1100 * number + number
        assert memory.fetch(first + 2 * number - 2)[:2] == bytes((number, 0x11 * number))
    # Commands that come there are what the registers hold.
    memory.load(StoredFile(b"\xaa" * (first + 2), {}))
    assert memory.register(1) == 0xAAAA
    assert memory.register(2) == 0


@pytest.mark.parametrize("kind", ["B", "E1", "E2"])
def test_other_variants_have_registers_of_their_own(kind: str) -> None:
    memory = memory_of(kind)
    memory.set_register(8, 0x12345)
    memory.load(StoredFile(b"\xaa" * memory.size, {}))
    assert memory.register(8) == 0x2345
    memory.reset()
    assert memory.register(8) == 0


def test_a_register_written_over_commands_ends_a_program_on_a() -> None:
    # Chapter VII.7: files of more than 736 bits share their end with the registers.
    bench = Bench("A")
    filling = ["w1"] * 23
    bench.file(":65535", *filling, ">4", "u4", "u4")
    assert bench.finish() == b""
    assert "no command" in bench.wrong[0]
    bench = Bench("B")
    bench.file(":65535", *filling, ">4", "u4", "u4")
    assert bench.finish() == b"\xff\xff"


def test_files_of_736_bits_after_a_reset_use_registers_freely_on_a() -> None:
    assert 736 == 864 - 8 * 16
    bench = Bench("A")
    bench.do("u20", "u20")
    # 4 + 2 + 4 + 2 + 2 + 78 = 92 bytes
    assert memory_bits("D") == 8
    bench.send("\\", "[", ":12345", ">8", ":0", "<8", "u5", *["d"] * 78, "]")
    assert bench.finish() == bytes((12345 >> 8,))
    assert bench.chip.memory.write == 92
    assert bench.wrong == []


def test_a_program_in_the_ring_keeps_what_was_not_done_yet() -> None:
    bench = Bench("A")
    bench.send("w1000", *["u20"] * 55)
    assert bench.chip.receiver.waiting == 4
    assert bench.run(0.9) == b""
    assert bench.finish() == b"\x41" * 55


def test_a_program_goes_round_the_ring_as_often_as_it_likes() -> None:
    bench = Bench("A")
    for number in range(100):
        assert bench.do(f":{number}", "u4") == bytes((number,))
    assert bench.chip.memory.write == 600 % 216


def test_m_12_a_jump_reaches_back_over_what_is_still_in_the_ring() -> None:
    bench = Bench("A")
    bench.do("c80", "@1", "u20", "i80h2", "t80")
    bench.do(*["d"] * 80)
    assert bench.do("j1") == b"\x41"
    assert "no label 2" in bench.wrong[0]
    bench = Bench("A")
    bench.do("@1", "u20", *["d"] * 107)
    assert bench.send("j1") == b""
    assert "no label 1" in bench.wrong[0]


def test_m_12_a_loop_whose_beginning_is_overwritten_ends_as_wrong_data() -> None:
    bench = Bench("A")
    bench.do("l2", "u20", *["d"] * 106)
    assert bench.do("e") == b""
    assert "overwritten" in bench.wrong[0]
    bench = Bench("A")
    bench.do("l2", "u20", *["d"] * 104)
    assert bench.do("e") == b"\x41"
    assert bench.wrong == []


@pytest.mark.parametrize(("commands", "answer"), [(101, b"\x41"), (102, b"")])
def test_m_12_a_return_that_is_overwritten_is_wrong_data(commands: int, answer: bytes) -> None:
    # The subroutine stands behind its call: the call goes lost before the place where the program waits does.
    bench = Bench("A")
    bench.file("'1", "u20", "j2", "@1", "z3", ".", "@2")
    bench.run(ms=10)
    assert bench.send(*["d"] * commands) == b""
    bench.pin(B3=0)
    assert bench.finish().startswith(answer)
    assert any("after the call has been overwritten" in text for text in bench.wrong) is not bool(answer)


def test_m_12_a_condition_forgets_a_label_that_is_overwritten_after_it_was_looked_at() -> None:
    """A has 108 bytes: U takes 2, I 4, T and J 2. Label 1 is lost with byte 109; the condition behind it is still there."""
    for commands, is_there in ((98, True), (99, False)):
        bench = Bench("A")
        bench.do("@1", "u20", "@2", "i80h1", *["d"] * commands, "t80")
        sent = bench.send("j2") + bench.run(ms=10)
        assert sent.startswith(b"\x41") is is_there
        assert any("no label 1" in text for text in bench.wrong) is not is_there


def test_a_file_is_held_as_long_as_its_commands_and_labels_are() -> None:
    memory = memory_of("A")
    memory.store(b"\x05" * 100)
    memory.enable()
    memory.open_file()
    memory.label(3)
    memory.store(b"\x01\x02")
    memory.label(4)
    memory.store(b"\x03" * 8)
    begin = memory.end
    file = StoredFile(b"\x01\x02" + b"\x03" * 8, {3: 0, 4: 2})
    assert memory.close_file() == file
    assert memory.holds(begin, file)
    assert memory.holds(begin, StoredFile(b"\x01\x02", {3: 0}))
    for other in (
        StoredFile(b"\x01\x04", {3: 0}),
        StoredFile(b"\x01\x02", {3: 1}),
        StoredFile(b"\x01\x02", {5: 0}),
        StoredFile(b"\x01\x02" + b"\x03" * 9, {}),  # longer than what is there
    ):
        assert not memory.holds(begin, other)
    for _ in range(98):
        memory.store(b"\x07")
        assert memory.holds(begin, file)
    memory.label(4)  # another command has the label now
    assert not memory.holds(begin, file)
    for byte in file.code:
        memory.store(bytes((byte,)))
    assert not memory.holds(begin, StoredFile(file.code, {}))  # a round later the same bytes are there
