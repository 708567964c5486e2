"""Served M1486 chips: places on the line, what a hand does, and an EEPROM that survives what happens to its process."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import pytest

import steptwin
from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory
from steptwin.live.cell import Cell
from steptwin.live.links import Feed
from steptwin.live.tcp import Clients, TcpLink
from steptwin.m1486.chip import Event
from steptwin.m1486.eeprom import image_of, unpack
from steptwin.m1486.lines import DUAL_DAC, TWO_DACS, Interface
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import variant
from steptwin.machine import SECOND, TalkingPort
from steptwin.served.m1486 import ChainOptions, M1486Line, memory_name, parse_addresses, parse_wire
from steptwin.words.frames import FrameLine
from steptwin.words.m1486_state import program_words
from steptwin.world.addresses import Address
from steptwin.world.kernel import PinName, Wire

Run = Callable[..., Any]


def line(kind: str = "B", addresses: str = "0,7", **options: Any) -> M1486Line:
    return M1486Line(ChainOptions(variant=variant(kind), addresses=parse_addresses(addresses), **options))


def later(served: M1486Line, seconds: float) -> int:
    """Let time pass; the new moment."""
    now = served.kernel.now + round(seconds * SECOND)
    served.kernel.advance(now)
    return now


def type_to(served: M1486Line, *lines: str) -> None:
    """Type at the line's moment."""
    served.chain.receive("".join(f"{text}\r" for text in lines).encode(), served.kernel.now)


# ---------------------------------------------------------------------- options


def test_addresses_are_hexadecimal_digits() -> None:
    assert parse_addresses("0, 7,a,F") == [0, 7, 10, 15]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,G", "--chain 0,G: 'G' is no address; permitted are 0 to 9 and A to F, separated by commas"),
        ("10", "--chain 10: '10' is no address; permitted are 0 to 9 and A to F, separated by commas"),
        ("", "--chain : '' is no address; permitted are 0 to 9 and A to F, separated by commas"),
        ("7,0,7", "--chain 7,0,7: 7 is given twice"),
    ],
)
def test_no_addresses(text: str, message: str) -> None:
    with pytest.raises(Misuse) as refusal:
        parse_addresses(text)
    assert str(refusal.value) == message


def test_an_e_type_has_no_address_0() -> None:
    with pytest.raises(Misuse, match="address 0: M1486E1 takes 1 to F"):
        line("E1", "0")


def test_wires() -> None:
    assert parse_wire("0.B1=7.b3") == Wire(PinName("0", "B1"), PinName("7", "B3"))
    assert parse_wire("a.boost=F.LIMIT") == Wire(PinName("A", "BOOST"), PinName("F", "LIMIT"))
    with pytest.raises(Misuse, match=r"--wire B1=B3: expected FROM=TO with chips by address, such as 0\.B1=7\.B3"):
        parse_wire("B1=B3")
    with pytest.raises(Misuse, match="no machine '3': there are 0, 7"):
        line(wires=[parse_wire("0.B1=3.B3")])


def test_a_wire_carries_an_output_to_another_chip() -> None:
    served = line(wires=[parse_wire("0.B1=7.B3")])
    type_to(served, "x7", "z3", "f6400", "r", "x0", "c1")
    later(served, 1)
    assert served.chips[7].drive.true_u(served.kernel.now) == 6400


# ---------------------------------------------------------------------- several programs on the line


class Told:
    """A writer that keeps what comes."""

    def __init__(self) -> None:
        self.data = b""

    def write(self, data: bytes) -> None:
        self.data += data


def on_line(run: Run, served: M1486Line, play: Callable[[Cell, list[tuple[Feed, Told]]], Any], programs: int = 2) -> Any:
    """Play a scene with programs connected to the line, in virtual time."""

    async def scene() -> Any:
        loop: Any = asyncio.get_running_loop()
        cell = Cell(served.kernel, loop.clock())
        feeds = []
        for number in range(programs):
            told = Told()
            feeds.append((Feed(cell, served.port(f"program-{number}"), told), told))
        try:
            return await play(cell, feeds)
        finally:
            for feed, _ in feeds:
                feed.close()
            cell.close()

    return run(scene())


