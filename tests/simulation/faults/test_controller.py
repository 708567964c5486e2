"""Faults of physics, as they show in motion, at inputs and in memory."""

from __future__ import annotations

import struct
from array import array

import pytest
from fault_rig import ANSWER, READ, FaultRig, rtu
from toy import Bare, ToyBody

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.core import ANALOG_PINS, INPUT_PINS
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.faults import Faults, FaultyController, prepare_for_faults, read
from steptwin.simulation.kinds.mic488.faults import Mic488Body
from steptwin.simulation.logic.contacts import PositionSwitch, place
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do

SAVE, LOAD, ZERO = (bytes((5, 0x08, n, 0xFF, 0x00)) for n in (0x35, 0x34, 0x36))
"""USER_REG_SAVE 2101, USER_REG_READ 2100, USER_REG_ZERO 2102."""
ENABLE = bytes.fromhex("05 07 D0 FF 00")
STORED = 1000
"""First of the stored user registers."""


def axis(**others: object) -> ControllerConfig:
    """One axis with an encoder of 4 counts per pulse."""
    first = AxisConfig(enc_resol=4, mot_resol=1, **others)  # type: ignore[arg-type]
    return ControllerConfig(axes=(first, AxisConfig(), AxisConfig(), AxisConfig()))


def real(address: int, value: float) -> bytes:
    """Write a REAL: function 16, low word first."""
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return struct.pack(">BHHBHH", 16, address, 2, 4, low, high)


VEL_ABS, POS_ABS = 10068, 10084


def moving(*faults: str, **others: object) -> FaultRig:
    """Axis 1 on its way at 100 imp/s (VEL_ABS)."""
    rig = FaultRig(*faults, config=axis(**others))
    rig.ask(ENABLE, ms=0)
    rig.ask(real(VEL_ABS, 100.0), ms=0)
    return rig


def counts(rig: FaultRig) -> tuple[int, int]:
    """Pulses given and counts of the encoder."""
    first = rig.device.axes[0]
    rig.device.advance(rig.now)
    return first.profile.count(rig.now), first.encoder_counts(rig.now)


def test_stall_holds_the_shaft_while_pulses_go_on() -> None:
    rig = moving("stall at_s=1 for_s=0.5")
    rig.wait(1.0)
    pulses, encoder = counts(rig)
    assert encoder == 4 * pulses
    rig.wait(0.4)
    assert counts(rig) == (pytest.approx(pulses + 40, abs=1), encoder)
    rig.wait(0.6)
    assert counts(rig) == (pytest.approx(pulses + 100, abs=1), pytest.approx(encoder + 4 * 50, abs=4))
    assert rig.told() == ["stall: M1 is blocked for 0.5 s"]


def test_stalls_that_overlap_hold_until_the_last_lets_go() -> None:
    rig = moving("stall at_s=1 for_s=2", "stall at_s=2 for_s=2")
    rig.wait(1.0)
    _, encoder = counts(rig)
    rig.wait(2.9)
    assert counts(rig)[1] == encoder
    rig.wait(1.1)
    assert counts(rig)[1] == pytest.approx(encoder + 4 * 100, abs=4)


def test_a_stall_that_is_removed_lets_go() -> None:
    rig = moving("stall for_s=100")
    rig.wait(1.0)
    rig.faults.clear(rig.now)
    before = counts(rig)
    rig.wait(1.0)
    assert counts(rig) == (pytest.approx(before[0] + 100, abs=1), pytest.approx(before[1] + 400, abs=4))


def test_lost_steps_leave_the_shaft_behind() -> None:
    rig = moving("lost-steps at_s=0.5 pulses=7 period_s=1 count=2")
    rig.wait(1.0)
    pulses, encoder = counts(rig)
    assert encoder == 4 * (pulses - 7)
    rig.wait(5.0)
    pulses, encoder = counts(rig)
    assert encoder == 4 * (pulses - 14)


def test_a_slip_that_comes_again_keeps_its_period() -> None:
    rig = FaultRig("slip counts=5 at_s=1 period_s=0.3 count=3", config=axis())
    seen = []
    for _ in range(30):
        rig.wait(0.1)
        seen.append(counts(rig)[1])
    assert seen == [0] * 9 + [5] * 3 + [10] * 3 + [15] * 15


