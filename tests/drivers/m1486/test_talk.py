"""What is said on a line of chips, character by character: transcripts of the exchanges, without any chip."""

from __future__ import annotations

from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.drivers.exchange import SendNext
from steptwin.drivers.m1486.failures import Garbled, NoRoom
from steptwin.drivers.m1486.talk import NOISE_NS, QUIET_NS, TYPE_QUERY, CharacterTalk, ChipRequest, ChipRequestKind, chip_name
from steptwin.errors import Misuse
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameDirection

CHARACTER_NS = 10 * SECOND // 4800
"""Ten bits."""


def inverted(byte: int) -> bytes:
    return bytes((~byte & 0xFF,))


class Line:
    """A line whose far end is the test: ``say`` gives what is typed, ``hear`` what the exchange makes of what comes back."""

    def __init__(self) -> None:
        self.heard: list[tuple[int, FrameDirection, bytes]] = []
        self.talk = CharacterTalk(SerialLine(4800), "bus", on_bytes=lambda now, way, data: self.heard.append((now, way, data)))
        self.now = 0

    def say(self, address: int | None, text: str, *, urgent: bool = False, **options: Any) -> bytes:
        self.request = ChipRequest(address, text, **options)
        self.now += SECOND
        return self.talk.start(self.request, self.now, urgent=urgent)

    def hear(self, data: bytes) -> bytes | SendNext | None:
        return self.talk.receive(data, self.now)

    def typed(self, address: int | None, text: str, **options: Any) -> list[bytes]:
        """A whole command whose echo is right: everything that was typed."""
        said = [self.say(address, text, **options)]
        while isinstance(answer := self.hear(said[-1]), SendNext):
            assert answer.may_wait is False
            said.append(answer.data)
        assert answer == (None if options.get("answers") else b"")
        return said


# ---------------------------------------------------------------------- what is typed


def test_a_chip_is_selected_once_and_its_command_gets_its_cr_when_the_echo_is_right() -> None:
    line = Line()
    assert line.typed(10, "f64") == [b"xa", b"\r", b"f64", b"\r"]
    assert line.talk.selected == 10
    assert line.typed(10, "r") == [b"r", b"\r"]
    assert line.typed(3, "r") == [b"x3", b"\r", b"r", b"\r"]
    assert line.typed(None, "r") == [b"r", b"\r"]
    assert line.typed(7, "", sort=ChipRequestKind.SELECT) == [b"x7", b"\r"]
    assert line.talk.selected == 7
    with pytest.raises(Misuse, match="chip 7: select: the driver selects chips by itself"):
        line.say(7, "", sort=ChipRequestKind.SELECT)
    assert [(direction, data) for _, direction, data in line.heard[:2]] == [
        (FrameDirection.IN, b"xa"),
        (FrameDirection.OUT, b"xa"),
    ]
    assert line.heard[0][0] == SECOND


def test_it_is_committed_with_the_cr_of_its_own_line() -> None:
    line = Line()
    line.say(10, "f64")
    changes = [line.request.changes]
    for echo in (b"xa", b"\r", b"f64", b"\r"):
        line.hear(echo)
        changes.append(line.request.changes)
    assert changes == [False, False, False, True, True]
    assert not ChipRequest(1, "u20", acts=False).changes
    assert (str(line.request), line.request.device) == ("chip A: f64", 10)
    assert (chip_name(None), chip_name(15), str(ChipRequest(None, " \r"))) == ("the chip", "chip F", "the chip: select")


@pytest.mark.parametrize("pieces", [(b"f640",), (b"f", b"640"), (b"f6", b"40"), (b"f", b"6", b"4", b"0")])
def test_an_echo_may_come_in_pieces(pieces: tuple[bytes, ...]) -> None:
    line = Line()
    line.say(None, "f640")
    assert [line.hear(piece) for piece in pieces] == [None] * (len(pieces) - 1) + [SendNext(b"\r", may_wait=False)]


