"""Lines of worlds: their clients, what they ask and get, and the words for it."""

from __future__ import annotations

from functools import partial

import pytest

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.simulation.kinds.lines import SCRIPTS, LineTraffic, LineWrite
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.world.inputs import Download, SetVariable
from steptwin.wire.crc import with_crc
from steptwin.wire.slave import FrameDirection

READ_STATUS = bytes.fromhex("03 27 1A 00 01")
"""M1_STATUS with firmware 1.70."""
OFF = bytes.fromhex("03 02 00 00")
ON = bytes.fromhex("06 00 05 00 07")
"""A write of 7 to user register 5."""
TEXT = """
[[line]]
name = "bus"
kind = "modbus"
{bus}
[[line]]
name = "chips"
kind = "m1486"
{chips}
[[mic488]]
name = "a"
line = "bus"
[[mic488]]
name = "b"
line = "bus"
unit = 2
[[m1486]]
name = "c"
line = "chips"
address = 7
"""


def world(bus: str = "", chips: str = "") -> World:
    return World.from_toml(TEXT.format(bus=bus, chips=chips))


def rtu(pdu: bytes, unit: int = 1) -> bytes:
    return with_crc(bytes((unit,)) + pdu)


def tcp(pdu: bytes, unit: int = 1) -> bytes:
    return b"\0\1\0\0" + (len(pdu) + 1).to_bytes(2, "big") + bytes((unit,)) + pdu


def followed(there: World, line: str) -> list[str]:
    """The frames of a line as text, from now on."""
    found: list[str] = []
    spec = next(one for one in there.spec.lines if one.name == line)
    words = line_kinds()[spec.kind].traffic_log(there.lines[line], "", lambda frame: found.append(str(frame)))
    there.lines[line].subscribe_to_frames(words)
    there.trace.subscribers.append(words.recorded)
    return found


@pytest.mark.parametrize(("line", "kinds"), [("bus", "rtu, serial, tcp"), ("chips", "raw")])
def test_kinds_of_connections(line: str, kinds: str) -> None:
    there = world().lines[line]
    with pytest.raises(Misuse, match=f"line {line!r} takes no connection of kind 'usb': permitted are {kinds}"):
        there.connect("p", "usb")
    assert "p" not in there.clients
    names = kinds.split(", ")
    first, last = names[0], names[-1]
    assert there.connect("p") is there.connect("p", last)  # known by its name
    assert there.clients["p"].kind == first


def test_rates_and_timing() -> None:
    there = world()
    assert {name: (line.baud, line.is_timed) for name, line in there.lines.items()} == {
        "bus": (38400, False),
        "chips": (4800, False),
    }
    there = world('timing = "real"\nbaud = 9600', 'timing = "real"')
    assert {name: (line.baud, line.is_timed) for name, line in there.lines.items()} == {
        "bus": (9600, True),
        "chips": (4800, True),
    }
    assert there.lines["bus"].units == (1, 2)


def test_the_rate_of_a_line_is_that_of_com1() -> None:
    """Unless the line has one of its own; [AIN0] and [AIN1] of a configuration have those of COM1 and COM2."""
    text = '[[line]]\nname = "bus"\nkind = "modbus"\n{}\n[[mic488]]\nname = "a"\nline = "bus"\nconfig = "a.cfg"\n'
    files = {"a.cfg": b"[AIN0]\nBaud=9600\n[AIN1]\nBaud=115200\n"}
    assert World.from_toml(text.format(""), files).lines["bus"].baud == 9600
    assert World.from_toml(text.format("baud = 19200"), files).lines["bus"].baud == 19200
    with pytest.raises(Misuse, match="baud = 9601: a MIC488 has 9600, 19200, 38400, 57600, 115200 bit/s"):
        World.from_toml(text.format("baud = 9601"), files)