def test_slip_turns_the_encoder_alone() -> None:
    rig = moving("slip at_s=0.5 counts=-3")
    rig.wait(1.0)
    pulses, encoder = counts(rig)
    assert encoder == 4 * pulses - 3


@pytest.mark.parametrize(("faults", "pulses"), [((), 1000), (("lost-steps at_s=0.5 pulses=50",), 1050)])
def test_position_control_makes_up_for_lost_steps(faults: tuple[str, ...], pulses: int) -> None:
    rig = FaultRig(*faults, config=axis(pos_ctrl_mode=1))
    rig.ask(ENABLE, ms=0)
    rig.ask(real(POS_ABS, 1000.0), ms=0)
    rig.wait(30.0)
    assert counts(rig) == (pytest.approx(pulses, abs=1), pytest.approx(4000, abs=4))
    assert rig.device.axes[0].status is AxisStatus.REACHED


@pytest.mark.parametrize("level", [0, 1])
def test_stuck_keeps_an_input_whatever_drives_it(level: int) -> None:
    rig = FaultRig(f"stuck pin=IN3 value={level} from_s=1 until_s=3")
    rig.pin("IN3", 1 - level)
    assert rig.level("IN3") == 1 - level
    rig.wait(1.0)
    assert rig.level("IN3") == level
    rig.pin("IN3", level)
    rig.pin("IN3", 1 - level)
    assert rig.level("IN3") == level
    rig.wait(1.999)
    assert rig.level("IN3") == level
    rig.wait(0.001)
    assert rig.level("IN3") == 1 - level
    assert rig.told() == [f"stuck: IN3 is stuck at {level}", "stuck: IN3 is free"]
    assert rig.levels("IN3") == [(SECOND, level), (3 * SECOND, 1 - level)]


def test_master_error_is_shown_as_m_status_3_and_goes_with_the_fault() -> None:
    def m_status(rig: FaultRig) -> int:
        return rig.ask(bytes.fromhex("03 27 19 00 01"))[4]

    rig = FaultRig("master-error from_s=1 until_s=3", "master-error from_s=2 name=other")
    shown = []
    for _ in range(4):
        shown.append(m_status(rig))
        rig.wait(1.0)
    assert shown == [0, 3, 3, 3]
    rig.scheduler.advance(rig.now)
    rig.faults.remove("other", rig.now)
    assert m_status(rig) == 0
    assert rig.told() == [
        "master-error: a slave of its Modbus master does not answer",
        "other: a slave of its Modbus master does not answer",
        "master-error: the slave of its Modbus master answers again",
    ]


def test_master_error_stays_when_the_controller_is_switched_off_and_on() -> None:
    rig = FaultRig("master-error")
    rig.wait(0.1)
    rig.device.power_cycle(rig.now)
    assert rig.ask(bytes.fromhex("03 27 19 00 01"))[4] == 3


def test_what_shows_no_master_error_says_so() -> None:
    scheduler, faults = Scheduler(), Faults()
    scheduler.add("old", Mic488Device(ControllerConfig(), "1.40"))
    prepare_for_faults(scheduler, "old", faults, Mic488Body(scheduler.controllers["old"], 1))  # type: ignore[arg-type]
    with pytest.raises(Misuse, match=r"fault master-error: 'old' has firmware 1\.40, which has no M_STATUS: 1\.70 has"):
        faults.add(read("master-error"))


def test_stuck_without_a_value_keeps_what_is_there() -> None:
    rig = FaultRig()
    rig.pin("AIN1", 4.5)
    (active,) = rig.add("stuck pin=ain1")
    rig.wait(0.1)
    rig.pin("AIN1", 7.0)
    assert rig.level("AIN1") == 4.5
    rig.faults.remove(active.name, rig.now)
    assert rig.level("AIN1") == 7.0


def test_an_axis_runs_over_a_limit_switch_that_is_stuck() -> None:
    """KR on IN1 at 200 imp stops the axis unless it is stuck open."""
    stops = []
    for faults in ((), ("stuck pin=IN1 value=0",)):
        rig = FaultRig(*faults, config=axis(limit_mode=3, in_kl=1, in_kr=0))
        place(rig.scheduler, PositionSwitch("1", 1, 200, None, PinName("1", "IN1")))
        rig.ask(ENABLE, ms=0)
        rig.ask(real(VEL_ABS, 100.0), ms=0)
        rig.wait(5.0)
        stops.append(counts(rig)[0])
    assert stops[0] == 200
    assert stops[1] > 400