def test_an_answer_is_what_comes_behind_the_echo_of_cr() -> None:
    line = Line()
    assert line.typed(None, "u1", answers=True) == [b"u1", b"\r"]
    assert line.hear(b"\x42") == b"\x42"
    line.say(None, "u1", answers=True)
    line.hear(b"u1")
    assert line.hear(b"\r\x13") == b"\x13"


def test_kill_is_said_at_once_and_twice_to_a_chip_that_is_not_known_to_echo() -> None:
    line = Line()
    assert line.say(7, "k", sort=ChipRequestKind.KILL, urgent=True) == b"x7\rk\rx7\rk\r"
    assert line.request.changes
    line.talk.echoing.add(7)
    assert line.say(7, "k", sort=ChipRequestKind.KILL) == b"x7\rk\r"
    assert line.hear(b"x7\rk") is None
    assert line.hear(b"\r") == b""
    assert (line.talk.selected, line.talk.dirty) == (7, False)
    line.talk.dirty = True
    assert line.say(7, "%\rk", sort=ChipRequestKind.KILL) == b"%\r%\rk\r"
    assert line.hear(b"%\r%\rk\r") == b""
    assert not line.talk.dirty


def test_what_is_said_blind_selects_nobody_and_waits_for_nothing() -> None:
    line = Line()
    line.typed(7, "r")
    line.talk.dirty = True
    assert line.say(7, "xg\rt41\r", sort=ChipRequestKind.BLIND) == b"xg\rt41\r"
    assert (line.talk.selected, line.talk.dirty) == (None, False)
    assert line.hear(b"anything") is None
    assert line.talk.abandon(line.now) == b""
    assert not line.talk.dirty


# ---------------------------------------------------------------------- what goes wrong


def test_an_answer_that_is_no_longer_waited_for_leaves_nothing_in_front_of_the_next_command() -> None:
    """The question has been taken: it is not there to be spoilt."""
    line = Line()
    line.typed(7, "u1", answers=True, acts=False)
    free_ns = line.talk.free_ns
    assert line.talk.abandon(line.now) == b""
    assert (line.talk.dirty, line.talk.selected, line.talk.free_ns) == (False, 7, free_ns)
    assert line.typed(7, "r") == [b"r", b"\r"]


def test_what_does_not_come_back_right_is_spoilt_before_the_next_command() -> None:
    line = Line()
    line.say(None, "f640")
    with pytest.raises(Garbled, match="'the chip: f640' did not come back as it was sent: 'f7' instead of 'f640'; it was not"):
        line.hear(b"f7")
    assert line.talk.dirty
    assert line.talk.free_ns == line.now + QUIET_NS + line.talk.wire_ns(8)
    assert line.typed(None, "f640") == [b"%", b"\r", b"f640", b"\r"]
    assert not line.talk.dirty
    assert line.talk.spoilt == {None: 1}
    line.talk.dirty = True
    assert line.typed(5, "r") == [b"%", b"\r", b"x5", b"\r", b"r", b"\r"]
    assert line.talk.spoilt == {None: 1, 5: 1}


def test_a_semicolon_in_what_came_back_may_have_made_the_rest_a_comment() -> None:
    line = Line()
    line.say(None, "f640")
    with pytest.raises(Garbled) as caught:
        line.hear(b"f;40")
    assert (caught.value.uncertain, line.request.commented, line.request.changes) == (True, True, True)
    line = Line()
    line.say(None, "u20", acts=False)
    with pytest.raises(Garbled) as caught:
        line.hear(b";")
    assert caught.value.uncertain is False
    line = Line()
    line.say(5, "f640")
    with pytest.raises(Garbled) as caught:
        line.hear(b";")  # of the selection
    assert caught.value.uncertain is False