def test_every_program_hears_what_a_chip_says(run: Run) -> None:
    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> list[bytes]:
        (one, told_one), (_, told_two) = programs
        one.take(b"x7\rw250\ru20\r")
        await asyncio.sleep(0.2)
        assert told_one.data == told_two.data == b""
        await asyncio.sleep(0.1)
        return [told_one.data, told_two.data]

    assert on_line(run, line(), play) == [b"B", b"B"]


def test_a_program_that_has_gone_hears_nothing(run: Run) -> None:
    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> list[bytes]:
        (one, told_one), (two, told_two) = programs
        one.take(b"x7\rw250\ru20\r")
        two.close()
        await asyncio.sleep(1)
        return [told_one.data, told_two.data]

    assert on_line(run, line(), play) == [b"B", b""]


def test_programs_may_share_a_command(run: Run) -> None:
    """The line is one: the chip cannot know who typed what."""

    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> bytes:
        (one, told), (two, _) = programs
        one.take(b"x7\ru2")
        two.take(b"0\r")
        await asyncio.sleep(0.1)
        return told.data

    assert on_line(run, line(), play) == b"B"


def test_characters_take_their_time_on_the_wire(run: Run) -> None:
    """300 bit/s: 10 bits take 33.3 ms. Three characters come in, one goes out."""
    served = line(addresses="F", baud=300, is_timed=True)

    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> list[bytes]:
        ((one, told),) = programs
        one.take(b"u20\r")
        seen = []
        for _ in range(3):
            await asyncio.sleep(4 * 10 / 300 - 0.01 if not seen else 0.02 if len(seen) == 1 else 10 / 300)
            seen.append(told.data)
        return seen

    assert on_line(run, served, play, programs=1) == [b"", b"", b"B"]


def test_a_port_is_one_that_talks(run: Run) -> None:
    assert isinstance(line().port("pty"), TalkingPort)


def test_a_client_that_does_not_read_loses_what_is_said(run: Run) -> None:
    """A chip that talks for ever must not fill the memory for a client that has fallen asleep."""

    async def scene() -> tuple[int, int, int, float]:
        loop: Any = asyncio.get_running_loop()
        served = line(addresses="F")
        cell = Cell(served.kernel, loop.clock())
        clients = Clients()
        link = TcpLink(cell, Address("127.0.0.1", 0), served.client_port, clients)
        address = await link.open()
        with socket.create_connection(address) as sleeper:
            await asyncio.sleep(0.1)
            (client,) = clients.present
            while not client.waiting:
                client.write(bytes(65536))
            full = client.waiting
            Feed(cell, served.port("typist"), Told()).take(b"[\r@1\ru20\rj1\r]\r")
            await asyncio.sleep(1)
            asleep, woken = client.waiting, loop.time()
            sleeper.setblocking(False)
            heard = b""
            while not heard.strip(b"\0"):
                await asyncio.sleep(0.01)
                with contextlib.suppress(BlockingIOError):
                    heard += sleeper.recv(1 << 20)
            awake_s = loop.time() - woken
        await link.close()
        cell.close()
        return full, asleep, len(heard.lstrip(b"\0")), awake_s

    full, asleep, heard, awake_s = run(scene())
    assert asleep == full
    assert 0 < heard <= 600 * awake_s, "what was said in the second of its sleep is not in it"


# ---------------------------------------------------------------------- characters in words