def test_bounce_goes_to_and_fro_and_settles() -> None:
    rig = FaultRig("bounce pin=IN4 bounces=4 for_ms=6")
    rig.pin("IN4", 1)
    assert rig.level("IN4") == 1
    rig.wait(0.1)
    edges = rig.levels("IN4")
    assert [level for _, level in edges] == [0, 1] * 4
    moments = [moment for moment, _ in edges]
    assert moments == sorted(moments)
    assert moments[0] > 0
    assert moments[-1] == 6 * MILLISECOND
    assert rig.level("IN4") == 1
    rig.pin("IN4", 0)
    rig.wait(0.1)
    assert [level for _, level in rig.levels("IN4")[8:]] == [1, 0] * 4
    assert rig.level("IN4") == 0
    rig.pin("IN4", 0)
    rig.wait(0.1)
    assert len(rig.levels("IN4")) == 16


def test_bouncing_ends_where_the_switch_goes_back() -> None:
    rig = FaultRig("bounce pin=IN4 bounces=4 for_ms=6 nth=1")
    rig.pin("IN4", 1)
    rig.wait(0.001)
    rig.pin("IN4", 0)
    before = len(rig.levels("IN4"))
    rig.wait(0.1)
    assert len(rig.levels("IN4")) == before
    assert rig.level("IN4") == 0


def test_a_bouncing_that_is_removed_leaves_the_level_of_the_switch_and_the_other_bouncing() -> None:
    rig = FaultRig("bounce name=one pin=IN4 bounces=4 for_ms=6", "bounce pin=IN5 bounces=4 for_ms=6")
    rig.pin("IN4", 1)
    rig.pin("IN5", 1)
    rig.wait(0.001)
    rig.faults.remove("one", rig.now)
    before = len(rig.levels("IN4"))
    rig.wait(0.1)
    assert len(rig.levels("IN4")) == before
    assert [level for _, level in rig.levels("IN5")] == [0, 1] * 4


def test_an_input_that_sticks_does_not_bounce_any_more() -> None:
    rig = FaultRig("bounce pin=IN4 bounces=4 for_ms=6", "bounce pin=IN5 bounces=4 for_ms=6", "stuck pin=IN4 value=0 from_s=0.001")
    rig.pin("IN4", 1)
    rig.pin("IN5", 1)
    rig.wait(0.1)
    assert rig.level("IN4") == 0
    assert rig.levels("IN4")[-1][0] <= 1 * MILLISECOND
    assert [level for _, level in rig.levels("IN5")] == [0, 1] * 4


@pytest.mark.parametrize("faults", [("wear writes=0", "power-cut written=0"), ("power-cut written=0", "wear writes=0")])
def test_a_worn_memory_may_lose_its_supply(faults: tuple[str, str]) -> None:
    rig = FaultRig(*faults)
    before = stored(rig)
    fill(rig, 0x1111)
    assert rig.ask(SAVE) == b""
    assert stored(rig) == before
    assert rig.faults.acts["power-cut"].count == 1


def test_supply_drop_silences_everything_and_comes_back_as_after_power_on() -> None:
    rig = moving("supply-drop at_s=1 for_s=0.5")
    rig.wait(0.9)
    assert rig.ask() == ANSWER
    rig.wait(0.1)
    pulses = counts(rig)[0]
    assert rig.ask() == b""
    assert not rig.device.axes[0].enabled
    rig.wait(0.2)
    assert counts(rig)[0] == pulses
    assert rig.ask(bytes.fromhex("06 00 64 00 07")) == b""
    rig.wait(0.5)
    assert rig.ask() == rtu(1, bytes.fromhex("03 04 00 00 00 00"))
    assert not rig.device.axes[0].enabled


def test_supply_drops_that_overlap_end_with_the_last() -> None:
    rig = moving("supply-drop at_s=1 for_s=0.5 name=first", "supply-drop at_s=1.2 for_s=0.1 name=second")
    rig.wait(1.4)
    assert rig.ask() == b""
    rig.wait(0.2)
    assert rig.ask() != b""
    rig = moving("supply-drop at_s=1 for_s=0.2 name=first", "supply-drop at_s=1.1 for_s=0.5 name=second")
    rig.wait(1.5)
    assert rig.ask() == b""
    rig.wait(0.2)
    assert rig.ask() != b""