def test_inverted_characters_tell_that_the_buffer_is_nearly_full() -> None:
    line = Line()
    line.say(None, "f64")
    assert line.hear(b"f") is None
    assert not line.talk.nearly_full
    assert line.hear(inverted(ord("f"))) is None
    assert line.talk.nearly_full
    assert line.hear(b"6" + inverted(ord("6"))) is None
    assert line.hear(b"4") == SendNext(b"\r", may_wait=False)
    line = Line()
    line.say(None, "f")
    assert line.hear(b"f" + inverted(ord("f"))) == SendNext(b"\r", may_wait=False)
    assert line.talk.nearly_full
    line = Line()
    line.say(None, "f")
    with pytest.raises(Garbled):
        line.hear(b"f" + inverted(ord("g")))
    line = Line()
    line.say(None, "+1")
    assert line.hear(b"+1") == SendNext(b"\r", may_wait=False)
    assert line.hear(inverted(ord("1"))) is None  # it comes behind the echo, after CR was sent
    assert line.talk.nearly_full
    assert line.hear(b"\r") == b""


def test_5eh_says_that_there_was_no_room() -> None:
    line = Line()
    line.say(None, "f64")
    with pytest.raises(NoRoom, match=r"bus: 'the chip: f64' was refused"):
        line.hear(b"f\x5e")
    assert line.talk.dirty
    assert line.say(None, "f64") == b"%"
    assert line.hear(b"\x5e") == SendNext(b"\r", may_wait=False)
    assert line.hear(b"\r") == SendNext(b"f64", may_wait=False)
    assert line.talk.dirty, "the invalid command found no room: it is to be said again"


def test_a_selection_that_may_have_been_taken_or_not_leaves_nobody_known() -> None:
    line = Line()
    line.talk.echoing |= {3, 5}
    line.typed(3, "r")
    line.say(5, "r")
    line.hear(b"x5")
    assert line.talk.abandon(line.now) == b""
    assert (line.talk.selected, line.talk.echoing, line.talk.dirty) == (None, set(), True)
    line = Line()
    line.talk.echoing |= {3, 5}
    line.typed(3, "r")
    line.say(5, "r")
    line.hear(b"x")
    assert line.talk.abandon(line.now) == b"x"
    assert (line.talk.selected, line.talk.echoing) == (3, {3, 5})


def test_after_a_failure_the_line_has_to_be_silent_but_not_for_ever() -> None:
    line = Line()
    line.say(None, "f64")
    line.talk.abandon(line.now)
    eight = line.talk.wire_ns(8)
    assert eight == pytest.approx(8 * CHARACTER_NS, abs=10)
    assert line.talk.free_ns == line.now + QUIET_NS + eight
    begin = line.now
    line.talk.stray(b"\x13", begin + NOISE_NS)
    assert line.talk.free_ns == begin + NOISE_NS + min(QUIET_NS, eight)
    line.talk.stray(b"\x13", begin + NOISE_NS + eight)
    assert line.talk.free_ns == begin + NOISE_NS + min(QUIET_NS, eight), "noise does not keep it for ever"


# ---------------------------------------------------------------------- letters that are owed


def test_a_chip_that_was_asked_owes_a_letter_that_may_come_at_any_time() -> None:
    line = Line()
    line.typed(7, TYPE_QUERY)
    assert line.talk.owes(7) == 1
    line.typed(5, "f")  # nothing comes in between
    line.say(7, "r")
    assert line.hear(b"B") is None
    assert (line.talk.owes(7), line.talk.arrived, line.talk.surplus) == (0, {7: ord("B")}, 0)
    line.talk.abandon(line.now)
    line.typed(7, TYPE_QUERY)
    line.talk.reset()
    assert (line.talk.owed, line.talk.arrived, line.talk.selected, line.talk.echoing) == ({}, {}, None, set())