def test_the_line_in_words(run: Run) -> None:
    served = line("B", is_written_down=True)
    lines: list[FrameLine] = []
    served.frames.sinks.append(lines.append)

    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> None:
        listener = served.log_characters(cell)
        (one, _), (two, _) = programs
        one.take(b"x7\rF12800\r")
        two.take(b"u20\r; so\r\rq3\ri80h")
        two.take(b"3\rf\r")
        await asyncio.sleep(0.1)
        one.take(b"t57\rt41\r")
        await asyncio.sleep(0.1)
        one.take(b"u16\r")
        await asyncio.sleep(0.1)
        listener.close()

    on_line(run, served, play)
    assert [(str(each.direction.name), each.link, each.meaning) for each in lines if each.meaning] == [
        ("IN", "program-0", "X7  indeX 7"),
        ("IN", "program-0", "F12800  Forward 12 800 min. microsteps"),
        ("IN", "program-1", "U20  Upload 20"),
        ("IN", "program-1", "a comment"),
        ("IN", "program-1", "an empty line"),
        ("IN", "program-1", "Q3  out of range"),
        ("IN", "program-1", "I80H3  If flag 80 is high go to 3"),
        ("IN", "program-1", "F  with the internal variable as number"),
        ("IN", "program-0", "T57  Function on 57"),
        ("IN", "program-0", "T41  Function on 41"),
        ("OUT", "line", "the input buffer is empty"),
        ("IN", "program-0", "U16  Upload 16"),
        ("OUT", "line", "echo of 'u'"),
        ("OUT", "line", "echo of '1'"),
        ("OUT", "line", "echo of '6'"),
        ("OUT", "line", "echo of '\\r'"),
        ("OUT", "line", "the input buffer is empty"),
        ("OUT", "line", "U16 production series = 1"),
    ]


def test_answers_of_a_full_buffer_in_words(run: Run) -> None:
    served = line("B", "F", is_written_down=True)
    lines: list[FrameLine] = []
    served.frames.sinks.append(lines.append)

    async def play(cell: Cell, programs: list[tuple[Feed, Told]]) -> None:
        listener = served.log_characters(cell)
        programs[0][0].take(b"r\r" + b"f1\r" * 12)
        await asyncio.sleep(0.1)
        listener.close()

    on_line(run, served, play)
    assert [each.meaning for each in lines if each.link == "line"] == [
        "'\\r' inverted: it took one of the last three places of the input buffer",
        "'f' inverted: it took one of the last three places of the input buffer",
        "'1' inverted: it took one of the last three places of the input buffer",
        *["no room in the input buffer: a character is lost"] * 4,
    ]


# ---------------------------------------------------------------------- a hand at the machine


@pytest.fixture
def asked(run: Run) -> Callable[..., list[Any]]:
    """``asked(line, request, ...)``: the answers of a line's handlers, one after the other at one moment."""

    def play(served: M1486Line, *requests: Mapping[str, Any]) -> list[Any]:
        async def scene() -> list[Any]:
            loop: Any = asyncio.get_running_loop()
            loop.now_ns = served.kernel.now
            cell = Cell(served.kernel, loop.clock())
            cell.clock.lag(-served.kernel.now)
            handlers = served.handlers(cell)
            answers = [json.loads(json.dumps(handlers[request["do"]](request))) for request in requests]
            cell.close()
            return answers

        return run(scene())

    return play