@pytest.mark.parametrize("kind", ["rtu", "tcp"])
def test_answers_of_a_line_with_timing_come_later(kind: str) -> None:
    """8 characters of 1.04 ms at 9600 bit/s, the pause that ends the request, and 7 characters back."""
    framed = rtu if kind == "rtu" else tcp
    for timing, early in (("off", True), ("real", False)):
        there = world(f'timing = "{timing}"\nbaud = 9600')
        line = there.lines["bus"]
        client = line.connect("p", kind)
        outputs: list[int] = []
        client.on_output = partial(outputs.append, 1)
        line.receive("p", framed(READ_STATUS), there.now)
        there.run(for_="5 ms")
        assert bool(client.received) is early
        there.run(for_="30 ms")
        ((moment, answer),) = client.take(there.now)
        assert answer == framed(OFF)
        assert (moment == 0) is early
        assert outputs == [1]
        assert client.take(there.now) == []


@pytest.mark.parametrize("timing", ["off", "real"])
def test_mic_15_a_pause_inside_a_request_is_an_event_with_and_without_timing(timing: str) -> None:
    there = world(f'timing = "{timing}"')
    line = there.lines["bus"]
    line.connect("p", "rtu")
    frame = rtu(READ_STATUS)
    line.receive("p", frame[:3], there.now)
    there.run(for_="10 ms")
    line.receive("p", frame[3:], there.now)
    there.run(for_="50 ms")
    assert [event.code for event in there.mic488["a"].device.events if "pause" in event.code] == ["frame-pause"]


def test_traffic_is_counted_for_all_programs_even_those_that_have_gone() -> None:
    there = world()
    bus, chips = there.lines["bus"], there.lines["chips"]
    bus.connect("p", "rtu")
    for data in (rtu(READ_STATUS), rtu(ON), rtu(READ_STATUS), rtu(bytes.fromhex("03 FF 00 00 01")), b"\xff\xff", rtu(ON)):
        bus.receive("p", data, there.now)
        there.run(for_="50 ms")
    assert bus.traffic == LineTraffic(requests=5, errors=1, unframed=2)
    bus.leave("p")
    bus.connect("q", "tcp")
    bus.receive("q", tcp(READ_STATUS), there.now)
    assert bus.traffic == LineTraffic(requests=6, errors=1, unframed=2)
    chips.connect("r")
    chips.receive("r", b"x7\rp\r", there.now)
    there.run(for_="50 ms")
    assert chips.traffic == LineTraffic(requests=2)


def test_what_cannot_change_anything_is_not_recorded() -> None:
    """A whole read request of a line without timing, faults and held bytes; nothing else."""
    there = world()
    line = there.lines["bus"]
    client = line.connect("p", "rtu")
    assert line.is_idle_read(client, rtu(READ_STATUS))
    assert not line.is_idle_read(client, rtu(ON))
    frames = len(list(there.trace.frames()))
    assert line.exchange_unrecorded("p", client, rtu(READ_STATUS), there.now) == rtu(OFF)
    assert len(list(there.trace.frames())) == frames
    assert line.exchange("p", client, rtu(READ_STATUS), there.now) == rtu(OFF)
    assert len(list(there.trace.frames())) == frames + 2
    timed = world('timing = "real"').lines["bus"]
    assert not timed.is_idle_read(timed.connect("p", "rtu"), rtu(READ_STATUS))
    chips = there.lines["chips"]
    assert not chips.is_idle_read(chips.connect("p"), b"u20\r")


def test_frames_in_words() -> None:
    there = world()
    words = followed(there, "bus")
    line = there.lines["bus"]
    line.receive("p", rtu(READ_STATUS), there.now)
    line.connect("q", "tcp")
    line.receive("q", tcp(ON, 2), there.now)
    assert [text.rpartition("  ")[2] for text in words] == [
        "unit 1: read M1_STATUS", "unit 1: read M1_STATUS = off (0)", "unit 2: write USER_REGISTER 5 = 7",
        "unit 2: wrote USER_REGISTER 5 = 7",
    ]  # fmt: skip
    assert [text[15:22].strip() for text in words] == ["p", "p", "q", "q"]


