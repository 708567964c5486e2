"""Telnet and the COM port option as RFC 854 and RFC 2217 write them. The bytes are those of the RFCs."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import sends_by_itself
from steptwin.live.rfc2217 import MOST_HELD, Rfc2217Port, Telnet, TwinLine, escaped, over_network

WILL_COM_PORT, DO_COM_PORT = bytes((255, 251, 44)), bytes((255, 253, 44))


def sub(command: int, *value: int) -> bytes:
    return bytes((255, 250, 44, command)) + escaped(bytes(value)) + bytes((255, 240))


class Echo:
    """A port that repeats what it hears."""

    broken: str | None = None

    def exchange(self, data: bytes, now: int) -> bytes:
        return data

    def to_send(self, now: int) -> list[tuple[int, bytes]]:
        return [(now, b"\xff")]

    def deadline(self) -> int | None:
        return 7

    def close(self) -> None:
        self.broken = "closed"


class Talker(Echo):
    on_output: Callable[[], None] | None = None


@given(st.binary(max_size=200), st.integers(1, 20))
def test_data_passes_however_it_is_cut(data: bytes, size: int) -> None:
    telnet = Telnet()
    sent = escaped(data)
    parts = [telnet.receive(sent[at : at + size]) for at in range(0, len(sent), size)]
    assert b"".join(plain for plain, _ in parts) == data
    assert not any(answer for _, answer in parts)


@given(st.binary(max_size=40))
def test_what_comes_back_is_escaped(data: bytes) -> None:
    port = Rfc2217Port(Echo(), TwinLine())
    assert port.exchange(escaped(data), 0) == escaped(data)
    assert port.to_send(3) == [(3, b"\xff\xff")]
    assert port.deadline() == 7


@given(st.lists(st.binary(max_size=30), max_size=5), st.integers(1, 7))
def test_commands_between_data_change_nothing_of_it(pieces: list[bytes], size: int) -> None:
    telnet = Telnet()
    sent = b"".join(escaped(piece) + sub(1, 0, 0, 255, 240) + bytes((255, 241)) for piece in pieces)
    plain = b"".join(telnet.receive(sent[at : at + size])[0] for at in range(0, len(sent), size))
    assert plain == b"".join(pieces)


def test_options_are_agreed_to_once() -> None:
    telnet = Telnet()
    modem_state = sub(107, 0xB0)
    assert telnet.receive(WILL_COM_PORT) == (b"", DO_COM_PORT + modem_state)
    assert telnet.receive(WILL_COM_PORT) == (b"", b"")
    assert telnet.receive(DO_COM_PORT) == (b"", WILL_COM_PORT)
    assert telnet.receive(bytes((255, 253, 0, 255, 251, 0, 255, 251, 3))) == (b"", bytes((255, 251, 0, 255, 253, 0, 255, 253, 3)))
    assert telnet.receive(bytes((255, 253, 1, 255, 251, 24))) == (b"", bytes((255, 252, 1, 255, 254, 24)))  # ECHO, TTYPE
    assert telnet.receive(bytes((255, 254, 0, 255, 254, 0, 255, 252, 5))) == (b"", bytes((255, 252, 0)))


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        (sub(0), sub(100, *b"steptwin")),
        (sub(0, *b"somebody"), b""),
        (sub(1, 0, 0, 0x96, 0), sub(101, 0, 0, 0x96, 0)),
        (sub(1, 0, 0, 0, 0), sub(101, 0, 0, 0x96, 0)),
        (sub(1, 0, 0, 255, 255), sub(101, 0, 0, 255, 255)),
        (sub(1, 9), b""),
        (sub(2, 7), sub(102, 7)),
        (sub(2, 0), sub(102, 8)),
        (sub(3, 3), sub(103, 3)),
        (sub(4, 2), sub(104, 2)),
        (sub(5, 0), sub(105, 1)),
        (sub(5, 3), sub(105, 3)),
        (sub(5, 9), sub(105, 9)),
        (sub(5, 7), sub(105, 8)),
        (sub(10, 0), sub(110, 0)),
        (sub(11, 255), sub(111, 255)),
        (sub(12, 3), sub(112, 3)),
        (sub(8), b""),
        (sub(77, 1), b""),
        (bytes((255, 250, 24, 1, 255, 240)), b""),
        (bytes((255, 250, 255, 240)), b""),
    ],
)
def test_settings_are_taken_and_told(asked: bytes, answer: bytes) -> None:
    assert Telnet().receive(asked) == (b"", answer)
    telnet = Telnet()
    assert b"".join(telnet.receive(bytes((byte,)))[1] for byte in asked) == answer


def test_what_was_set_is_remembered() -> None:
    telnet = Telnet()
    telnet.receive(sub(1, 0, 0, 0x25, 0x80) + sub(5, 9))
    assert telnet.baud == 9600
    assert telnet.receive(sub(1, 0, 0, 0, 0) + sub(5, 7)) == (b"", sub(101, 0, 0, 0x25, 0x80) + sub(105, 9))


def test_a_command_that_does_not_end_breaks_the_connection() -> None:
    port = Rfc2217Port(Echo(), TwinLine())
    port.exchange(bytes((255, 250)) + bytes(MOST_HELD), 0)
    assert port.broken == "a telnet command does not end"


def test_a_port_that_speaks_unasked_still_does() -> None:
    inner = Talker()
    port = over_network(inner, TwinLine())
    assert sends_by_itself(port)
    assert not sends_by_itself(over_network(Echo(), TwinLine()))
    told: list[int] = []
    port.on_output = lambda: told.append(1)
    assert inner.on_output is port.on_output
    port.close()
    assert port.broken == "closed"


# ---------------------------------------------------------------------- settings that do not fit the line

FITTING = (b"", sub(1, 0, 0, 0x12, 0xC0), sub(1, 0, 0, 0x12, 0xC0) + sub(4, 2), sub(1, 0, 0, 0x12, 0x40), sub(2, 8) + sub(3, 1))
WRONG = {
    sub(1, 0, 0, 0x25, 0x80): "9600 bit/s 8N1",
    sub(1, 0, 0, 0x12, 0x00): "4608 bit/s 8N1",
    sub(3, 3): "4800 bit/s 8E1",
    sub(2, 7) + sub(3, 2) + sub(4, 2): "4800 bit/s 7O2",
    sub(3, 4) + sub(4, 3): "4800 bit/s 8M1.5",
    sub(3, 77): "4800 bit/s 8?1",
}


class Set:
    """A network port at a line of 4800 bit/s, and its events."""

    def __init__(self, settings: bytes, *, is_timed: bool, baud: int = 4800) -> None:
        self.told: list[str] = []
        self.baud = baud
        self.port = over_network(Echo(), TwinLine(lambda: self.baud, is_timed, self.told.append))
        self.port.exchange(settings, 0)


@pytest.mark.parametrize("is_timed", [False, True])
@pytest.mark.parametrize("settings", FITTING)
def test_settings_that_fit_are_no_event(settings: bytes, is_timed: bool) -> None:
    """Those of the line by default, rates within 3 %, and more stop bits than one."""
    one = Set(settings, is_timed=is_timed)
    assert one.port.exchange(b"u20\r", 0) == b"u20\r"
    assert one.port.to_send(1) == [(1, b"\xff\xff")]
    assert one.told == []


@pytest.mark.parametrize(("settings", "words"), WRONG.items(), ids=WRONG.values())
def test_wrong_settings_are_mute_where_line_timing_is_real(settings: bytes, words: str) -> None:
    one = Set(settings, is_timed=True)
    assert one.told == []  # rate and parity are set one after the other
    assert one.port.exchange(b"u20\r", 0) == b""
    assert one.port.to_send(1) == []
    assert one.told == [f"network port: {words} is set by its client, the line has 4800 bit/s 8N1: no character gets through"]


@pytest.mark.parametrize(("settings", "words"), WRONG.items(), ids=WRONG.values())
def test_wrong_settings_are_an_event_where_line_timing_is_off(settings: bytes, words: str) -> None:
    one = Set(settings, is_timed=False)
    assert one.port.exchange(b"u20\r" + sub(1, 0, 0, 0, 0), 0).endswith(b"u20\r")
    assert one.port.to_send(1) == [(1, b"\xff\xff")]
    (told,) = one.told
    assert told.startswith(f"network port: {words} is set by its client, the line has 4800 bit/s 8N1: served all the same")


def test_settings_made_right_again_get_through() -> None:
    one = Set(sub(3, 3), is_timed=True)
    assert one.port.exchange(b"a", 0) == b""
    assert one.port.exchange(sub(3, 1) + b"b", 0).endswith(b"b")
    assert one.port.exchange(sub(3, 3) + b"c", 0).endswith(sub(103, 3))
    assert len(one.told) == 2


def test_a_line_that_changes_its_rate_leaves_its_clients_behind() -> None:
    """The M1486 reads its BR pins anew with RST."""
    one = Set(b"", is_timed=True)
    one.baud = 300
    assert one.port.exchange(b"a", 0) == b""
    assert one.told == [
        "network port: 4800 bit/s 8N1 is set by its client, the line has 300 bit/s 8N1: no character gets through"
    ]