def test_who_listens_gets_the_letter_and_nothing_else() -> None:
    line = Line()
    line.talk.uploads = bytearray()
    line.typed(7, TYPE_QUERY)
    line.typed(7, TYPE_QUERY)
    assert line.say(7, TYPE_QUERY, sort=ChipRequestKind.LISTEN, acts=False) == b""
    assert line.hear(b"\x00x") is None
    assert line.hear(b"\x01B") == b"B"
    assert line.talk.uploads == b"\x00x\x01"
    assert (line.talk.owes(7), line.talk.surplus) == (0, 1), "asked twice: one more may come"
    line.talk.stray(b"B", line.now)
    assert (line.talk.surplus, line.talk.dirty) == (0, False)
    line.talk.stray(b"B", line.now)
    assert line.talk.uploads == b"\x00x\x01B"


def test_a_stray_character_makes_the_line_dirty_unless_it_was_to_be_expected() -> None:
    for byte, dirty in ((0x13, True), (ord("B"), True), (0x10, True)):
        line = Line()
        line.talk.stray(bytes((byte,)), 0)
        assert line.talk.dirty is dirty, byte
    line = Line()
    line.talk.uploads = bytearray()
    line.talk.stray(b"\x13", 0)
    assert (line.talk.dirty, line.talk.uploads) == (False, b"\x13")
    assert line.heard == [(0, FrameDirection.OUT, b"\x13")]


def test_a_question_that_is_given_up_may_be_answered_yet() -> None:
    line = Line()
    line.say(7, TYPE_QUERY)
    for echo in (b"x7", b"\r", b"u20"):
        line.hear(echo)
    line.talk.abandon(line.now)
    assert line.talk.surplus == 1
    line = Line()
    line.say(7, TYPE_QUERY)
    line.hear(b"x7")
    line.talk.abandon(line.now)
    assert line.talk.surplus == 0, "its CR was not sent"


def test_what_a_program_uploads_is_kept_while_letters_of_chips_are_listened_for() -> None:
    talk = CharacterTalk(SerialLine(4800), "the line")
    talk.uploads, talk.letters = bytearray(), 0
    talk.owed[7] = 1
    talk.start(ChipRequest(7, TYPE_QUERY, sort=ChipRequestKind.LETTER, acts=False), 0, urgent=False)
    assert talk.receive(b"\x02", 1) is None
    assert talk.receive(b"B\x03", 2) == b"B"
    assert (talk.letters, talk.uploads) == (1, b"\x02\x03")


def test_after_a_watch_each_owes_what_it_owed() -> None:
    talk = CharacterTalk(SerialLine(4800), "the line")
    talk.letters, talk.surplus = 2, 1
    talk.owed = {1: 4, 2: 1, 3: 1}
    talk.end_watch({1: 2, 2: 0}, 3)
    assert (talk.letters, talk.surplus, talk.owed) == (None, 4, {1: 2, 3: 1})


def test_what_a_program_uploads_is_listened_for() -> None:
    line = Line()
    line.talk.uploads = bytearray()
    line.say(7, "", sort=ChipRequestKind.UPLOAD, acts=False)
    assert line.hear(b"\x05\x06") == b"\x05"
    assert line.talk.uploads == b"\x05\x06"


def test_time_on_the_wire() -> None:
    """Twice the command, for its echo, and 16 characters for selection, the invalid command and CRs; who listens needs none."""
    talk = Line().talk
    assert talk.allowance_ns(ChipRequest(1, "f12800")) == talk.wire_ns(28)
    for sort in (ChipRequestKind.LISTEN, ChipRequestKind.LETTER, ChipRequestKind.UPLOAD):
        assert talk.allowance_ns(ChipRequest(1, "u20", sort=sort)) == 0


def test_what_was_not_said_yet_changes_nothing() -> None:
    say = ChipRequest(3, "r")
    assert [say.changes, say.committed, say.commented, say.answers, say.acts] == [False] * 4 + [True]
    assert say.sort is ChipRequestKind.LINE


@pytest.mark.parametrize("answers", [False, True])
def test_what_comes_behind_an_exchange_belongs_to_none(answers: bool) -> None:
    line = Line()
    line.typed(None, "u1", answers=answers)
    if answers:
        assert line.hear(b"\x42") == b"\x42"
    assert line.hear(b"\x43") is None
    assert not line.request.commented