def test_pins_are_shown_and_set(asked: Callable[..., list[Any]]) -> None:
    before, after = asked(line(), {"do": "pin", "unit": 7}, {"do": "pin", "unit": "7", "set": {"b3": 0, "Limit": 0}})
    assert {name for name in before if before[name] != after[name]} == {"B3", "LIMIT"}
    assert (after["B3"], after["LIMIT"]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        ({"unit": 0, "set": {"B1": 0, "B22": 1}}, "no input pin 'B22': inputs are B1 to B21, JOG, LIMIT, SD, RST, S&D, DUAL"),
        ({"unit": 0, "set": {"B1": 0, "B2": 0.5}}, "B2 = 0.5: a digital input is 0 or 1"),
        ({"unit": 0, "set": {"B1": 0, "B2": "low"}}, "B2 = 'low': a pin takes a number"),
        ({"unit": 0, "set": [1]}, '"set" = [1]: expected {NAME: VALUE, ...}'),
        ({}, "several chips are served: choose one with --unit: 0, 7"),
        ({"unit": "A"}, "no chip A: served are 0, 7"),
        ({"unit": "xyz"}, "no chip xyz: served are 0, 7"),
    ],
)
def test_all_pins_are_set_or_none(asked: Callable[..., list[Any]], request_: dict[str, Any], text: str) -> None:
    served = line()
    with pytest.raises(Misuse) as refusal:
        asked(served, {"do": "pin", **request_})
    assert str(refusal.value).startswith(text)
    assert served.chips[0].pins()["B1"] == 1.0


def test_a_chip_is_chosen_by_the_address_that_its_pins_gave_it_last(asked: Callable[..., list[Any]]) -> None:
    """ADDR3 (B21) makes an A of 2, when RST goes high; then 2 is nobody, and two chips can have the same address."""
    served = M1486Line(ChainOptions(variant=variant("B"), addresses=(2, 7)))
    moved = {"do": "pin", "unit": 2, "set": {"ADDR3": 1, "RST": 1}}
    _, state = asked(served, moved, {"do": "state", "unit": "A"})
    assert state["address"] == "A"
    assert served.told(2, Event(0, "moves", "moves")) == "chip A: moves"
    with pytest.raises(Misuse, match="no chip 2: served are A, 7"):
        asked(served, {"do": "state", "unit": 2})
    pins = {"ADDR0": 0, "ADDR1": 1, "ADDR2": 0, "ADDR3": 1, "RST": 1}
    with pytest.raises(Misuse, match="several chips have address A: served are A, A"):
        asked(served, {"do": "pin", "unit": 7, "set": pins}, {"do": "state", "unit": "A"})


@pytest.mark.parametrize(
    ("interface", "taken", "free", "lines"),
    [(TWO_DACS, "B12", "B7", "B8 to B17"), (TWO_DACS, "B8", "B18", "B8 to B17"), (DUAL_DAC, "B10", "B9", "B10 to B17")],
)
def test_m_21_a_line_that_the_driver_interface_has_is_tied_to_nothing(
    asked: Callable[..., list[Any]], interface: Interface, taken: str, free: str, lines: str
) -> None:
    def tied(*wires: str) -> M1486Line:
        return M1486Line(
            ChainOptions(variant=variant("B"), addresses=(0, 7), interface=interface, wires=[parse_wire(wire) for wire in wires])
        )

    tied(f"0.{free}=7.B3")
    text = f"{taken} is taken: the {interface.title} interface has {lines}"
    for wire in (f"0.{taken}=7.B3", f"0.B1=7.{taken}"):
        with pytest.raises(Misuse, match=f"--wire {wire}: {text}"):
            tied(wire)
    with pytest.raises(Misuse, match=text):
        asked(tied(), {"do": "pin", "unit": 0, "set": {free: 0, taken: 0}})


def test_power_comes_to_all_chips_or_to_one(asked: Callable[..., list[Any]]) -> None:
    served = line()
    type_to(served, "x0", "t41", "x7", "t42")
    later(served, 0.1)
    asked(served, {"do": "power-cycle", "unit": 0})
    assert [chip.receiver.is_listening for chip in served.chips.values()] == [True, True]
    assert [chip.unit.function_byte(40) for chip in served.chips.values()] == [0b000, 0b100]
    asked(served, {"do": "power-cycle"})
    assert [chip.unit.function_byte(40) for chip in served.chips.values()] == [0, 0]