# ---------------------------------------------------------------------- memory


def stored(rig: FaultRig) -> bytes:
    return rig.device.memory


def fill(rig: FaultRig, word: int) -> None:
    stored_ = rig.device.firmware.stored_user_registers
    assert stored_ is not None
    for number in stored_:
        rig.device.user[number] = word


@pytest.mark.parametrize("written", [0, 1, 77, 10_000])
def test_power_cut_leaves_what_was_not_written_as_it_was(written: int) -> None:
    rig = FaultRig(f"power-cut nth=2 written={written} for_s=0.5")
    fill(rig, 0x1111)
    assert rig.ask(SAVE) == rtu(1, SAVE)
    fill(rig, 0x2222)
    assert rig.ask(SAVE) == b""
    assert rig.ask() == b""
    rig.wait(0.5)
    size = len(stored(rig))
    expected = (b"\x22" * min(written, size)).ljust(size, b"\x11")
    assert stored(rig) == expected
    assert rig.ask(LOAD) == rtu(1, LOAD)
    numbers = rig.device.firmware.stored_user_registers or range(0)
    assert b"".join(rig.device.user[n].to_bytes(2, "big") for n in numbers) == expected


def test_what_is_stored_outside_is_what_the_memory_has() -> None:
    scheduler, held, kept = Scheduler(), Faults(), list[bytes]()
    device = Mic488Device(ControllerConfig())
    device.store = kept.append
    scheduler.add("1", device)
    prepare_for_faults(scheduler, "1", held, Mic488Body(device, 1))
    held.add(read("power-cut written=3 nth=1"))
    device.user[:] = array("H", [0x5555] * len(device.user))
    device.save_memory()
    assert kept == [device.memory] == [b"\x55\x55\x55".ljust(len(device.memory), b"\0")]


def test_a_memory_may_be_worn_from_the_beginning() -> None:
    rig = FaultRig("wear writes=0")
    fill(rig, 0x1111)
    assert rig.ask(SAVE) == rtu(1, SAVE)
    assert [byte != 0x11 for byte in stored(rig)].count(True) == 1
    assert rig.told()[0].startswith("wear: after 1 saves byte")


def test_worn_bytes_keep_what_they_have() -> None:
    rig = FaultRig("wear writes=2")
    words = (0x1111, 0x2222, 0x3333, 0x4444)
    images = []
    for word in words:
        fill(rig, word)
        assert rig.ask(SAVE) == rtu(1, SAVE)
        images.append(stored(rig))
    wrong = [
        [place for place, byte in enumerate(image) if byte != word & 0xFF] for image, word in zip(images, words, strict=True)
    ]
    assert [len(places) for places in wrong] == [0, 0, 1, 2]
    assert rig.faults.acts["wear"].count == 2, "the first two saves go well"
    assert set(wrong[2]) < set(wrong[3])
    first = wrong[2][0]
    assert (images[2][first], images[3][first]) == (0x22, 0x22)
    assert rig.told()[0] == f"wear: after 3 saves byte {first} is worn out"


# ---------------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("stall axis=5", "fault stall: axis = 5: permitted are 1 to 4"),
        ("stuck pin=IN21", "fault stuck: pin = 'IN21': '1' has IN1,"),
        ("stuck pin=OUT1 value=0.5", "fault stuck: value = 0.5: an output is 0 or 1"),
        ("stuck pin=M1_EN", f"fault stuck: pin = 'M1_EN': '1' has {', '.join((*INPUT_PINS, *ANALOG_PINS))}, OUT1, "),
        ("bounce pin=OUT1", "fault bounce: pin = 'OUT1': '1' has IN1, "),
        ("stuck pin=IN1 value=0.5", "IN1 = 0.5: a digital input is 0 or 1"),
        ("stuck pin=IN1 machine=7", "fault stuck: machine = '7': there are 1"),
    ],
)
def test_what_a_controller_does_not_have_cannot_fail(fault: str, text: str) -> None:
    rig = FaultRig()
    with pytest.raises(Misuse) as refused:
        rig.add(fault)
    assert str(refused.value).startswith(text)
    assert rig.faults.active == ()
    assert rig.ask(READ) == ANSWER


