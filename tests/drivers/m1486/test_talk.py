"""What is said on a line of chips, character by character."""

from __future__ import annotations

from steptwin.drivers.m1486.talk import WHO, CharacterTalk, Say, Sort
from steptwin.wire.line import SerialLine


def test_what_a_program_uploads_is_kept_while_letters_of_chips_are_listened_for() -> None:
    talk = CharacterTalk(SerialLine(4800), "the line")
    talk.uploads, talk.letters = bytearray(), 0
    talk.owed[7] = 1
    talk.start(Say(7, WHO, sort=Sort.LETTER, acts=False), 0, urgent=False)
    assert talk.receive(b"\x02", 1) is None
    assert talk.receive(b"B\x03", 2) == b"B"
    assert (talk.letters, talk.uploads) == (1, b"\x02\x03")
