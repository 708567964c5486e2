"""Somebody types to chips, line by line. The chips live in virtual time, the thread that listens in real time."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from chip_rig import ChipWire, typed
from line_rig import MemoryChannel, at_every_address

from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.m1486 import conversation, terminal
from steptwin.drivers.m1486.kind import M1486_DRIVER
from steptwin.errors import LineFailure, Misuse, Refusal

ADDRESS = DeviceAddress("memory", "m1486", 7, 4800, 1.0, "B")
ALL = DeviceAddress("memory", "m1486", None, 4800, 1.0)


class Talk:
    """A conversation on a wire, what it shows and what it logs."""

    def __init__(self, wire: ChipWire, address: DeviceAddress) -> None:
        self.wire = wire
        self.shown: list[str] = []
        self.log: list[str] = []
        self.conversation = M1486_DRIVER.terminal(address, self.shown.append, self.log.append)

    def __call__(self, line: str) -> list[str]:
        """What is shown meanwhile."""
        del self.shown[:]
        assert list(self.conversation.answer(line, waits=True)) == []
        return list(self.shown)


@pytest.fixture
def talk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Talk]:
    wire = ChipWire(addresses=(7,))
    at_every_address(monkeypatch, wire)
    talk = Talk(wire, ADDRESS)
    yield talk
    talk.conversation.close()


def test_commands_and_what_comes_back(talk: Talk) -> None:
    talk.conversation.greet()
    assert talk.conversation.prompt == "7> "
    assert talk("u20") == ["42H  U20 type letter in ASCII: M1486B"]
    assert talk("v500 ; slow") == []
    assert talk.wire.chip.drive.velocity == 500
    assert talk("") == []
    assert talk("; nothing") == []
    assert talk.log[-2:] == ["→ u20 CR", "→ v500 CR"]
    assert talk("xg") == []
    assert talk.conversation.prompt == "all> "


def test_what_is_no_command_is_not_sent(talk: Talk) -> None:
    talk.conversation.greet()
    before = len(talk.wire.sent)
    with pytest.raises(Misuse):
        talk("v99999999")
    assert len(talk.wire.sent) == before
    # As it is, without a look at it.
    talk("raw v500")
    assert talk.wire.chip.drive.velocity == 500


def test_a_wait_asks_for_the_type_letter(talk: Talk) -> None:
    talk("f640")
    talk("r")
    assert talk("wait") == ["42H  U20 type letter in ASCII: M1486B"]
    assert not talk.wire.moving()
    assert talk.wire.true() == 640
    assert talk("wait 5") == ["42H  U20 type letter in ASCII: M1486B"]


def test_a_wait_ends_with_its_time(talk: Talk) -> None:
    talk("u20")
    talk.wire.severed = True
    with pytest.raises(LineFailure, match=r"chip 7 neither echoes nor answers within 0.2 s"):
        talk("wait 0.2")


@pytest.mark.parametrize("line", ["sleep -1", "sleep 3601", "wait 3601"])
def test_times_have_bounds(talk: Talk, line: str) -> None:
    with pytest.raises(Misuse, match=f"'{line}': permitted are 0 to 3600 s"):
        talk(line)


@pytest.mark.parametrize("text", ["0", "3600", "0,5"])
def test_a_sleep(talk: Talk, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    slept: list[float] = []
    with monkeypatch.context() as patched:
        patched.setattr(conversation.time, "sleep", slept.append)
        assert talk(f"sleep {text}") == []
    assert slept == [float(text.replace(",", "."))]
    assert talk.wire.sent == []


def test_k_is_sent_before_anything_is_known_of_the_line(talk: Talk) -> None:
    """All chips are selected first, which ends an incomplete command; then the chip of the address."""
    assert [talk.conversation.is_stop(line) for line in ("k", "K", "kx", "r", "")] == [True, True, True, False, False]
    talk("k")
    assert typed(talk.wire) == "xg xg x7 k "
    assert talk.log == ["→ xg CR", "→ xg CR", "→ x7 CR", "→ k CR"]
    # Whether the line echoes is found out with the next command, on a connection of its own.
    before = talk.wire.opened
    talk("v500")
    assert talk.wire.opened == before + 1
    talk("v600")
    talk("k")
    assert talk.wire.opened == before + 1


def test_without_a_chip_k_is_sent_to_whoever_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(2, 10))
    at_every_address(monkeypatch, wire)
    talk = Talk(wire, ALL)
    assert talk.conversation.greeting == "M1486 on memory; 'help' helps, k stops the motor, Ctrl-D ends"
    assert talk.conversation.prompt == "all> "
    talk("k")
    assert typed(wire) == "k k "
    talk.conversation.close()
    assert talk.conversation.prompt == "all> "


def test_a_line_that_does_not_echo_takes_k_only(talk: Talk) -> None:
    talk.wire.severed = True
    with pytest.raises(LineFailure, match=r"Only k is typed as long as it does not echo$"):
        talk.conversation.greet()
    talk("k")
    assert typed(talk.wire).endswith("xg xg x7 k ")


def test_a_command_that_finds_no_room_is_refused(talk: Talk) -> None:
    """The chip moves without end, and reads nothing from its input buffer."""
    talk("g+")
    talk("r")
    told = ""
    for _ in range(20):
        try:
            talk("v500")
        except Refusal as refusal:
            told = str(refusal)
            break
    assert told == "'v500' found no room (5EH): the chip moves, waits or is held. 'wait' before it waits for that"


def test_a_wait_that_finds_no_room_is_refused(talk: Talk) -> None:
    talk("g+")
    talk("r")
    for _ in range(20):
        try:
            talk("v500")
        except Refusal:
            break
    with pytest.raises(Refusal, match=r"^'wait 5': u20 found no room \(5EH\): the chip moves, waits or is held$"):
        talk("wait 5")


def test_the_line_is_closed_when_its_preparation_is_interrupted(talk: Talk, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = 0

    def close(channel: MemoryChannel) -> None:
        nonlocal closed
        closed += 1

    monkeypatch.setattr(MemoryChannel, "close", close)

    def interrupt(_: bytes) -> None:
        raise KeyboardInterrupt

    talk.wire.before_each = interrupt
    with pytest.raises(KeyboardInterrupt):
        talk("v500")
    assert closed == 1


def test_without_a_chip_all_are_selected_whoever_was_selected_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another program has left one selected that is not there."""
    wire = ChipWire(addresses=(3, 7))
    at_every_address(monkeypatch, wire)
    wire.chain.receive(b"xb\r", wire.now)
    talk = Talk(wire, ALL)
    talk.conversation.greet()
    assert talk("x7") == []
    assert talk("u20") == ["42H  U20 type letter in ASCII: M1486B"]
    assert typed(wire).startswith("xg xg ")
    talk.conversation.close()


def test_a_chip_that_is_not_there_is_told_soon(talk: Talk, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its selection by X was never verified."""
    monkeypatch.setattr(terminal, "SILENT_S", 0.5)
    talk("x5")
    with pytest.raises(LineFailure, match=r"chip 5 neither echoes nor answers within 0\.5 s: it is not there"):
        talk("u20")
    with pytest.raises(LineFailure, match="chip 5 neither"):
        talk("wait")