def test_the_state_is_plain_data(asked: Callable[..., list[Any]]) -> None:
    served = line("B", "A")
    type_to(served, "v500", "m4", "f64000", ":77", ">3", "t80", "t44", "r", "u1")
    later(served, 0.1)
    type_to(served, "f640")
    later(served, 0.9)
    (shown,) = asked(served, {"do": "state"})
    pins, motion = shown.pop("pins"), shown.pop("motion")
    assert (pins["BOOST"], pins["B1"]) == (0.0, 1.0)
    assert 30_000 < motion.pop("true_position") < 32_000
    assert motion == {"is": "move", "position": 64_000, "position_valid": True, "velocity": 500.0}
    assert shown == {
        "controller": "M1486",
        "time_s": 1.0,
        "variant": "B",
        "address": "A",
        "interface": "sd",
        "baud": 4800,
        "listens": True,
        "program": {
            "does": "waits for the end of the move",
            "next": "U1",
            "memory_bits": 24 + 16 + 32 + 32 + 16 + 16 + 16 + 8 + 16,
            "memory_size_bits": 2032,
            "stored_bytes": 0,
        },
        "input_buffer": {"waiting": 5, "size": 32},
        "settings": {
            "S": 200, "A": 5000, "P": 25000, "V": 500, "M": 4, "Q": 1, "N": 1, "next_distance": 64000, "next_direction": 1,
        },
        "variable": 77,
        "remainder": 0,
        "registers": {str(n): 77 if n == 3 else 0 for n in range(1, 9)},
        "flags_on": [80],
        "functions_on": [44, *range(48, 56)],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("typed", "pins", "words"),
    [
        (["c40"], {}, "has nothing to do"),
        (["w2000", "c40"], {}, "waits 1.000 s more"),
        (["z3"], {}, "waits until B3 is low"),
        (["c3", "o3"], {}, "waits until B3 is high"),
        (["c51", "k"], {}, "stopped by Kill (C75 lets it go on)"),
        (["c51", "g+", "r"], {"LIMIT": 0}, "stopped by LIMIT"),
        (["g+", "r", "c40"], {}, "waits for the end of the endless move"),
        ([")3", "c40"], {}, "waits for the end of the seek"),
        (["[", "@1", "j1", "]"], {}, "runs"),
        (["c40"], {"SD": 0}, "shut down"),
    ],
)
def test_what_a_program_does_in_words(typed: list[str], pins: dict[str, int], words: str) -> None:
    served = line("B", "F")
    type_to(served, *typed)
    now = later(served, 1)
    for pin, level in pins.items():
        served.chips[15].set_pin(pin, level, now)
    assert program_words(served.chips[15], now) == words


# ---------------------------------------------------------------------- the EEPROM

FILE = ("[", "f6400", "r", "]")


def e_chip(state: StateDirectory | None, image: bytes | None = None) -> M1486Line:
    return M1486Line(ChainOptions(variant=variant("E1"), addresses=[1]), state=state, image=image)


