"""Power-up, RST, shutdown, the EEPROM, snapshots, and the contract of time (manual chapters II, IV, VI, VII.5, X)."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.m1486.chip import SHUTDOWN_RESET_NS, M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import DUAL_DAC, STEP_DIRECTION, TWO_DACS, Interface
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import VARIANTS, Variant, variant


def image(kind: str, *lines: str) -> bytes:
    return image_of(parse("\n".join(lines)).program, variant(kind))


# ---------------------------------------------------------------------- defaults and reset


@pytest.mark.parametrize("v", VARIANTS, ids=lambda v: v.name)
def test_defaults(v: Variant) -> None:
    for interface, m in ((STEP_DIRECTION, 1), (DUAL_DAC, 4), (TWO_DACS, 4)):
        chip = M1486Chip(v, interface=interface)
        drive = chip.drive
        assert (drive.distance_u, drive.microstep, drive.qualification, drive.characteristic) == (64_000, m, 1, 1)
        assert (drive.velocity, drive.profile_speed, drive.start_stop, drive.acceleration) == (1000, 25_000, 200, 5000)
        assert (chip.unit.variable, chip.unit.flag_byte(), drive.counter_u(0)) == (0, 0, 0)
        assert chip.deadline() is None
        assert chip.is_idle()


@pytest.mark.parametrize(
    ("lines", "idle"),
    [
        (["u20"], True),
        (["w5"], False),
        (["o4"], False),
        (["f64000", "r"], False),
        (["c51", "k"], False),
        (["[", "f64"], True),
    ],
)
def test_a_chip_is_idle_when_nothing_goes_on_and_nothing_waits(lines: list[str], idle: bool) -> None:
    bench = Bench("B")
    bench.pin(B4=0)
    bench.send(*lines)
    bench.run(ms=3)
    assert bench.chip.is_idle() is idle


def test_a_chip_is_not_idle_while_its_eeprom_is_written_or_characters_arrive() -> None:
    bench = Bench("E1", address=1)
    bench.send("u20")
    assert not bench.chip.is_idle()
    bench.run(0.6)
    assert bench.chip.is_idle()
    timed = Bench("B", is_timed=True)
    timed.raw(b"\n")
    assert not timed.chip.is_idle()
    timed.run(0.1)
    assert timed.chip.is_idle()


def test_reset_sets_defaults_at_once_on_types_with_ram() -> None:
    bench = Bench("B", address=3)
    bench.do("v2000", "f64", "r", ":7", "t80", "t40", "m8", "c2", ">1", "g+")
    bench.send("\\", "f640", "r", "u20")
    assert bench.finish() == b"\x42"
    assert (bench.counter, bench.true) == (640, 704)
    assert bench.chip.drive.velocity == 1000
    assert (bench.variable, bench.chip.unit.flag_byte(), bench.level("B2"), bench.chip.memory.register(1)) == (0, 0, 1, 0)
    assert bench.chip.address == 3


def test_a_reset_reads_the_interface_pins_but_not_address_and_baud() -> None:
    bench = Bench("B", address=3, interface=TWO_DACS, baud=300)
    bench.pin(DUAL=0, ADDR0=0, ADDR3=1, BR0=1)
    bench.do("\\", "u15")
    assert (bench.chip.interface, bench.chip.address, bench.chip.uart.baud) == (DUAL_DAC, 3, 300)
    bench.chip.set_pin("s&d", 0, bench.now)
    assert bench.do("\\", "u15") == b"\x02"


# ---------------------------------------------------------------------- RST


def test_rst_with_all_address_pins_low_resets() -> None:
    bench = Bench("B", address=0, baud=4800)
    bench.do("v2000", "c2", "t41")
    bench.file("w100", "u20")
    bench.raw(b"w1")
    bench.sent()
    bench.pin(BR0=1, BR1=0, RST=1)
    bench.pin(RST=0)
    assert bench.finish() == b""
    assert bench.chip.uart.baud == 1200
    assert (bench.chip.drive.velocity, bench.level("B2"), bench.chip.memory.end, bench.chip.receiver.waiting) == (1000, 1, 0, 0)


def test_m_23_rst_with_an_address_pin_high_starts_the_program_again() -> None:
    bench = Bench("B", address=4)
    bench.do("v500")
    bench.file("+1", "f640", "r", "w1000", "u4")
    bench.run(1.0)
    bench.pin(RST=1)
    bench.pin(RST=0)
    assert bench.finish() == b"\x02"
    assert (bench.chip.drive.velocity, bench.counter) == (500, 1280)


def test_rst_stops_the_motor_at_once() -> None:
    bench = Bench("B", address=4)
    bench.file("f640000", "r")
    bench.run(1.0)
    at = bench.true
    bench.pin(RST=1)
    assert bench.true == at
    assert not bench.chip.drive.is_valid
    assert bench.sum_of_pulses() == at


def test_rst_reads_the_address() -> None:
    bench = Bench("B", address=4)
    bench.pin(ADDR0=1)
    assert bench.chip.address == 4
    bench.pin(RST=1)
    assert bench.chip.address == 5


def test_rst_drops_a_file_that_is_arriving() -> None:
    bench = Bench("B", address=4)
    bench.send("[", "u20")
    bench.pin(RST=1)
    assert bench.send("u15", "]") == b"\x02"
    assert bench.finish() == b""


# ---------------------------------------------------------------------- EEPROM


def test_an_e_type_runs_its_stored_file_at_power_up() -> None:
    kept: list[bytes] = []
    bench = Bench("E1")
    bench.chip.store = kept.append
    bench.do("[", "@1", "u20", "w1000", "j1")
    bench.send("]")
    assert kept == [image("E1", "@1", "u20", "w1000", "j1")] == [bench.chip.image]
    again = Bench("E1", image=kept[0])
    assert again.run(2.5) == b"\x45" * 3
    again.chip.power_cycle(again.now)
    assert again.run(0.5) == b"\x45"


def test_m_37_commands_outside_a_file_are_not_kept() -> None:
    kept: list[bytes] = []
    bench = Bench("E1")
    bench.chip.store = kept.append
    bench.do("u20")
    bench.do("[", "u20", "w1000", "]")
    bench.do("u20", "v2000")
    assert kept == [image("E1", "u20", "w1000")] == [bench.chip.image]


def test_power_off_loses_a_program_in_ram() -> None:
    bench = Bench("B")
    bench.file("@1", "u20", "w1000", "j1")
    bench.run(0.5)
    bench.sent()
    bench.chip.power_cycle(bench.now)
    assert bench.finish() == b""


def test_what_ends_a_program_ends_its_wait() -> None:
    for end in ("\\", "f0"):
        bench = Bench("B", address=4)
        bench.file("w10000")
        bench.run(1.0)
        assert bench.send(end, "u20") + bench.run(ms=1) == b"\x42"
    bench = Bench("B", address=4)
    bench.file("u20", "w10000")
    bench.run(1.0)
    bench.pin(RST=1)
    assert bench.sent() == b"\x42"


def test_m_30_with_all_address_pins_low_the_stored_file_stays_and_does_not_run() -> None:
    bench = Bench("E1", address=0, image=image("E1", "u20"))
    assert bench.finish() == b""
    bench.pin(RST=1)
    assert bench.finish() == b""
    bench.pin(RST=0)
    bench.pin(ADDR0=1, RST=1)
    assert bench.finish() == b"\x45"


def test_a_reset_erases_the_stored_file() -> None:
    kept: list[bytes] = []
    bench = Bench("E1", image=image("E1", "u20"))
    bench.chip.store = kept.append
    assert bench.finish() == b"\x45"
    bench.do("\\")
    assert kept == [b""]
    bench.chip.power_cycle(bench.now)
    assert bench.finish() == b""


def test_commands_outside_brackets_are_not_kept() -> None:
    bench = Bench("E1", image=image("E1", "u20"))
    bench.finish()
    bench.do("u15", "u16")
    bench.chip.power_cycle(bench.now)
    assert bench.finish() == b"\x45"


def test_a_file_is_kept_only_when_it_is_whole() -> None:
    bench = Bench("E1", image=image("E1", "u20"))
    bench.finish()
    bench.do("[", "u15", "u16")
    bench.chip.power_cycle(bench.now)
    assert bench.finish() == b"\x45"


def test_an_eeprom_that_cannot_be_kept_is_told() -> None:
    bench = Bench("E1")

    def fail(_image: bytes) -> None:
        raise OSError("no space left")

    bench.chip.store = fail
    assert bench.do("[", "u20", "]") == b"\x45"
    assert bench.events("store-failed")[0].text == "the EEPROM could not be kept: no space left"


def test_a_chip_with_ram_can_be_switched_on_with_a_program() -> None:
    bench = Bench("A", image=image("A", "[", "u20", "]"))
    assert bench.finish() == b"\x41"


def test_an_image_for_another_type_runs_up_to_what_this_one_does_not_have() -> None:
    """Labels go up to 15 on an A, and to 80 on a B."""
    bench = Bench("A", image=image("B", "u4", "j20", "u4"))
    assert bench.finish() == b"\0"
    assert bench.wrong == ["wrong data: J20 is out of range: permitted is 1 to 15; the program stops"]


# ---------------------------------------------------------------------- shutdown


@pytest.mark.parametrize("outputs", [False, True])
def test_m_31_shutdown_keeps_the_memory_and_ends_with_rst(outputs: bool) -> None:
    bench = Bench("B", address=4)
    if outputs:
        bench.do("t45")
    bench.file("+1", "c2", "w1000", "u4")
    bench.run(0.5)
    bench.pin(SD=0)
    assert [bench.level(f"B{line}") for line in (1, 2, 3)] == ([1, 0, 1] if outputs else [0, 0, 0])
    assert bench.send("u20") == b""
    assert bench.run(10.0) == b""
    bench.pin(SD=1, ADDR0=1)
    assert bench.run(10.0) == b""
    bench.pin(RST=1)
    bench.chip.advance(bench.now + SHUTDOWN_RESET_NS - 1)
    assert bench.chip.is_shut_down
    bench.run(ms=1)
    assert not bench.chip.is_shut_down
    assert bench.chip.address == 4
    assert bench.level("B1") == 1
    assert bench.finish() == b"\x02"


def test_rst_that_is_too_short_or_with_sd_low_does_not_end_shutdown() -> None:
    bench = Bench("B")
    bench.pin(SD=0)
    bench.pin(RST=1)
    bench.run(ms=20)
    assert bench.chip.is_shut_down
    bench.pin(RST=0)
    bench.pin(SD=1, RST=1)
    bench.run(ms=9)
    bench.pin(RST=0)
    bench.run(1.0)
    assert bench.chip.is_shut_down


def test_rst_that_was_high_before_does_not_end_shutdown() -> None:
    """It is to be held high for 10 ms from then on (chapter VI, SD)."""
    bench = Bench("B", address=3)
    bench.pin(RST=1)
    bench.run(1)
    bench.pin(SD=0)
    bench.pin(SD=1)
    bench.run(1)
    assert bench.chip.is_shut_down
    bench.pin(RST=0)
    bench.pin(RST=1)
    bench.run(ms=10)
    assert not bench.chip.is_shut_down


def test_the_baud_rate_is_read_when_shutdown_ends() -> None:
    """Chapter II, Serial interface: 00 300, 01 1200, 10 2400, 11 4800."""
    bench = Bench("B", address=3, baud=4800)
    bench.pin(SD=0)
    bench.pin(BR0=0)
    bench.pin(SD=1, RST=1)
    assert bench.chip.uart.baud == 4800
    bench.run(ms=10)
    assert bench.chip.uart.baud == 2400


def test_a_program_that_has_been_overwritten_does_not_begin_again() -> None:
    """M-23, M-12: the memory of an A holds 54 commands of 16 bits."""
    bench = Bench("A", address=3)
    bench.do(*["u20"] * 54)
    bench.pin(RST=1)
    assert bench.finish() == b"\x41" * 54
    bench.pin(RST=0)
    bench.do("u20")
    bench.pin(RST=1)
    assert bench.finish() == b""


def test_shutdown_stops_the_motor() -> None:
    bench = Bench("B")
    bench.file("f640000", "r")
    bench.run(1.0)
    bench.pin(SD=0)
    at = bench.true
    assert bench.run(1.0) == b""
    assert bench.true == at
    assert not bench.chip.motor.drive.is_energised
    bench.pin(SD=1, RST=1)
    bench.run(ms=10)
    assert bench.chip.motor.drive.is_energised
    assert [event.text for event in bench.events("shutdown")] == ["shutdown"]


def test_a_wait_is_an_event() -> None:
    bench = Bench("B")
    bench.do("w15")
    assert [event.text for event in bench.events("wait")] == ["waits 15 ms"]


def test_rst_with_all_address_pins_low_stops_the_motor_at_once() -> None:
    bench = Bench("B", address=0)
    bench.file("f640000", "r")
    bench.run(1.0)
    at = bench.true
    assert at > 0
    bench.pin(RST=0)
    bench.pin(RST=1)
    assert len(bench.events("stands")) == 1
    bench.run(1.0)
    assert bench.true == at
    assert bench.counter == 0


def test_power_off_releases_the_outputs_and_is_silent() -> None:
    bench = Bench("B")
    bench.do("c2")
    assert bench.level("B2") == 0
    bench.chip.power_off(bench.now)
    assert bench.level("B2") == 1
    assert bench.do("u20") == b""
    bench.chip.power_cycle(bench.now)
    assert bench.do("u20") == b"\x42"


def test_e_types_have_no_shutdown() -> None:
    bench = Bench("E1")
    bench.pin(SD=0)
    assert bench.do("u20") == b"\x45"


# ---------------------------------------------------------------------- line timing and baud


@pytest.mark.parametrize(("br1", "br0", "baud"), [(0, 0, 300), (0, 1, 1200), (1, 0, 2400), (1, 1, 4800)])
def test_baud_rates_are_read_with_rst(br1: int, br0: int, baud: int) -> None:
    for kind, clock in (("B", 1), ("B2x", 2)):
        bench = Bench(kind)
        bench.pin(BR1=br1, BR0=br0)
        assert bench.chip.uart.baud == 4800 * clock
        bench.pin(RST=1)
        assert bench.chip.uart.baud == baud * clock
        assert M1486Chip(variant(kind), baud=baud * clock).uart.baud == baud * clock


def test_with_line_timing_characters_take_their_time() -> None:
    # 10 bits at 300 bit/s: 33.3 ms each. Three in, CR ends the line at 133.3 ms; the answer takes as long.
    bench = Bench("B", baud=300, is_timed=True)
    bench.send("u20")
    bench.finish()
    assert bench.events("upload")[0].time == -(-4 * 10 * SECOND // 300)
    bench = Bench("B", baud=300, is_timed=True)
    bench.chip.receive(b"u20\ru15\r", 0)
    assert bench.chip.to_send(166_666_667) == []
    assert bench.chip.to_send(166_666_668) == [(166_666_668, b"\x42")]
    assert bench.chip.to_send(10**9) == [(300_000_001, b"\x02")]


@given(st.lists(st.integers(1, 7), max_size=12), st.booleans())
def test_it_does_not_matter_in_which_pieces_characters_come(cuts: list[int], is_timed: bool) -> None:
    text = b"t57\r[\r:5\rl3\r+7\ru4\re\r]\ru20\rf640\rr\ru1\rk\r"
    whole, pieces = (Bench("A", is_timed=is_timed) for _ in range(2))
    whole.chip.receive(text, 0)
    at = 0
    for cut in cuts:
        pieces.chip.receive(text[at : at + cut], 0)
        at += cut
    pieces.chip.receive(text[at:], 0)
    assert whole.finish() == pieces.finish()
    assert list(whole.chip.events) == list(pieces.chip.events)


# ---------------------------------------------------------------------- misuse


def test_what_a_chip_cannot_be() -> None:
    with pytest.raises(Misuse, match="address 16: four pins give 0 to 15"):
        M1486Chip(address=16)
    with pytest.raises(Misuse, match="9600 bit/s: M1486A has 300, 1200, 2400, 4800"):
        M1486Chip(baud=9600)
    with pytest.raises(Misuse, match="statement_ns = -1: must not be negative"):
        M1486Chip(statement_ns=-1)
    with pytest.raises(Misuse, match="not the stored file of an M1486"):
        M1486Chip(variant("E1"), image=b"abc")
    with pytest.raises(Misuse, match=r"the snapshot is of M1486B .* M1486A"):
        M1486Chip(variant("A")).restore(M1486Chip(variant("B")).snapshot())
    snapshot = M1486Chip().snapshot()
    with pytest.raises(Misuse):
        M1486Chip(is_timed=True).restore(snapshot)
    M1486Chip().restore(replace(snapshot))


@pytest.mark.parametrize("off", [True, False])
def test_what_is_due_happens_before_the_power_goes(off: bool) -> None:
    """Whether somebody looked before or not: a move of 40 ms, and a character that is on its way."""
    found = []
    for looks in (False, True):
        bench = Bench("B", is_timed=True, baud=4800)
        bench.do("f640")
        bench.send("r", "u20")
        end = bench.now + SECOND // 20
        if looks:
            bench.chip.advance(end)
        if off:
            bench.chip.power_off(end)
        else:
            bench.chip.power_cycle(end)
        found.append((bench.chip.now, bench.true, [event.text for event in bench.chip.events], bench.chip.to_send(end)))
    assert found[0] == found[1]
    assert found[0][1] == 640


@pytest.mark.parametrize(("driver", "levels"), [(STEP_DIRECTION, (0, 1)), (DUAL_DAC, (1, 0)), (TWO_DACS, (1, 1))])
def test_a_driver_interface_is_tied_by_its_pins(driver: Interface, levels: tuple[int, int]) -> None:
    """Chapter II: S&D low chooses Step & Direction, else DUAL low the DUAL DAC; read again when RST goes high."""
    bench = Bench("B", interface=driver)
    assert (bench.level("S&D"), bench.level("DUAL")) == levels
    for level in (1, 0):
        bench.pin(RST=level)
        bench.run(ms=20)
    assert bench.chip.interface is driver
