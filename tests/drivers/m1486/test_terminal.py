"""What a person types to M1486 chips, and what comes back in words."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from steptwin.drivers import LineLost
from steptwin.drivers.m1486.terminal import ChipTerminal, TerminalDecoder, command_of
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.variants import variant

LOST = "no room in the input buffer: a character is lost"
EMPTY = "7FH  the input buffer is empty"


def inverted(text: str) -> bytes:
    return bytes(~byte & 0xFF for byte in text.encode())


@pytest.mark.parametrize(
    ("typed", "heard", "told"),
    [
        (["u1"], b"\x80", ["80H  U1 position, low byte: 128"]),
        (["u1", "u2"], b"u1\ru2\r\x80\x01", ["80H  U1 position, low byte: 128", "01H  U2 position, middle byte: 1"]),
        (["u1", "u2"], b"u1\r\x80u2\r\x01", ["80H  U1 position, low byte: 128", "01H  U2 position, middle byte: 1"]),
        (["U20"], b"U20\rB", ["42H  U20 type letter in ASCII: M1486B"]),
        (["u20"], b"u", ["75H  U20 type letter in ASCII: 117"]),
        (["u14"], b"\x89", ["89H  U14 flags 80 to 87: ON 80 83 87"]),
        (["u18"], b"\xff", ["FFH  U18 functions 48 to 55: ON 48 49 50 51 52 53 54 55"]),
        (["u15"], b"\x02", ["02H  U15 driver interface: Step & Direction"]),
        (["u15"], b"\x7f\x02", [EMPTY, "02H  U15 driver interface: Step & Direction"]),
        (["u1"], b"\x7f", [f"7FH  U1 position, low byte: 127 (or: {EMPTY[5:]})"]),
        (["v200"], b"v200\r\x7f", [EMPTY]),
        (["v200"], b"", []),
        (["r"], b"^^", [f"5EH  {LOST}"] * 2),
        ([], b"^", [f"5EH  {LOST}"]),
        (
            ["f64"],
            inverted("4\r"),
            [
                "CBH  '4' inverted: it took one of the last three places of the input buffer",
                "F2H  CR inverted: it took one of the last three places of the input buffer",
            ],
        ),
        (
            ["f64"],
            b"f64" + inverted("4") + b"^",
            ["CBH  '4' inverted: it took one of the last three places of the input buffer", f"5EH  {LOST}"],
        ),
        (["u1"], inverted("1"), ["CEH  U1 position, low byte: 206"]),
        ([], b"Az\xff\n", ["41H  65, 'A'", "7AH  122, 'z'", "FFH  255", "0AH  10"]),
    ],
)
def test_what_comes_back_in_words(typed: list[str], heard: bytes, told: list[str]) -> None:
    words = TerminalDecoder()
    for line in typed:
        words.typed(line)
    assert words.decode(heard) == told
    assert words.refused == sum(LOST in text and "or:" not in text for text in told)


def test_an_answer_that_takes_its_time_is_still_known() -> None:
    words = TerminalDecoder()
    words.typed("u3")
    assert words.decode(b"u3\r") == []
    assert words.is_awaiting
    assert words.decode(b"\x05") == ["05H  U3 position, high byte: 5"]
    assert not words.is_awaiting


def test_what_is_looked_at_before_it_is_typed() -> None:
    assert str(command_of("f 12800 ; forward", None)) == "F12800"
    assert command_of("; a comment", None) is None
    assert str(command_of("@80", None)) == "@80"
    for text, kind, why in (("@80", "A", "out of range"), ("v20001", None, "out of range"), ("hello", None, "not a command")):
        with pytest.raises(Misuse, match=why):
            command_of(text, None if kind is None else variant(kind))


class Wire:
    """The other end in memory: answers by line, and what was written."""

    def __init__(self, **answers: bytes) -> None:
        self._answers = answers
        self._ready = threading.Event()
        self._bytes = b""
        self.written: list[bytes] = []
        self.is_lost = self.is_closed = False

    def write(self, data: bytes) -> None:
        self.written.append(data)
        self._bytes += self._answers.get(data.decode().strip(), b"")
        self._ready.set()

    def read(self, timeout_s: float) -> bytes:
        if self.is_lost:
            raise LineLost("the cable is out")
        self._ready.wait(timeout_s)
        self._ready.clear()
        data, self._bytes = self._bytes, b""
        return data

    def close(self) -> None:
        self.is_closed = True


def test_a_conversation() -> None:
    wire = Wire(u1=b"\x05", r=b"^^")
    told: list[str] = []
    terminal = ChipTerminal(wire, 4800, None, told.append)
    terminal.type("x7")
    assert terminal.settle(60.0) == 0
    terminal.type("u1")
    assert terminal.settle(60.0) == 0
    assert told == ["05H  U1 position, low byte: 5"]
    terminal.type("r")
    assert terminal.settle(60.0) == 2
    assert terminal._thread.daemon, "a program that ends without closing it does not hang"
    assert terminal.selected == "7"
    terminal.type("xg")
    assert terminal.selected == ""
    terminal.close()
    assert wire.is_closed
    assert wire.written[:3] == [b"x7\r", b"u1\r", b"r\r"]


def test_a_query_that_found_no_room_is_not_waited_for() -> None:
    terminal = ChipTerminal(Wire(u1=b"^^^"), 4800, None, str)
    terminal.type("u1")
    assert terminal.settle(60.0) == 3
    terminal.close()


def test_no_upload_is_waited_for_where_a_later_line_found_no_room() -> None:
    """The chip moves: it neither uploads nor takes more."""
    scene = Scene((0, "u1"), (10, b"u1\r"), (300, "r"), (310, b"^^"), (600, lambda scene: None))
    assert scene.terminal.settle(0.0) == 2
    with pytest.raises(LineFailure, match="no answer to U within 0 s"):
        Scene((0, "u1"), (10, b"u1\r"), (600, lambda scene: None)).terminal.settle(0.0)


def test_what_found_no_room_is_not_counted_against_later_lines() -> None:
    """A query that was refused is not answered either."""
    wire = Wire(u1=b"^^^", u2=b"\x05")
    told: list[str] = []
    terminal = ChipTerminal(wire, 4800, None, told.append)
    terminal.type("u1")
    assert terminal.settle(60.0) == 3
    terminal.type("u2")
    assert terminal.settle(60.0) == 0
    terminal.close()
    assert told[3:] == ["05H  U2 position, middle byte: 5"]


def test_what_is_no_byte_is_refused_and_the_rest_goes_on() -> None:
    wire = Wire(u1=b"\x05")
    terminal = ChipTerminal(wire, 4800, None, str)
    with pytest.raises(Misuse, match=r"^'v€': '€' is not a single-byte character$"):
        terminal.type("v€")
    terminal.type("u1")
    assert terminal.settle(60.0) == 0
    terminal.close()
    assert wire.written == [b"u1\r"]


def test_kill_waits_for_no_eeprom() -> None:
    """Half a second for each command of an E type (chapter II); K and X take no part in that."""
    wire = Wire()
    terminal = ChipTerminal(wire, 4800, variant("E1"), str)
    for line in ("v200", "a5000", "s200", "k", "x1", "p300"):
        terminal.type(line)
    terminal.settle(60.0)
    terminal.close()
    assert wire.written[0] in (b"v200\r", b"k\r")
    assert {wire.written[0], wire.written[1]} == {b"v200\r", b"k\r"}
    assert wire.written[2:] == [b"a5000\r", b"s200\r", b"x1\r", b"p300\r"]


def test_no_answer_and_a_lost_line_are_told() -> None:
    wire = Wire()
    terminal = ChipTerminal(wire, 4800, None, str)
    terminal.type("u1")
    with pytest.raises(LineFailure, match="no answer to U within"):
        terminal.settle(0.01)
    wire.is_lost = True
    with pytest.raises(LineLost, match="the cable is out"):
        terminal.settle(60.0)
    with pytest.raises(LineLost):
        terminal.type("v200")
    terminal.close()


def test_what_waits_for_an_eeprom_is_not_typed_after_a_suspension() -> None:
    """R was typed, and half a second later, before its turn came, the program was suspended for an hour."""
    wire = Wire()
    away = [0.0]
    terminal = ChipTerminal(wire, 4800, variant("E1"), str, clock=lambda: time.monotonic() + away[0])
    for line in ("f640", "r", "x7"):
        terminal.type(line)
    away[0] = 3600.0
    with pytest.raises(LineFailure, match=r"\br: not sent: the program was suspended for 3600 s"):
        terminal.settle(7200.0)
    terminal.type("k")
    terminal.settle(7200.0)
    terminal.close()
    assert b"r\r" not in wire.written
    assert wire.written[-1] == b"k\r"


class Scene:
    """A terminal in virtual time: lines typed (text) and bytes that come at given milliseconds, what is written and shown when.

    Everything happens in the thread of the terminal, between two of its steps.
    """

    def __init__(self, *happens: tuple[float, str | bytes | Callable[[Scene], object]], kind: str | None = None) -> None:
        self.now_s = 0.0
        self.written: list[tuple[float, bytes]] = []
        self.shown: list[tuple[float, str]] = []
        self._happens = list(happens)
        self._is_made = threading.Event()
        self.terminal = ChipTerminal(
            self,
            4800,
            None if kind is None else variant(kind),
            lambda text: self.shown.append((self._ms(), text)),
            clock=lambda: self.now_s,
        )
        self._is_made.set()
        self.terminal._thread.join()

    def _ms(self) -> float:
        return round(1000 * self.now_s, 1)

    def write(self, data: bytes) -> None:
        self.written.append((self._ms(), data))

    def read(self, timeout_s: float) -> bytes:
        self._is_made.wait()
        end = self.now_s + timeout_s
        if not self._happens or self._happens[0][0] > 1000 * end:
            self.now_s = end
            self.terminal._ends = not self._happens and end > 1.0 + max([0.0, *(at for at, _ in self.written)]) / 1000
            return b""
        at, what = self._happens.pop(0)
        self.now_s = max(at / 1000, self.now_s)
        if isinstance(what, bytes):
            return what
        self.terminal.type(what) if isinstance(what, str) else what(self)
        return b""

    def close(self) -> None:
        pass


def test_bytes_between_two_silences_are_decoded_together() -> None:
    """Three characters take 6.25 ms at 4800 bit/s, and adapters delay them; the terminal looks every 20 ms."""
    scene = Scene((0, "u1"), (30, b"u1\r"), (130, b"\x05"), (300, b"\x07"), (500, b"\x08"))
    assert scene.written == [(0.0, b"u1\r")]
    assert scene.shown == [(250.0, "05H  U1 position, low byte: 5"), (420.0, "07H  7"), (620.0, "08H  8")]
    assert Scene((0, b"A")).shown == [(120.0, "41H  65, 'A'")]


def test_the_echo_of_a_long_line_is_awaited_as_long_as_it_takes() -> None:
    """40 characters take 83.3 ms: that, 100 ms and three characters more."""
    settled: list[int] = []
    scene = Scene((0, "; " + "x" * 37), (0, lambda scene: settled.append(scene.terminal._unsettled)))
    assert settled == [1]
    assert scene.terminal.settle(0.0) == 0
    assert scene.shown == []
    late = Scene((0, "; " + "x" * 37), (180, b"\x05"))
    assert late.shown == [(300.0, "05H  5")]


def test_commands_of_an_e_type_wait_until_the_one_before_is_written() -> None:
    """Half a second (chapter II); K and X write nothing, so nothing waits for them."""
    scene = Scene((0, "v200"), (0, "a5000"), (100, " k"), (120, "s200"), (1200, "x1"), (1210, "p300"), kind="E1")
    assert scene.written == [
        (0.0, b"v200\r"),
        (100.0, b" k\r"),
        (500.0, b"a5000\r"),
        (1000.0, b"s200\r"),
        (1200.0, b"x1\r"),
        (1510.0, b"p300\r"),
    ]


def test_k_does_not_overtake_the_selection_of_its_chip() -> None:
    scene = Scene((0, "v200"), (0, "a5000"), (0, "x1"), (0, "k"), (700, "v300"), (700, "k"), kind="E2")
    assert scene.written == [
        (0.0, b"v200\r"),
        (500.0, b"a5000\r"),
        (520.0, b"x1\r"),
        (540.0, b"k\r"),
        (700.0, b"k\r"),
        (1000.0, b"v300\r"),
    ]


def test_k_drops_what_may_move_and_waits_for_an_eeprom() -> None:
    """It was typed before; K would be followed by the motion that it shall stop."""
    scene = Scene((0, "v200"), (0, "f640"), (0, "R"), (0, "c75"), (0, "c70"), (0, " k"), (20, "r"), kind="E1")
    assert scene.written == [(0.0, b"v200\r"), (0.0, b" k\r"), (500.0, b"f640\r"), (1000.0, b"c70\r"), (1500.0, b"r\r")]
    told = [text for _, text in scene.shown]
    assert told == ["R: not sent, because K was typed behind it", "c75: not sent, because K was typed behind it"]
    assert scene.terminal.settle(0.0) == 0


def test_wrong_data_before_k_drop_the_motion_that_is_being_written() -> None:
    """K acts at once, R when it is in the EEPROM (chapter II), half a second later: with % behind it not at all, unless function
    44 is ON. So K is sent again a tenth of a second after that. Nothing is sent meanwhile."""
    scene = Scene((0, "R"), (100, "k"), (120, "x1"), (130, "v200"), (150, "k"), kind="E1")
    assert [data for _, data in scene.written] == [b"R\r", b"%\rk\r", b"K\r", b"x1\r", b"k\r", b"v200\r"]
    assert [at for at, _ in scene.written][:2] == [0.0, 100.0]
    assert 600.0 <= scene.written[2][0] < 620.0
    assert [text for _, text in scene.shown] == [
        "% is sent before it, which drops R, and K again: with function 44 ON it moves even so"
    ]
    assert scene.terminal.settle(0.0) == 0


@pytest.mark.parametrize("lines", [((0, "R"), (510, "k")), ((0, "v200"), (100, "k")), ((0, "R"), (10, "x2"), (100, "k"))])
def test_k_is_sent_once_where_no_motion_of_its_chip_is_being_written(lines: tuple[tuple[float, str], ...]) -> None:
    scene = Scene(*lines, kind="E1")
    assert [data for _, data in scene.written].count(b"k\r") == 1
    assert len(scene.written) == len(lines)
    assert scene.shown == []


def test_k_is_sent_even_if_lines_that_were_dropped_have_to_be_told() -> None:
    told: list[str] = []

    def suspend(scene: Scene) -> None:
        scene.now_s += 3.0

    def stop(scene: Scene) -> None:
        try:
            scene.terminal.type("k")
        except LineFailure as failure:
            told.append(str(failure))

    scene = Scene((0, "v200"), (0, "r"), (10, suspend), (3100, stop), kind="E1")
    assert [data for _, data in scene.written] == [b"v200\r", b"k\r"]
    assert told == ["r: not sent: the program was suspended for 3 s"]


def test_a_type_without_eeprom_waits_for_nothing() -> None:
    for kind in ("B", None):
        scene = Scene((0, "v200"), (0, "a5000"), (0, "r"), kind=kind)
        assert scene.written == [(0.0, b"v200\r"), (0.0, b"a5000\r"), (0.0, b"r\r")]


@pytest.mark.parametrize(("seconds", "is_late"), [(1.9, False), (2.1, True)])
def test_what_waits_is_dropped_after_a_suspension_of_more_than_two_seconds(seconds: float, *, is_late: bool) -> None:
    failures: list[str] = []

    def suspend(scene: Scene) -> None:
        scene.now_s += seconds

    def go_on(scene: Scene) -> None:
        try:
            scene.terminal.type("v300")
        except LineFailure as failure:
            failures.append(str(failure))

    scene = Scene((0, "v200"), (0, "a5000"), (0, "k"), (10, suspend), (3000, go_on), kind="E1")
    written = [data for _, data in scene.written]
    assert (b"a5000\r" in written) is not is_late
    assert written[:2] == [b"v200\r", b"k\r"]
    assert failures == (["a5000: not sent: the program was suspended for 2 s"] if is_late else [])