def test_where_there_are_several_controllers_one_is_to_be_chosen() -> None:
    rig = FaultRig(units=(1, 2))
    with pytest.raises(Misuse, match="fault slip: choose a controller: there are 1, 2"):
        rig.add("slip")
    rig.add("slip machine=2 counts=5")
    rig.wait(0.1)
    assert [device.axes[0].encoder_counts(rig.now) for device in rig.devices.values()] == [0, 5]


def test_names_of_faults_tell_them_apart() -> None:
    rig = FaultRig("crc", "crc", "crc name=mine")
    assert [active.name for active in rig.faults.active] == ["crc", "crc-2", "mine"]
    with pytest.raises(Misuse, match="there is a fault 'mine' already"):
        rig.add("busy name=mine")
    with pytest.raises(Misuse, match="no fault 'yours': set are crc, crc-2, mine"):
        rig.faults.remove("yours", rig.now)


def test_state_of_physics_taken_out_and_put_back_changes_nothing() -> None:
    rig = moving(
        "bounce pin=IN4 for_ms=20", "stall at_s=1 for_s=0.5", "stuck pin=IN5 value=1 from_s=0.5 until_s=1.2", "slip period_s=0.3"
    )

    def go_on() -> list[object]:
        seen: list[object] = []
        for step in range(20):
            rig.wait(0.05)
            rig.pin("IN4", step // 3 % 2)
            seen += [counts(rig), rig.level("IN4"), rig.level("IN5")]
        return [*seen, rig.records[told:]]

    rig.wait(0.4)
    rig.pin("IN4", 1)
    rig.wait(0.7)
    rig.pin("IN4", 0)
    rig.wait(0.004)
    told = len(rig.records)
    scheduler, faults, now = rig.scheduler.snapshot(), rig.faults.copy_state(), rig.now
    first = go_on()
    rig.scheduler.restore(scheduler)
    rig.faults.set_state(faults)
    rig.now = now
    del rig.records[told:]
    assert go_on() == first


def test_a_controller_with_faults_is_switched_off_and_on() -> None:
    """EN and the outputs fall with the power (MIC-27); a pulse that nobody gives any more turns nothing."""
    rig = moving("stall at_s=100")
    controller = rig.scheduler.controllers["1"]
    rig.wait(1.0)
    assert controller.pins()["M1_EN"] == 1.0
    controller.power_off(rig.now)
    assert controller.pins()["M1_EN"] == 0.0
    before = counts(rig)
    rig.wait(1.0)
    assert counts(rig)[0] == before[0]
    assert rig.ask(ENABLE, ms=0) != ENABLE
    controller.power_cycle(rig.now)
    rig.wait(0.1)
    assert rig.device.axes[0].status is AxisStatus.OFF
    rig.ask(ENABLE, ms=0)
    assert controller.pins()["M1_EN"] == 1.0


def test_a_pin_of_a_fault_is_named_without_its_controller() -> None:
    with pytest.raises(Misuse, match=r"fault stuck: pin = '1\.IN4': name the controller as machine=NAME, and the pin alone"):
        FaultRig("stuck pin=1.IN4 value=1")


@pytest.mark.parametrize(
    ("kind", "line", "pin", "held", "free"), [("mic488", "modbus", "IN5", 1, 0), ("m1486", "m1486", "B3", 0, 1)]
)
def test_an_edge_that_a_fault_makes_is_recorded_once(kind: str, line: str, pin: str, held: int, free: int) -> None:
    """A chip reports the edges of its lines itself, too."""
    world = World.from_toml(f'[[line]]\nname = "l"\nkind = "{line}"\n[[{kind}]]\nname = "a"\nline = "l"\n')
    world.apply_input(do.SetFault(read(f"stuck machine=a pin={pin} value={held} from_s=0.5 until_s=1")))
    world.run(for_=2.0)
    edges = [(record.time, record.value) for record in world.trace.edges("a") if record.subject == pin]
    assert edges == [(SECOND // 2, held), (SECOND, free)]


class Heard(Bare):
    """Tells what it is asked for; it is due every 300 ms, but nothing that others could see changes."""

    __slots__ = ("asked",)

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[tuple[str, int]] = []

    def advance(self, now: Nanos) -> None:
        super().advance(now)
        self.asked.append(("advance", now // MILLISECOND))

    def advance_to_change(self, until: Nanos) -> Nanos:
        self.asked.append(("look", until))
        return until

    def deadline(self) -> Nanos:
        return self.now + 300 * MILLISECOND

    def power_off(self, now: Nanos) -> None:
        self.asked.append(("off", now // MILLISECOND))

    def power_cycle(self, now: Nanos) -> None:
        self.asked.append(("on", now // MILLISECOND))


def faulty(fault: str) -> tuple[Heard, FaultyController]:
    scheduler, faults, inner = Scheduler(), Faults(0), Heard()
    scheduler.add("a", inner)
    controller = prepare_for_faults(scheduler, "a", faults, ToyBody())
    faults.add(read(fault), 0)
    inner.asked.clear()
    return inner, controller


def test_a_controller_comes_to_the_moment_of_a_fault_before_the_fault_acts() -> None:
    inner, controller = faulty("supply-drop at_s=1 for_s=0.5")
    controller.advance(2 * SECOND)
    assert inner.asked == [("advance", 1000), ("off", 1000), ("advance", 1500), ("on", 1500), ("advance", 2000)]


def test_a_controller_looks_ahead_no_further_than_to_a_fault() -> None:
    inner, controller = faulty("supply-drop at_s=1 for_s=0.5")
    controller.advance(SECOND // 2)
    for until in (SECOND - 1, SECOND, 2 * SECOND):
        assert controller.advance_to_change(until) < SECOND
    assert all(moment < SECOND for what, moment in inner.asked if what == "look")
    controller.advance(SECOND - 1)
    assert controller.advance_to_change(2 * SECOND) == SECOND


def test_its_scheduler_is_told_when_the_supply_of_a_controller_fails() -> None:
    _, controller = faulty("supply-drop at_s=1 for_s=0.5")
    told: list[bool] = []
    controller.changed = lambda: told.append(True)
    for on in (False, True):
        controller.supply(on, 0)
    assert told == [True, True]


BLINKS = {
    "mic488": ("OUT1", "MAIN:\nOUT1 = ON\nDELAY 0.2\nOUT1 = OFF\nDELAY 0.2\nJUMP MAIN\n", "start = true"),
    "m1486": ("B2", "[\r@1\rc2\rw200\rt2\rw200\rj1\r]\r", ""),
}
BLINKING = """
[[{kind}]]
name = "a"
program = "p"
{more}
[[wire]]
from = "a.{pin}"
to = "b.IN7"
inverted = true
[[relay]]
name = "r"
coil = "a.{pin}"
pull_in = "1 ms"
drop_out = "1 ms"
[[mic488]]
name = "b"
"""


def blinking(kind: str, *faults: str) -> World:
    pin, program, more = BLINKS[kind]
    world = World.from_toml(BLINKING.format(kind=kind, pin=pin, more=more), {"p": program.encode()})
    for fault in faults:
        world.fault(fault)
    return world


def levels(world: World, subject: str) -> list[tuple[int, object]]:
    return [(record.time, record.value) for record in world.trace.edges() if record.subject == subject and record.time]


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("kind", BLINKS)
def test_an_output_that_is_stuck_is_seen_by_all_but_its_controller(kind: str, level: int) -> None:
    pin = BLINKS[kind][0]
    plain = blinking(kind)
    plain.run(until=3.0)
    free = levels(plain, pin)
    assert len(free) > 8
    begin, end = 1.05, 2.05
    world = blinking(kind, f"stuck machine=a pin={pin} value={level} from_s={begin} until_s={end}")
    world.run(until=3.0)

    def at(moment: float) -> object:
        return next((value for time, value in reversed(free) if time <= moment), None)

    expected = [one for one in free if not begin * SECOND <= one[0] <= end * SECOND]
    expected += [(round(moment * SECOND), value) for moment, value in ((begin, level), (end, at(end * SECOND)))]
    first = at(begin * SECOND)
    expected = sorted(one for one in expected if one != (round(begin * SECOND), first) and one != (round(end * SECOND), level))
    assert levels(world, pin) == expected
    assert [(time, value == 0) for time, value in levels(world, "IN7")] == [(time, value == 1) for time, value in expected]
    contacts = [(time - MILLISECOND, value) for time, value in levels(world, "r.no")]
    assert contacts == [one for one in expected if one[0] < 3 * SECOND - MILLISECOND]


@pytest.mark.parametrize(("kind", "moment_s"), [("mic488", 1.1), ("m1486", 1.3)])
def test_a_stuck_output_goes_on_alike_after_a_restore_and_ends_when_it_is_removed(kind: str, moment_s: float) -> None:
    pin = BLINKS[kind][0]
    fault = f"stuck machine=a pin={pin} value=1 from_s=0.5 until_s=1.7"
    world = blinking(kind, fault)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=3.0)
    other = blinking(kind)
    other.restore(snapshot)
    assert (other.read(f"a.{pin}"), other.read("r.coil")) == (1.0, 1.0)
    other.run(until=3.0)
    assert other.trace.digest() == world.trace.digest()
    other.restore(snapshot)
    other.clear_fault("stuck")
    plain = blinking(kind)
    plain.run(until=moment_s)
    assert other.read(f"a.{pin}") == plain.read(f"a.{pin}") == 0.0
    other.run(until=3.0)
    plain.run(until=3.0)
    assert levels(other, pin)[-8:] == levels(plain, pin)[-8:]


def test_a_controller_believes_that_its_stuck_output_is_on_and_others_see_that_it_is_off() -> None:
    world = blinking("mic488", "stuck machine=a pin=OUT1 value=0")
    world.run(until=0.1)
    assert world.mic488["a"].device.outputs[0]
    assert (world.read("a.OUT1"), world.read("r.coil"), world.read("b.IN7")) == (0.0, 0.0, 1.0)


def test_an_output_without_a_value_keeps_what_it_has_also_without_supply() -> None:
    world = blinking("mic488", "stuck machine=a pin=OUT1 from_s=0.1", "supply-drop machine=a at_s=0.3 for_s=0.2")
    world.run(until=2.0)
    assert levels(world, "OUT1") == [(levels(world, "OUT1")[0][0], 1.0)]
    assert world.read("r.no") == 1.0


def test_two_faults_hold_an_output_one_after_the_other() -> None:
    world = blinking(
        "mic488", "stuck machine=a pin=OUT1 value=1 name=one", "stuck machine=a pin=OUT1 value=0 name=two from_s=0.5"
    )
    world.run(until=1.0)
    assert levels(world, "OUT1") == [(SECOND // 2, 0.0)]


@pytest.mark.parametrize("pin", ["OUT1", "IN3"])
def test_of_several_stuck_faults_the_newest_that_lasts_decides(pin: str) -> None:
    world = World.from_toml('[[mic488]]\nname = "a"\n[[relay]]\nname = "r"\ncoil = "a.OUT1"\n')
    for name, level, begin, end in (("one", 1, 0.1, 0.5), ("two", 0, 0.2, 0.9), ("three", 1, 0.3, 0.4), ("four", 0, 0.8, 1.0)):
        world.fault(f"stuck machine=a pin={pin} value={level} from_s={begin} until_s={end} name={name}")
    if pin == "OUT1":
        world.mic488["a"].write("OUT1", 1)
    else:
        world.apply_input(do.Set((("a", pin, 1.0),)))
    seen = []
    for tenths in range(1, 11):
        world.run(until=tenths / 10 + 0.05)
        held = world.objects.faults.held("a").get(f"a.{pin}")
        seen.append((world.read(f"a.{pin}"), None if held is None else held.fault))
    by = ["one", "two", "three", "two", "two", "two", "two", "four", "four", None]
    assert seen == [(1.0 if name in ("one", "three", None) else 0.0, name) for name in by]
    assert [str(record.value) for record in world.trace if record.kind == "fault" and record.time >= SECOND // 2] == [
        f"it ends, but fault two keeps {pin} at 0",
        f"{pin} is stuck at 0",
        f"it ends, but fault four keeps {pin} at 0",
        f"{pin} is free",
    ]


def test_a_pin_stays_stuck_when_one_of_two_faults_is_removed() -> None:
    world = World.from_toml('[[mic488]]\nname = "a"\n')
    world.apply_input(do.Set((("a", "IN3", 1.0),)))
    world.fault("stuck machine=a pin=IN3 value=0 name=one")
    world.run(for_=0.1)
    world.fault("stuck machine=a pin=IN3 value=0 name=two")
    world.run(for_=0.1)
    snapshot = world.snapshot()
    for _ in range(2):
        world.clear_fault("two")
        world.run(for_=0.1)
        assert world.read("a.IN3") == 0.0
        world.clear_fault("one")
        assert world.read("a.IN3") == 1.0
        world.restore(snapshot)