def test_frames_of_a_place_that_is_taken_again_are_those_of_its_new_kind() -> None:
    there = world()
    words = followed(there, "bus")
    line = there.lines["bus"]
    line.receive("p", rtu(READ_STATUS), there.now)
    line.leave("p")
    line.receive("q", rtu(READ_STATUS, 2), there.now)
    line.connect("p", "tcp")
    line.receive("p", tcp(ON, 2), there.now)
    assert words[-1].endswith("unit 2: wrote USER_REGISTER 5 = 7")


@pytest.mark.parametrize("kind", ["rtu", "tcp"])
def test_whom_a_request_may_change(kind: str) -> None:
    """Reads change nothing, a write its controller; of all of them one to a unit that is not there, as a broadcast is."""
    there = world()
    line, framed = there.lines["bus"], rtu if kind == "rtu" else tcp
    line.connect("p", kind)
    words = line_kinds()["modbus"].traffic_log(line, "", lambda _: None)
    assert [sorted(words.changes("p", framed(pdu, unit))) for pdu, unit in ((READ_STATUS, 1), (ON, 1), (ON, 2), (ON, 0))] == [
        [],
        [1],
        [2],
        [1, 2],
    ]


def test_bytes_that_belong_to_no_frame_are_counted_for_followers() -> None:
    there = world()
    words = followed(there, "bus")
    line = there.lines["bus"]
    for count, expected in ((2, "2 bytes that belong to no frame"), (1, "1 byte that belongs to no frame")):
        line.receive("p", b"\x55" * count + rtu(READ_STATUS), there.now)
        there.run(for_="2 s")
        assert [text for text in words if text.endswith(expected)]
        assert len(words) == 3
        words.clear()


def test_characters_in_words() -> None:
    there = world()
    words = followed(there, "chips")
    line = there.lines["chips"]
    line.receive("p", b"u20\r", there.now)
    there.run(for_="10 ms")
    assert [text.rpartition("  ")[2] for text in words] == ["Upload 20", "U20 type letter in ASCII = 66"]
    line.leave("p")
    line.receive("q", b"r\r", there.now)
    assert words[-1].rpartition("  ")[2] == "Run"


def test_a_program_that_has_disconnected_gets_nothing_more() -> None:
    there = world('timing = "real"')
    line = there.lines["bus"]
    client = line.connect("p", "rtu")
    line.receive("p", rtu(READ_STATUS), there.now)
    assert client.is_connected
    line.leave("p")
    line.leave("p")
    there.run(for_="1 s")
    assert (client.is_connected, list(client.received), line.clients) == (False, [], {})


def test_what_a_controller_lacks_is_a_refusal() -> None:
    there = World.from_toml('[[mic488]]\nname = "m"\n')
    with pytest.raises(Misuse, match="no variable 'x'"):
        there.apply_input(SetVariable("m", "x", 1.0))
    with pytest.raises((Misuse, Refusal), match="m has no place 'program 9' for a program"):
        there.apply_input(Download("m", "program 9", "END\n"))
    assert there.now < MILLISECOND


@pytest.mark.parametrize(
    ("lines", "key", "where", "link"),
    [
        ("bus", "pty", "./bus", "pty"),
        ("bus", "serial", "/dev/ttyS9", "serial"),
        ("bus", "rtu_tcp", "127.0.0.1:0", "rtu"),
        ("bus", "rfc2217", "127.0.0.1:0", "rtu"),
        ("bus", "tcp", "127.0.0.1:0", "tcp"),
        ("chips", "pty", "./chips", "pty"),
        ("chips", "serial", "/dev/ttyS9", "serial"),
        ("chips", "tcp", "127.0.0.1:0", "tcp"),
        ("chips", "rfc2217", "127.0.0.1:0", "tcp"),
    ],
)
def test_faults_name_the_links_of_a_line_and_know_their_frames(lines: str, key: str, where: str, link: str) -> None:
    def described(kind: str, link: str) -> World:
        given = {lines: f'{key} = "{where}"'}
        text = TEXT.format(bus=given.get("bus", ""), chips=given.get("chips", ""))
        return World.from_toml(f'{text}[[fault]]\nkind = "{kind}"\nline = "{lines}"\nlink = "{link}"\n')

    assert described("gap", link).spec.faults
    with pytest.raises(Misuse, match="wrong"):
        described("gap", "wrong")
    if link == "tcp" and lines == "bus":
        with pytest.raises(Misuse, match="Modbus TCP"):
            described("crc", link)
    else:
        described("crc" if lines == "bus" else "flip", link)


