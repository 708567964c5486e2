"""The serial port by itself."""

from __future__ import annotations

import pytest

from steptwin.controller import SECOND
from steptwin.m1486.uart import MOST_WAITING, Uart


def test_characters_follow_each_other_without_pause() -> None:
    uart = Uart(300, is_timed=True)
    uart.receive(b"ab", 0)
    uart.receive(b"c", SECOND // 100)
    ends = [-(-n * 10 * SECOND // 300) for n in (1, 2, 3)]
    assert uart.arrival() == ends[0]
    assert uart.arrived(ends[0] - 1) is None
    assert [uart.arrived(ends[2]) for _ in range(4)] == [*b"abc", None]
    # A line that has been idle begins anew.
    uart.receive(b"d", SECOND)
    assert uart.arrival() == SECOND + ends[0]


def test_both_directions_are_independent() -> None:
    uart = Uart(4800, is_timed=True)
    uart.receive(b"abcdef", 0)
    assert not uart.send(0x42, 0)
    assert uart.departure() == uart.arrival() == -(-10 * SECOND // 4800)
    assert uart.leave(uart.departure() or 0)
    assert uart.take_sent() == [(2_083_334, 0x42)]
    assert uart.take_sent() == []


def test_without_line_timing_nothing_takes_time() -> None:
    uart = Uart(300, is_timed=False)
    uart.receive(b"a", 5)
    assert uart.arrived(5) == ord("a")
    assert uart.send(0x42, 5)
    assert uart.take_sent() == [(5, 0x42)]
    assert (uart.arrival(), uart.departure(), uart.character_ns) == (None, None, 0)


@pytest.mark.parametrize("is_timed", [False, True])
def test_a_line_holds_only_so_many_characters(is_timed: bool) -> None:
    uart = Uart(4800, is_timed=is_timed)
    uart.receive(bytes(MOST_WAITING), 0)
    uart.receive(b"abc", 0)
    assert uart.overrun == 3


def test_another_baud_rate_loses_what_is_on_its_way() -> None:
    uart = Uart(4800, is_timed=True)
    uart.receive(b"abc", 0)
    uart.send(0x42, 0)
    uart.set_baud(300)
    assert (uart.baud, uart.arrival(), uart.departure()) == (300, None, None)


def test_a_host_that_does_not_read_loses_the_oldest_characters() -> None:
    uart = Uart(4800, is_timed=False)
    for number in range(MOST_WAITING + 3):
        uart.send(number % 256, number)
    sent = uart.take_sent()
    assert (len(sent), sent[0]) == (MOST_WAITING, (3, 3))


def test_no_more_characters_wait_for_the_line_to_the_host_than_it_can_hold() -> None:
    uart = Uart(4800, is_timed=True)
    for _ in range(MOST_WAITING + 3):
        uart.send(0x42, 0)
    assert uart.overrun == 3
    assert uart.leave(MOST_WAITING * SECOND)
    assert len(uart.take_sent()) == MOST_WAITING
