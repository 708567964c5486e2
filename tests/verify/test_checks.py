"""The checks against twins in virtual time: every one confirms; a controller with another behaviour is refuted."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import LineFailure
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.commands import LETTERS
from steptwin.m1486.line import SerialChain
from steptwin.m1486.variants import VARIANTS, variant
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXES, register_map
from steptwin.verify import unchecked
from steptwin.verify.check import CheckNeed, CheckOutcome, CheckResult, NotRestored
from steptwin.verify.kind import ReadyChecks
from steptwin.verify.m1486 import CHECKS as OF_M1486
from steptwin.verify.m1486 import ChipTalk
from steptwin.verify.mic488 import CHECKS as OF_MIC488
from steptwin.verify.modbus import ModbusTalk
from steptwin.verify.run import _over
from steptwin.verify.running import check_all, complete
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort

ALL = frozenset(CheckNeed)
ROOT = Path(__file__).parents[2]
M1_ON = bytes.fromhex("05 07d0 ff00")


class Line:
    """A port of machines in virtual time, for what checks send."""

    def __init__(self, controller: Any, port: Any) -> None:
        self.controller = controller
        self.port = port
        self.now = SECOND
        self.sent: list[bytes] = []
        self.is_cut: Callable[[bytes], bool] = lambda data: False

    def carry(self, steps: Any) -> Any:
        try:
            send = next(steps)
            while True:
                send = steps.send(self._came(send))
        except StopIteration as done:
            return done.value

    def _came(self, send: Any) -> bytes:
        self._advance(0 if send.at_once else 10)
        self.port.to_send(self.now)
        self.sent.append(send.data)
        if self.is_cut(send.data):
            raise LineFailure("the line was cut")
        received = self.port.exchange(send.data, self.now) if send.data else b""
        for _ in range(round(send.wait_s * 1000)):
            if received and send.is_whole(received):
                break
            self._advance(1)
            received += b"".join(data for _, data in self.port.to_send(self.now))
        return received

    def _advance(self, milliseconds: int) -> None:
        self.now += milliseconds * MILLISECOND
        self.controller.advance(self.now)


def mic(firmware: str, *, tcp: bool = False, lenient: bool = False) -> Line:
    device = Mic488Device(ControllerConfig(), firmware=firmware, lenient=lenient)
    device.advance(SECOND)
    return Line(device, TcpSlavePort({1: device}) if tcp else RtuSlavePort({1: device}))


def verified(line: Line, firmware: str, *, tcp: bool = False, permitted: frozenset[CheckNeed] = ALL) -> dict[str, CheckResult]:
    talk = ModbusTalk(1, register_map(firmware), framed=tcp, wait_s=0.05, axis=1, distance_u=2000.0)
    return {result.id: result for result in line.carry(check_all(talk, OF_MIC488, permitted))}


def state_of(device: Mic488Device) -> dict[str, bytes]:
    """All that can be read."""
    return {
        "control": device.execute(bytes.fromhex("03 2710 000e"), device.now),
        "values": device.execute(bytes.fromhex("03 2724 0048"), device.now),
        "user": device.execute(bytes.fromhex("03 0000 007d"), device.now),
        "outputs": device.execute(bytes.fromhex("01 1770 0008"), device.now),
    }


def ids(results: dict[str, CheckResult], outcome: CheckOutcome) -> set[str]:
    return {id_ for id_, result in results.items() if result.outcome is outcome}


def test_each_interpretation_is_checked_or_has_a_reason() -> None:
    listed = re.findall(r"^\| ((?:MIC|WBC|M)-\d+) \|", (ROOT / "docs/assumptions.md").read_text("utf-8"), re.MULTILINE)
    checked = [check.id for check in (*OF_MIC488, *OF_M1486)]
    assert sorted([*checked, *unchecked.OF_MIC488, *unchecked.OF_M1486]) == sorted(listed)
    assert all((unchecked.OF_MIC488 | unchecked.OF_M1486).values())


@pytest.mark.parametrize("tcp", [False, True])
@pytest.mark.parametrize("firmware", ["1.23", "1.40", "1.70"])
def test_a_twin_confirms_every_check(firmware: str, tcp: bool) -> None:
    line = mic(firmware, tcp=tcp)
    results = verified(line, firmware, tcp=tcp)
    assert ids(results, CheckOutcome.REFUTED) == set()
    other_line = {"MIC-2", "MIC-15"} if tcp else {"MIC-23"}
    assert ids(results, CheckOutcome.NOT_CHECKED) == {*other_line, "MIC-10"}  # M1 is off
    line.controller.execute(M1_ON, line.now)
    results = verified(line, firmware, tcp=tcp)
    assert ids(results, CheckOutcome.REFUTED) == set()
    assert ids(results, CheckOutcome.NOT_CHECKED) == {*other_line, "MIC-8"}
    assert [p.what for p in results["MIC-10"].probes][-1] == "position after the return"


@pytest.mark.parametrize("firmware", ["1.23", "1.70"])
def test_without_permission_nothing_is_changed(firmware: str) -> None:
    line = mic(firmware)
    before = state_of(line.controller)
    results = verified(line, firmware, permitted=frozenset({CheckNeed.READ}))
    assert state_of(line.controller) == before
    not_permitted = {check.id for check in OF_MIC488 if check.need is not CheckNeed.READ}
    assert ids(results, CheckOutcome.NOT_CHECKED) == not_permitted | {"MIC-23"}
    assert "--write" in results["MIC-4"].why
    assert "--move" in results["MIC-8"].why


def test_what_was_written_is_put_back() -> None:
    line = mic("1.70")
    before = state_of(line.controller)
    verified(line, "1.70", permitted=frozenset({CheckNeed.READ, CheckNeed.WRITE}))
    assert state_of(line.controller) == before


@pytest.mark.parametrize(("gear", "acc", "vel"), [(100.0, 50.0, 40.0), (0.37, 10_000.0, 3.0), (12_800.0, 0.5, 0.01)])
def test_parameters_are_compared_with_any_number_of_pulses_per_unit(gear: float, acc: float, vel: float) -> None:
    axis = AxisConfig(gear=gear, acc=acc, dec=acc, vel=vel)
    config = ControllerConfig(axes=(axis,) * AXES)
    device = Mic488Device(config, firmware="1.70")
    device.advance(SECOND)
    before = state_of(device)
    results = verified(Line(device, RtuSlavePort({1: device})), "1.70", permitted=frozenset({CheckNeed.READ, CheckNeed.WRITE}))
    assert {results[id_].outcome for id_ in ("MIC-17", "MIC-42")} == {CheckOutcome.CONFIRMED}
    assert state_of(device) == before


def test_a_lenient_controller_is_refuted() -> None:
    results = verified(mic("1.70", lenient=True), "1.70")
    assert ids(results, CheckOutcome.REFUTED) == {"MIC-1", "MIC-3"}
    (first, *_) = results["MIC-3"].probes
    assert (first.expected, first.came) == ("exception 02 (illegal data address)", "answer 03 02 00 00")


def test_another_generation_refutes_its_number_of_banks() -> None:
    results = verified(mic("1.40"), "1.70")
    assert ids(results, CheckOutcome.REFUTED) == {"MIC-28"}


def test_a_value_that_cannot_be_put_back_is_named() -> None:
    line = mic("1.70")
    begun = lambda data: b"\x06\x27\x10\x00\x02" in data  # noqa: E731  DATA_TYPE = 2
    line.is_cut = begun
    talk = ModbusTalk(1, register_map("1.70"), framed=False, wait_s=0.05)
    with pytest.raises(LineFailure):
        line.carry(check_all(talk, OF_MIC488, ALL))
    assert talk.probes.unrestored == {"DATA_TYPE": "DATA_TYPE (address 10000) = 0000 hex"}


def test_a_controller_that_keeps_a_bad_value_is_reported() -> None:
    class Stubborn:
        """Does not accept DATA_TYPE = 0 again."""

        def __init__(self, device: Mic488Device) -> None:
            self._device = device

        def execute(self, pdu: bytes, now: int) -> bytes:
            if pdu == bytes.fromhex("06 2710 0000") and self._device.data_type == 1:
                return pdu
            return self._device.execute(pdu, now)

    device = Mic488Device(ControllerConfig())
    device.advance(SECOND)
    line = Line(device, RtuSlavePort({1: Stubborn(device)}))
    with pytest.raises(NotRestored, match=r"DATA_TYPE \(address 10000\) = 0000 hex; write it again"):
        verified(line, "1.70")


def test_a_refused_half_that_changes_the_value_is_put_back_without_permission() -> None:
    class Whole:
        """Takes one word written to M1_ACC for its value, as for JOG_SPEED."""

        def __init__(self, device: Mic488Device) -> None:
            self._device = device

        def execute(self, pdu: bytes, now: int) -> bytes:
            if pdu.startswith(bytes.fromhex("06 2734")):
                self._device.execute(bytes.fromhex("10 2734 0002 04 0000 40a0"), now)  # 5.0
                return pdu
            return self._device.execute(pdu, now)

    device = Mic488Device(ControllerConfig())
    device.advance(SECOND)
    before = state_of(device)
    results = verified(Line(device, RtuSlavePort({1: Whole(device)})), "1.70", permitted=frozenset({CheckNeed.READ}))
    assert ids(results, CheckOutcome.REFUTED) == {"MIC-5"}
    assert state_of(device) == before


def test_a_lost_answer_does_not_leave_a_value_changed() -> None:
    line = mic("1.70")
    before = state_of(line.controller)
    exchange, to_send = line.port.exchange, line.port.to_send
    lost: list[bytes] = []

    def exchanged(data: bytes, now: int) -> bytes:
        received = exchange(data, now)
        if b"\x06\x27\x10\x00\x01" in b"".join(line.sent[-2:-1]) and not lost:  # DATA_TYPE = 1
            lost.append(received)
            return b""
        return received

    line.port = type("Lossy", (), {"exchange": lambda _, d, n: exchanged(d, n), "to_send": lambda _, n: to_send(n)})()
    assert ids(verified(line, "1.70"), CheckOutcome.REFUTED) == set()
    assert lost
    assert state_of(line.controller) == before


def test_a_silent_unit_is_a_failure() -> None:
    talk = ModbusTalk(2, register_map("1.70"), framed=False, wait_s=0.05)
    with pytest.raises(LineFailure, match="unit 2 does not respond"):
        mic("1.70").carry(check_all(talk, OF_MIC488, ALL))


def test_an_adapter_that_echoes() -> None:
    line = mic("1.70")
    exchange, to_send = line.port.exchange, line.port.to_send
    line.port = type("Echo", (), {"exchange": lambda _, d, now: d + exchange(d, now), "to_send": lambda _, now: to_send(now)})()
    assert ids(verified(line, "1.70"), CheckOutcome.REFUTED) == set()


def test_a_second_interrupt_names_what_is_not_put_back() -> None:
    line = mic("1.70")

    class Channel:
        """Interrupted while DATA_TYPE is another one."""

        def __init__(self) -> None:
            self.came = b""

        def write(self, data: bytes) -> None:
            self.came = line.port.exchange(data, line.now)
            if line.controller.data_type:
                raise KeyboardInterrupt

        def read(self, timeout_s: float) -> bytes:
            line._advance(10)
            came, self.came = self.came + b"".join(data for _, data in line.port.to_send(line.now)), b""
            return came

        def close(self) -> None: ...

    endpoint = type("Endpoint", (), {"open": lambda _: Channel()})()
    talk = ModbusTalk(1, register_map("1.70"), framed=False, wait_s=0.01)
    checks = [check for check in OF_MIC488 if check.id == "MIC-17"]
    with pytest.raises(NotRestored, match=r"interrupted; not put back: DATA_TYPE \(address 10000\) = 0000 hex"):
        _over(ReadyChecks(checks, talk, endpoint, dict), ALL, lambda *_: None, lambda: False)


# ---------------------------------------------------------------------- M1486


def chip(kind: str, address: int = 15, others: tuple[int, ...] = ()) -> Line:
    chips = [M1486Chip(variant(kind), address=one) for one in (address, *others)]
    chain = SerialChain(chips)
    for one in chips:
        one.advance(SECOND)

    class All:
        def advance(self, now: int) -> None:
            for one in chips:
                one.advance(now)

    return Line(All(), chain.port())


def checked(line: Line, expected: str, address: int | None = None) -> dict[str, CheckResult]:
    talk = ChipTalk(address, variant(expected), wait_s=0.05)
    return {result.id: result for result in line.carry(check_all(talk, OF_M1486, ALL))}


@pytest.mark.parametrize("kind", [one.name for one in VARIANTS])
def test_a_chip_confirms_every_check(kind: str) -> None:
    results = checked(chip(kind), kind)
    assert ids(results, CheckOutcome.CONFIRMED) == {check.id for check in OF_M1486}, results


def test_nothing_in_a_comment_is_a_command_of_a_chip_without_comments() -> None:
    line = chip("B")
    checked(line, "B")
    comments = {char for data in line.sent for char in data.partition(b";")[2].decode("ascii").upper()} - {"\r"}
    assert comments
    assert comments & LETTERS == set()


def test_one_chip_of_a_chain() -> None:
    results = checked(chip("B", 7, others=(3,)), "B", 7)
    assert ids(results, CheckOutcome.CONFIRMED) == {check.id for check in OF_M1486}


def test_a_chip_of_another_type_is_refuted() -> None:
    results = checked(chip("C"), "A")
    assert "M-15" in ids(results, CheckOutcome.REFUTED)
    assert [(p.expected, p.came) for p in results["M-15"].probes if not p.holds] == [("41H", "43H")]


@pytest.mark.parametrize("typed", [b"t41\r", b"t57\r", b"t41\rt57\r"])
def test_a_chip_that_echoes_or_reports(typed: bytes) -> None:
    line = chip("B")
    for byte in typed:
        line.port.exchange(bytes((byte,)), line.now)
        line._advance(10)
    results = checked(line, "B")
    assert ids(results, CheckOutcome.REFUTED) == set()
    assert ids(results, CheckOutcome.NOT_CHECKED) == {"M-36", "M-38", "M-43"}


def test_a_chip_that_waits_is_a_failure() -> None:
    line = chip("B")
    line.port.exchange(b"w60000\r", line.now)
    with pytest.raises(LineFailure, match="the chip does not respond"):
        checked(line, "B")


def test_a_cancelled_run_has_the_results_so_far() -> None:
    seen: list[str] = []
    steps = check_all(
        ChipTalk(None, variant("B"), wait_s=0.05),
        OF_M1486,
        ALL,
        progress=lambda id_, number, count: seen.append(id_),
        is_cancelled=lambda: len(seen) == 2,
    )
    assert [result.id for result in chip("B").carry(steps)] == seen == ["M-1", "M-2"]


def test_a_report_lists_all_ids_of_a_kind_in_order() -> None:
    found = [result.id for result in complete(list(checked(chip("A"), "A").values()), unchecked.OF_M1486)]
    assert found == [f"M-{number}" for number in range(1, 47)]