@pytest.mark.parametrize("kind", ["rtu", "tcp"])
def test_writes_are_told_of_places_that_are_there_and_of_those_that_come(kind: str) -> None:
    there = world()
    line, framed = there.lines["bus"], rtu if kind == "rtu" else tcp
    line.connect("early", kind)
    told: list[LineWrite] = []
    end = line_kinds()["modbus"].writes(line, told.append)
    assert end is not None
    line.connect("late", kind)
    for client, pdu, unit in (("early", ON, 1), ("late", ON, 2), ("late", READ_STATUS, 1), ("early", b"\x06\xff\x00\0\7", 1)):
        line.receive(client, framed(pdu, unit), there.now)
        there.run(for_="50 ms")
    assert [(one.client, one.units, one.outcome) for one in told] == [
        ("early", (1,), "done"),
        ("late", (2,), "done"),
        ("early", (1,), "refusal"),
    ]
    assert [one.words for one in told[:2]] == [f"unit {unit}: write USER_REGISTER 5 = 7" for unit in (1, 2)]
    end()
    line.receive("early", framed(ON), there.now)
    line.receive("late", framed(ON), there.now)
    assert len(told) == 3


def test_mic_23_writes_are_told_as_their_place_addresses_them() -> None:
    """Unit 0 is every controller of a serial line, and over TCP, as 255, the only one."""
    there = World.from_toml('[[line]]\nname = "bus"\nkind = "modbus"\n[[mic488]]\nname = "a"\nline = "bus"\n')
    line, told = there.lines["bus"], list[LineWrite]()
    writes = line_kinds()["modbus"].writes
    assert writes is not None
    writes(line, told.append)
    for client, framed in (("rtu", rtu), ("tcp", tcp)):
        line.connect(client, client)
        for unit in (0, 255):
            line.receive(client, framed(ON, unit), there.now)
            there.run(for_="50 ms")
    assert [(one.client, one.words) for one in told] == [
        ("rtu", "broadcast: write USER_REGISTER 5 = 7"),
        ("tcp", "unit 0: write USER_REGISTER 5 = 7"),
        ("tcp", "unit 255: write USER_REGISTER 5 = 7"),
    ]


def test_ports_are_served_by_what_is_put_around_the_controllers_but_not_those_of_scripts() -> None:
    there = world()
    line = there.lines["bus"]
    before = line.connect("before", "tcp")
    line.serve_by(lambda devices: {9: devices[1]})
    after, scripts = line.connect("after", "tcp"), line.connect(SCRIPTS, "rtu")
    rtu_after = line.connect("rtu", "rtu")
    for client, unit in (("before", 1), ("after", 9)):
        line.receive(client, tcp(READ_STATUS, unit), there.now)
    line.receive(SCRIPTS, rtu(READ_STATUS), there.now)
    line.receive("rtu", rtu(READ_STATUS, 9), there.now)
    there.run(for_="50 ms")
    assert [data for _, data in before.take(there.now)] == [tcp(OFF)]
    assert [data for _, data in after.take(there.now)] == [tcp(OFF, 9)]
    assert [data for _, data in rtu_after.take(there.now)] == [rtu(OFF, 9)]
    assert scripts.take(there.now) == []  # its master has it


