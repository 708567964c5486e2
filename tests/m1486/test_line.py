"""Chips on one line: selection, the shared wire, baud rates, programs that listen (manual chapters II and VII.5)."""

from __future__ import annotations

import itertools

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.line import SerialChain
from steptwin.m1486.uart import MOST_WAITING
from steptwin.m1486.variants import variant


def chain(*addresses: int, kind: str = "B", baud: int = 4800, is_timed: bool = False) -> SerialChain:
    return SerialChain(M1486Chip(variant(kind), address=address, baud=baud, is_timed=is_timed) for address in addresses)


def talk(line: SerialChain, *commands: str, now: int = 0) -> bytes:
    """What comes back within a second."""
    port = line.port()
    line.receive("".join(f"{command}\r" for command in commands).encode(), now)
    answer = b"".join(data for _, data in port.to_send(now + SECOND))
    port.close()
    return answer


def test_after_power_up_all_listen_and_index_chooses_one() -> None:
    # The manual's example of X: five chips, 0 to 4.
    line = chain(*range(5))
    talk(line, "f64", "r")
    assert [chip.drive.true_u(SECOND) for chip in line.chips.values()] == [64] * 5
    talk(line, "X3", "r", now=SECOND)
    assert [chip.drive.true_u(2 * SECOND) for chip in line.chips.values()] == [64, 64, 64, 128, 64]
    talk(line, "xg", "r", now=2 * SECOND)
    assert [chip.drive.true_u(3 * SECOND) for chip in line.chips.values()] == [128, 128, 128, 192, 128]


def test_sixteen_chips() -> None:
    line = chain(*range(16))
    talk(line, *(command for n in range(16) for command in (f"x{n:X}", f":{n}")))
    for n in range(16):
        assert talk(line, f"x{n:x}", "u4", now=(n + 1) * SECOND) == bytes((n,))


def test_only_the_chosen_chip_sends_characters_back() -> None:
    line = chain(2, 9)
    talk(line, "t41")
    # Both hear x9; the one that is given up still sends it back.
    assert talk(line, "x9", now=SECOND) == b"x9\r"
    assert talk(line, "u20", now=2 * SECOND) == b"u20\r\x42"


def test_m_33_characters_begun_together_come_as_their_and() -> None:
    line = chain(1, 2)
    talk(line, "x1", ":5", "x2", ":6", "xg")
    assert talk(line, "u4", now=SECOND) == bytes((5 & 6,))
    assert line.collisions == 0
    # Several at one moment, where characters take no time: the first with the first.
    talk(line, "x1", "t41", "x2", "t41", "xg", now=2 * SECOND)
    assert talk(line, "w1", now=3 * SECOND) == b"w1\r"
    assert line.collisions == 0


def test_m_33_a_character_begun_while_another_is_on_the_wire_is_lost() -> None:
    line = chain(1, 2, baud=300, is_timed=True)
    port = line.port()
    line.receive(b"x2\rw250\rxg\ru20\r", 0)
    answers = port.to_send(2 * SECOND)
    assert [data for _, data in answers] == [b"\x42"]
    assert line.collisions == 1


@pytest.mark.parametrize("baud", [300, 1200, 2400, 4800])
def test_a_run_of_characters_does_not_collide_with_itself(baud: int) -> None:
    line = chain(1, baud=baud, is_timed=True)
    port = line.port()
    line.receive(b"[\r" + b"u20\r" * 40 + b"]\r", 0)
    answers = port.to_send(20 * SECOND)
    assert [data for _, data in answers] == [b"\x42"] * 40
    assert line.collisions == 0
    assert all(b - a >= 10 * SECOND // baud for (a, _), (b, _) in itertools.pairwise(answers))


def test_every_port_hears_the_chips() -> None:
    line = chain(1)
    one, other = line.port(), line.port()
    told: list[str] = []
    other.on_output = lambda: told.append("other")
    assert one.exchange(b"u20\ru15\r", 0) == b"\x42"
    assert told == ["other"]
    assert one.to_send(MILLISECOND) == [(MILLISECOND, b"\x02")]
    assert other.to_send(MILLISECOND) == [(0, b"\x42"), (MILLISECOND, b"\x02")]
    other.close()
    line.receive(b"u20\r", SECOND)
    assert one.to_send(SECOND) == [(SECOND, b"\x42")]
    assert other.pending == []
    other.close()


def test_what_was_sent_before_a_program_came_is_not_for_it() -> None:
    line = chain(1)
    line.receive(b"u20\r", 0)
    assert not line.chips[1].uart.sent
    one = line.port()
    line.receive(b"u16\r", SECOND)
    other = line.port()
    line.receive(b"u15\r", 2 * SECOND)
    assert one.to_send(3 * SECOND) == [(SECOND, b"\x01"), (2 * SECOND, b"\x02")]
    assert other.to_send(3 * SECOND) == [(2 * SECOND, b"\x02")]


def test_a_port_that_nobody_fetches_from_holds_the_last_characters() -> None:
    line = chain(1)
    talking, silent = line.port(), line.port()
    talking.exchange(b"t41\r", 0)
    for now in range(1, 3 + MOST_WAITING // 1000):
        talking.exchange(b"\n" * 1000, now)
    talking.exchange(b"u15\r", SECOND)
    assert len(silent.pending) == MOST_WAITING
    assert silent.pending[-1][1] == b"\x02"


def test_a_program_is_told_when_a_character_has_left() -> None:
    line = chain(1, is_timed=True)
    port = line.port()
    told: list[int] = []
    chip = line.chips[1]
    port.on_output = lambda: told.append(chip.now)
    line.receive(b"u20\r", 0)
    chip.advance(SECOND)
    assert told == [-(-40 * SECOND // 4800) + -(-10 * SECOND // 4800)]


def test_a_port_says_when_the_next_character_will_have_left() -> None:
    line = chain(1, is_timed=True)
    port = line.port()
    assert port.deadline() is None
    line.receive(b"u20\r", 0)
    arrived = -(-40 * SECOND // 4800)
    assert port.to_send(arrived) == []
    assert port.deadline() == arrived + -(-10 * SECOND // 4800)


def test_a_line_keeps_what_is_on_the_wire_in_its_state() -> None:
    line, other = (chain(1, 2, baud=300, is_timed=True) for _ in range(2))
    port = line.port()
    line.receive(b"x2\rw250\rxg\ru20\r", 0)
    port.to_send(SECOND // 2)
    other.set_state(line.copy_state())
    for chip, twin in zip(other.chips.values(), line.chips.values(), strict=True):
        chip.restore(twin.snapshot())
    assert other.port().to_send(2 * SECOND) == port.to_send(2 * SECOND)
    assert other.copy_state() == line.copy_state()


def test_what_cannot_be_on_one_line() -> None:
    with pytest.raises(Misuse, match="two chips with address A on one line"):
        chain(10, 10)
    with pytest.raises(Misuse, match="at least one chip"):
        chain()
    with pytest.raises(Misuse, match="different baud rates on one line: 300, 4800 bit/s"):
        SerialChain([M1486Chip(address=1, baud=300), M1486Chip(address=2, baud=4800)])
    with pytest.raises(Misuse, match="with and without line timing"):
        SerialChain([M1486Chip(address=1), M1486Chip(address=2, is_timed=True)])