def test_a_stored_file_runs_when_the_next_twin_is_switched_on(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        served = e_chip(state)
        type_to(served, *FILE)
        later(served, 5)
        assert state.load(memory_name(1)) == served.chips[1].image != b""
    with StateDirectory(tmp_path) as state:
        served = e_chip(state)
        later(served, 1)
        assert served.chips[1].drive.true_u(served.kernel.now) == 6400
        events: list[str] = []
        served.watch_events(lambda address, event: events.append(event.code))
        assert events == ["moves", "stands"]
        type_to(served, "\\")
        later(served, 2)
    with StateDirectory(tmp_path) as state:
        assert e_chip(state).chips[1].image == b""


def test_a_program_to_switch_on_with_goes_into_the_eeprom(tmp_path: Path) -> None:
    image = image_of(parse("f640\nr\n")[0], variant("E1"))
    with StateDirectory(tmp_path) as state:
        served = e_chip(state, image)
        later(served, 1)
        assert served.chips[1].drive.true_u(served.kernel.now) == 640
    with StateDirectory(tmp_path) as state:
        assert e_chip(state).chips[1].image == image


def test_a_program_to_switch_on_with_is_for_one_chip() -> None:
    with pytest.raises(Misuse, match="for a single chip: here are 2"):
        M1486Line(ChainOptions(variant=variant("B"), addresses=[0, 7]), image=b"")


def test_each_chip_has_its_own_eeprom(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        served = M1486Line(ChainOptions(variant=variant("E2"), addresses=[1, 10]), state=state)
        type_to(served, "xA", *FILE)
        later(served, 5)
    assert {path.name for path in tmp_path.iterdir()} - {"owner.lock"} == {"m1486-A-eeprom.image"}


def test_what_another_type_has_stored_is_said(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        state.save(memory_name(1), b"nonsense")
        with pytest.raises(Misuse, match=r"m1486-1-eeprom: this is not the stored file of an M1486"):
            e_chip(state)


def test_a_disk_that_refuses_is_an_event_and_the_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with StateDirectory(tmp_path) as state:
        served = e_chip(state)
        monkeypatch.setattr(os, "fsync", full)
        events: list[str] = []
        served.watch_events(lambda address, event: events.append(served.told(address, event)))
        type_to(served, *FILE)
        later(served, 5)
        monkeypatch.undo()
        assert served.chips[1].drive.true_u(served.kernel.now) == 6400
        assert state.load(memory_name(1)) is None
    (said,) = [text for text in events if "could not be kept" in text]
    assert "No space left on device" in said


# ---------------------------------------------------------------------- kill -9

SAVER = """
import sys
from steptwin.m1486.variants import variant
from steptwin.machine import SECOND
from steptwin.served.m1486 import ChainOptions, M1486Line
from steptwin.files.memory import StateDirectory
with StateDirectory(sys.argv[1]) as state:
    line = M1486Line(ChainOptions(variant=variant("E1"), addresses=[1]), state=state)
    now, number = 0, int(sys.argv[2])
    while True:
        number += 1
        line.chain.receive(b"[\\r" + b"".join(b":%d\\r" % number for _ in range(6)) + b"]\\r", now)
        now += 4 * SECOND
        line.kernel.advance(now)
        print(number, flush=True)
"""


@contextmanager
def _saver(path: Path, number: int) -> Generator[tuple[subprocess.Popen[str], IO[str]], None, None]:
    """A chip that is sent file after file, each with its number in every command; with what it says after each."""
    child = subprocess.Popen(
        [sys.executable, "-c", SAVER, str(path), str(number)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(Path(steptwin.__file__).parents[1]), *filter(None, sys.path)))},
    )
    with child:
        try:
            assert child.stdout is not None
            yield child, child.stdout
        finally:
            child.kill()


def _stored(path: Path) -> int:
    """The number in the file that a chip switched on now has; every command must have it."""
    with StateDirectory(path) as state:
        file = unpack(e_chip(state).chips[1].image, variant("E1"))
    assert file is not None
    commands = [file.code[at : at + 4] for at in range(0, len(file.code), 4)]
    assert len(commands) == 6
    (one,) = set(commands)
    return int.from_bytes(one[1:], "little")


def test_a_twin_killed_again_and_again_keeps_whole_files(tmp_path: Path) -> None:
    """The file found is one that was sent, whole, and not older than the last one that was safe."""
    chance = random.Random(1486)
    kills = found = 0
    end = time.monotonic() + 3.0
    while kills < 3 or (kills < 20 and time.monotonic() < end):
        with _saver(tmp_path, found) as (child, says):
            first = int(says.readline())
            time.sleep(chance.uniform(0.0, 0.02))
            child.send_signal(signal.SIGKILL)
            told = [first, *map(int, says.read().split("\n")[:-1])]
        kills += 1
        found = _stored(tmp_path)
        assert told[-1] <= found <= told[-1] + 1
    assert found >= kills
