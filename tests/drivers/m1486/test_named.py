"""Values of a chip as users name them, and programs from files. The chips live in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from chip_rig import KNOWN, ChipWire, chip_driver
from line_rig import at_every_address

from steptwin.drivers.kind import DeviceAddress, Progress, ReadValue, SentProgram
from steptwin.drivers.m1486.kind import M1486_DRIVER
from steptwin.drivers.m1486.sync import M1486
from steptwin.errors import Misuse

ADDRESS = DeviceAddress("memory", "m1486", 7, 4800, 1.0)
NOBODY = DeviceAddress("memory", "m1486", None, 4800, 1.0)
overview, followed, reading, writing = M1486_DRIVER.info, M1486_DRIVER.followed, M1486_DRIVER.reading, M1486_DRIVER.writing
NAMES = ("POSITION", "COUNTER", "VARIABLE", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES")


def send(address: DeviceAddress, text: str, progress: Progress, check: Callable[[], object]) -> SentProgram:
    return M1486_DRIVER.send(address, Path("p.m1486"), text, progress, check, None)


def ready(wire: ChipWire) -> M1486:
    chip = chip_driver(wire, 7)
    chip.configure(**KNOWN)
    return chip


def test_values_with_their_units() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    chip.set_flag(81, True)
    chip.set_flag(83, True)
    chip.set_variable(77)
    chip.move_to(3.0)
    chip.wait()
    found = reading([name.lower() for name in NAMES])(chip)
    assert list(found) == list(NAMES)
    assert found["POSITION"] == ReadValue(3.0, "step")
    assert found["COUNTER"] == ReadValue(192, "min. microsteps")
    assert found["VARIABLE"] == ReadValue(77)
    assert set(str(found["FLAGS"].value).split()) >= {"81", "83"}
    assert "82" not in str(found["FLAGS"].value).split()
    assert "41" in str(found["FUNCTIONS"].value).split()  # the driver needs the echo
    assert (found["TYPE"].value, found["INTERFACE"].value) == ("M1486B", "Step & Direction")
    assert list(reading(["flags"])(chip)) == ["FLAGS"]
    with pytest.raises(Misuse, match="'SPEED' is not a value of an M1486: permitted are POSITION, COUNTER, "):
        reading(["speed"])


def test_a_position_that_is_not_known_is_none() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    chip.move_by(5000.0)
    wire.sleep(0.5)
    chip.stop()
    assert reading(["POSITION"])(chip) == {"POSITION": ReadValue(None, "step")}


def test_points_of_a_twin() -> None:
    assert followed([], None) == ("counter", "velocity", "variable")
    assert followed(["variable", "counter"], "B") == ["variable", "counter"]
    assert followed(["variable", "flags"], None) is None
    assert M1486_DRIVER.usual == ("POSITION", "VARIABLE", "FLAGS")
    assert M1486_DRIVER.names() == NAMES


def test_an_overview() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    chip.set_position(2.5)
    found = overview(chip, ADDRESS)
    assert found.head[:2] == ("M1486B, chip 7 at memory", "position 2.5 step (160 min. microsteps)")
    assert "not read, because questions overwrite a program in the 2032 bits" in found.head[2]
    assert (found.data["device"], found.data["chip"], found.data["position"], found.data["variable"]) == ("memory", 7, 2.5, None)
    stored = overview(chip_driver(ChipWire("E1")), ADDRESS)
    assert stored.head[0] == "M1486E1 at memory, Step & Direction, series 1"
    assert stored.head[2].startswith("internal variable 0; flags ON: ")


SWITCHES = [("on", True), ("TRUE", True), ("1", True), ("off", False), ("false", False), ("0", False)]


@pytest.mark.parametrize(("text", "on"), SWITCHES)
def test_switches(text: str, on: bool) -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    chip.set_output(6, not on)
    chip.set_flag(82, not on)
    chip.set_function(42, not on)
    assert writing([f"B6={text}", f"flag82={text}", f"F42={text}"])(chip) == {}
    wire.sleep(0.1)
    assert bool(wire.chip.pins()["B6"]) == on
    assert (chip.flags()[82], chip.functions()[42]) == (on, on)


def test_numbers() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    settings = ["S=300", "A=6000", "V=1000", "P=20000", "M=8", "Q=2", "N=3"]
    writing(["POSITION=1,5", "variable=300", *settings])(chip)
    drive = wire.chip.drive
    assert (chip.position(), chip.variable()) == (1.5, 300)
    assert (drive.start_stop, drive.acceleration, drive.velocity, drive.profile_speed) == (300, 6000, 1000, 20000)
    assert (drive.microstep, drive.qualification) == (8, 2)
    assert chip.settings.waveform == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("V=1.5", "'V=1.5': V takes whole numbers"),
        ("VARIABLE=0.5", "VARIABLE takes whole numbers"),
        ("V=inf", "'V=inf': 'inf' is not a number"),
        ("VARIABLE=nan", "'VARIABLE=nan': 'nan' is not a number"),
        ("V=x", "'V=x': 'x' is not a number"),
        ("B6=maybe", "'B6=maybe': expected on or off"),
        ("X=1", r"'X=1': X cannot be set: permitted are POSITION, VARIABLE, B1…B21"),
        ("FLAGX=1", "FLAGX cannot be set"),
        ("B6", "'B6': expected NAME=VALUE, such as VARIABLE=7 or B6=off"),
    ],
)
def test_changes_that_cannot_be_made(change: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        writing(["VARIABLE=7", change])


def test_nothing_is_sent_of_changes_one_of_which_cannot_be_made() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    before = len(wire.sent)
    for change in ("V=20001", "VARIABLE=16777216", "Q=3"):
        with pytest.raises(Misuse, match="takes"):
            writing(["B6=off", change])(chip)
    for change in ("B22=on", "FLAG87=on", "F64=on"):
        with pytest.raises(Misuse, match=f"'{change}': permitted are "):
            writing(["B6=off", change])
    assert len(wire.sent) == before


def test_m_and_q_change_together() -> None:
    """M4 goes with Q4 and M8 with Q2, but neither M8 with Q4 nor M4 with Q2."""
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    writing(["Q=4"])(chip)
    writing(["M=8", "Q=2"])(chip)
    assert (wire.chip.drive.microstep, wire.chip.drive.qualification) == (8, 2)
    with pytest.raises(Misuse, match="M8 does not permit Q4"):
        writing(["B6=off", "Q=4"])(chip)
    assert wire.chip.pins()["B6"] == 1


# ---------------------------------------------------------------------- programs


@pytest.mark.parametrize(
    ("text", "started", "told"),
    [
        ("[\n@1\nF64\nR\nJ1\n]\n", True, "p.m1486 is in the M1486B and was started by its ]: the motor may move"),
        ("F64\nR\n", True, "p.m1486 is in the M1486B and its commands were executed while it was sent"),
        ("V500\n", False, "p.m1486 is in the M1486B"),
    ],
)
def test_a_program_into_the_chip_that_is_addressed(
    monkeypatch: pytest.MonkeyPatch, text: str, *, started: bool, told: str
) -> None:
    wire = ChipWire(addresses=(7,))
    at_every_address(monkeypatch, wire)
    checks: list[int] = []
    done: list[tuple[int, int]] = []
    sent = send(ADDRESS, text, lambda there, whole: done.append((there, whole)), lambda: checks.append(1))
    assert sent.data == {"file": "p.m1486", "type": "M1486B", "chips": ["7"], "started": started, "uploaded": ""}
    assert sent.text.startswith(told)
    assert started or sent.text == told
    assert checks == [1]
    assert done[-1][0] == done[-1][1] > 0


def test_a_program_into_the_chips_it_selects(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(2, 10))
    at_every_address(monkeypatch, wire)
    text = "X2\nV500\nXA\nV600\nU20\n"
    sent = send(NOBODY, text, lambda *step: None, lambda: None)
    assert (sent.data["chips"], sent.data["started"], sent.data["uploaded"]) == (["2", "A"], False, "42")
    assert sent.text == "p.m1486 is in chips 2, A (M1486B); it uploaded 42"
    assert [chip.drive.velocity for chip in wire.chips.values()] == [500, 600]


def test_commands_before_the_first_x_need_a_chip() -> None:
    message = r"p\.m1486 was not sent: the commands before its first X need a chip: --device ADDRESS,chip=N"
    with pytest.raises(Misuse, match=message):
        send(NOBODY, "V500\nX2\nV600\n", lambda *step: None, lambda: None)


def test_commands_before_the_first_x_are_for_the_chip_that_is_addressed(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(7, 10))
    at_every_address(monkeypatch, wire)
    sent = send(ADDRESS, "V500\nXA\nV600\n", lambda *step: None, lambda: None)
    assert sent.data["chips"] == ["7", "A"]
    assert [chip.drive.velocity for chip in wire.chips.values()] == [500, 600]


def test_a_wrong_program_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(7,))
    at_every_address(monkeypatch, wire)
    with pytest.raises(Misuse, match=r"p\.m1486"):
        send(ADDRESS, "V99999999\n", lambda *step: None, lambda: None)