def test_the_wire_of_chips_is_restored_with_their_world() -> None:
    """M-33: a character that begins while another is on the wire is lost and counted."""
    text = '[[line]]\nname = "chips"\nkind = "m1486"\ntiming = "real"\n' + "".join(
        f'[[m1486]]\nname = "c{n}"\nline = "chips"\naddress = {n}\n' for n in (1, 2)
    )
    there = World.from_toml(text)
    line = there.lines["chips"]
    client = line.connect("p")
    snapshot = there.snapshot()

    def answers() -> tuple[bytes, int]:
        for chip, after in (("c1", 0), ("c2", MILLISECOND)):
            there.run_to(there.now + after)
            there.m1486[chip].chip.receive(b"u20\r", there.now)
        there.run(for_="100 ms")
        return b"".join(data for _, data in client.take(there.now)), line.traffic.errors

    first = answers()
    assert first == (b"B", 1)
    there.restore(snapshot)
    assert line.traffic.errors == 0
    assert answers() == first


def test_who_has_come_since_is_gone_where_a_line_goes_back() -> None:
    line = world().lines["bus"]
    line.connect("first")
    before = line.copy_state()
    line.connect("second")
    line.set_state(before)
    assert "first" in line.clients
    assert "second" not in line.clients


def test_a_request_that_comes_while_the_controller_is_busy_is_an_error_of_the_line() -> None:
    there = world('timing = "real"\nbaud = 9600\n')
    bus = there.lines["bus"]
    bus.connect("p", "rtu")
    for _ in range(2):
        bus.receive("p", rtu(READ_STATUS), there.now)
        there.run(for_="1 ms")
    there.run(for_="200 ms")
    assert bus.traffic == LineTraffic(requests=2, errors=1)


def test_a_line_that_nobody_follows_any_more_observes_no_frames() -> None:
    class Frames:
        def frame(self, now: int, client: str, direction: FrameDirection, data: bytes) -> None:
            """It needs none."""

        def unframed(self, now: int, client: str, count: int) -> None:
            """It needs none."""

    there, frames = world(), Frames()
    there.stop_recording()
    line = there.lines["bus"]
    framed = line.connect("p", "rtu").framed
    assert framed is not None
    line.subscribe_to_frames(frames)
    assert framed.on_frame is not None
    line.unsubscribe_from_frames(frames)
    assert framed.on_frame is None


@pytest.mark.parametrize("moment_ms", range(0, 40, 3))
def test_mic_32_requests_of_several_ports_that_wait_are_restored(moment_ms: int) -> None:
    """Four programs ask one controller, each again as soon as it has its answer; one of them leaves."""
    kinds = {"tcp-1": "tcp", "tcp-2": "tcp", "rtu-1": "rtu", "rtu-2": "rtu"}

    def go_on(there: World, until_ms: int) -> list[tuple[str, int]]:
        line, answers = there.lines["bus"], []
        while there.now < until_ms * MILLISECOND:
            if there.now == 21 * MILLISECOND and "tcp-1" in line.clients:
                line.leave("tcp-1")
            for name, client in tuple(line.clients.items()):
                for moment, _ in client.take(there.now):
                    answers.append((name, moment))
                    line.receive(name, (tcp if kinds[name] == "tcp" else rtu)(READ_STATUS), there.now)
            there.run(for_="1 ms")
        return answers

    there, other = world('timing = "real"'), world('timing = "real"')
    for name, kind in kinds.items():
        there.lines["bus"].connect(name, kind)
        there.lines["bus"].receive(name, (tcp if kind == "tcp" else rtu)(READ_STATUS), 0)
    go_on(there, moment_ms)
    snapshot = there.snapshot()
    answers = go_on(there, 200)
    other.restore(snapshot)
    assert go_on(other, 200) == answers
    assert {name for name, _ in answers} >= set(kinds) - {"tcp-1"}
