"""The rules of the motor record, from the documentation of epics-modules/motor, with a world in virtual time."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from motorrecord_rig import CHIP, ME, OTHER, TABLE, MotorRig, check

from steptwin.access.roles import Role
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.gateways.clients import NotPermitted
from steptwin.gateways.epics.motorfields import ProgressBit, StatusBit
from steptwin.gateways.epics.records import LOST, NO_ALARM, FieldValue
from steptwin.subject.commands import Enable, Move, StopAxes


def test_a_put_is_over_with_the_motion() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 30.0)
        assert rig.get("VAL", "DMOV", "MOVN") == [30.0, 0, 1]
        assert not put.done()
        await rig.over(put)
        assert rig.get("RBV", "DRBV", "RRBV", "RVAL", "DMOV", "MOVN", "MISS", "DIFF") == [30.0, 30.0, 3000, 3000, 1, 0, 0, 0.0]

    check(act)


def test_dmov_is_0_even_for_a_move_to_where_it_stands() -> None:
    async def act(rig: MotorRig) -> None:
        shown: list[FieldValue] = []
        show = rig.record.show

        async def watched(*arguments: object) -> None:
            shown.append(rig.record.value("DMOV"))
            await show()

        rig.record.show = watched  # type: ignore[method-assign]
        await rig.put("VAL", 0.0)
        assert shown[0] == 0
        assert shown[-1] == 1

    check(act)


@pytest.mark.parametrize(
    ("name", "value", "there"),
    [("DVAL", 12.0, 12.0), ("RVAL", 1500, 15.0), ("RLV", -4.0, 6.0), ("TWF", 1, 13.0), ("TWR", 1, 7.0)],
)
def test_other_fields_that_move(name: str, value: FieldValue, there: float) -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("VAL", 10.0)
        await rig.put("TWV", 3.0)
        await rig.put(name, value)
        assert rig.get("VAL", "RBV", "RLV", "TWF", "TWR") == [there, there, 0.0, 0, 0]

    check(act)


def test_a_new_target_during_a_move() -> None:
    async def act(rig: MotorRig) -> None:
        first = await rig.begin("VAL", 100.0)
        second = await rig.begin("VAL", 40.0, OTHER)
        assert not first.done()
        await rig.over(second)
        await rig.over(first)
        assert rig.get("VAL", "RBV") == [40.0, 40.0]

    check(act)


def test_stop_ends_the_put_and_val_follows() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 1000.0)
        await rig.put("STOP", 1)
        await rig.over(put)
        val, rbv, stop, done = rig.get("VAL", "RBV", "STOP", "DMOV")
        assert val == rbv
        assert 0.0 < float(rbv) < 1000.0
        assert (stop, done) == (0, 1)

    check(act)


# ---------------------------------------------------------------------- limits


def test_without_limits() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("HLM", 10.0)
        assert rig.get("DHLM", "DLLM", "LVIO") == [10.0, 0.0, 0]
        await rig.refused("VAL", 20.0, Misuse, r"20 mm: permitted are 0 to 10 mm \(LLM, HLM\)")
        assert rig.get("LVIO", "VAL", "RBV", "DMOV") == [1, 0.0, 0.0, 1]
        await rig.put("DHLM", 0.0)
        await rig.put("VAL", 20.0)
        assert rig.get("LVIO", "RBV") == [0, 20.0]

    check(act)


def test_limits_that_val_does_not_keep_any_more() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("VAL", 20.0)
        await rig.put("HLM", 10.0)
        assert rig.get("LVIO") == [1]

    check(act)


def test_limits_of_user_and_dial() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("DHLM", 30.0)
        await rig.put("DLLM", -10.0)
        await rig.put("DIR", 1)
        await rig.put("OFF", 5.0)
        assert rig.get("LLM", "HLM") == [-25.0, 15.0]
        await rig.put("HLM", 25.0)
        assert rig.get("DLLM", "DHLM") == [-20.0, 30.0]

    check(act)


def test_limit_switches() -> None:
    """HLS and LLS in user coordinates, RHLS and RLLS in those of the controller."""

    async def act(rig: MotorRig) -> None:
        await rig.refused("VAL", -50.0, Refusal, "the motion ended at")
        assert rig.get("RLLS", "RHLS", "LLS", "HLS", "MISS") == [1, 0, 1, 0, 1]
        val, rbv = rig.get("VAL", "RBV")
        assert val == rbv
        assert int(rig.get("MSTA")[0]) & (StatusBit.MINUS_LIMIT | StatusBit.PLUS_LIMIT) == StatusBit.MINUS_LIMIT
        await rig.put("DIR", 1)
        assert rig.get("RLLS", "RHLS", "LLS", "HLS") == [1, 0, 0, 1]
        await rig.put("DIR", 0)
        await rig.put("RLV", 10.0)
        assert rig.get("RLLS", "LLS", "HLS", "MISS") == [0, 0, 0, 0]
        await rig.refused("RLV", 100.0, Refusal, "the motion ended at")
        assert rig.get("RLLS", "RHLS", "LLS", "HLS") == [0, 1, 0, 1]

    check(act, TABLE)


# ---------------------------------------------------------------------- home and jog


@pytest.mark.parametrize("direction", [0, 1])
def test_home(direction: int) -> None:
    """HOMF and HOMR are in dial coordinates, whatever DIR is."""

    async def act(rig: MotorRig) -> None:
        await rig.put("DIR", direction)
        await rig.put("HVEL", 10.0)
        put = await rig.begin("HOMR", 1)
        assert rig.get("HOMR", "DMOV", "MOVN") == [1, 0, 1]
        await rig.refused("HOMR", 1, Refusal, "it is homing")
        await rig.over(put)
        assert rig.get("HOMR", "DMOV", "ATHM") == [0, 1, 1]
        val, rbv, dval, drbv = rig.get("VAL", "RBV", "DVAL", "DRBV")
        assert (val, dval) == (rbv, drbv)
        assert int(rig.get("MSTA")[0]) & StatusBit.HOMED
        assert -0.1 < float(rig.world.world.read("x.position")) <= 0.0 + 0.1
        await rig.put("RLV", 5.0 if direction == 0 else -5.0)
        assert rig.get("ATHM") == [0]

    check(act, TABLE)


def test_home_stopped_and_refused() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.refused("HOMF", 0, Misuse, "HOMF: 0: permitted is 1")
        put = await rig.begin("HOMF", 1)
        await rig.put("STOP", 1)
        await rig.over(put)
        assert rig.get("HOMF", "ATHM", "DMOV") == [0, 0, 1]

    check(act, TABLE)


def test_a_refused_move_leaves_everything() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("HVEL", 10.0)
        await rig.put("HOMR", 1)
        there = rig.get("VAL", "RBV")
        await rig.refused("VAL", 1e9, Misuse, "21474836")
        assert rig.get("ATHM", "DMOV") == [1, 1]
        assert rig.get("VAL", "RBV") == there

    check(act, TABLE)


@pytest.mark.parametrize(("name", "value", "there"), [("VAL", 3.0, 3.0), ("RLV", -7.0, 3.0), ("TWF", 1, 11.0)])
def test_set_changes_the_offset(name: str, value: FieldValue, there: float) -> None:
    """Of a record at 10 mm; nothing moves, and the limits of the user go with it."""

    async def act(rig: MotorRig) -> None:
        await rig.put("VAL", 10.0)
        await rig.put("DHLM", 50.0)
        await rig.put("SET", 1)
        await rig.put(name, value)
        assert rig.get("VAL", "RBV", "DVAL", "DRBV", "OFF", "DMOV") == [there, there, 10.0, 10.0, there - 10.0, 1]
        assert rig.get("HLM", "LLM") == [there + 40.0, there - 10.0]

    check(act)


def test_set_of_what_only_a_controller_could_do() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("SET", 1)
        for name in ("DVAL", "RVAL"):
            await rig.refused(name, 5, Refusal, "no command changes the position of the controller")
        await rig.put("FOFF", 1)
        await rig.refused("VAL", 5.0, Refusal, "no command changes the position of the controller")
        assert rig.get("VAL", "DVAL", "OFF") == [0.0, 0.0, 0.0]

    check(act)


def test_the_direction_keeps_val_unless_the_offset_is_frozen() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("VAL", 10.0)
        await rig.put("DIR", 1)
        assert rig.get("VAL", "RBV", "OFF", "DVAL") == [10.0, 10.0, 20.0, 10.0]
        await rig.put("FOFF", 1)
        await rig.put("DIR", 0)
        assert rig.get("VAL", "RBV", "OFF", "DVAL") == [30.0, 30.0, 20.0, 10.0]

    check(act)


# ---------------------------------------------------------------------- others


def test_a_viewer_stops_and_no_more() -> None:
    async def act(rig: MotorRig) -> None:
        rig.world.inner.do(Enable("table", 1))
        rig.world.inner.do(Move("table", 1, to=1000.0))
        await rig.tick()
        assert rig.get("DMOV") == [0]
        puts: Mapping[str, FieldValue] = {
            "VAL": 1.0,
            "TWF": 1,
            "JOGF": 1,
            "HOMF": 1,
            "CNEN": 0,
            "OFF": 1.0,
            "HLM": 1.0,
            "VELO": 1.0,
            "TWV": 2.0,
            "DIR": 1,
            "SET": 1,
        }
        before = dict(rig.record.values)
        for name, value in puts.items():
            await rig.refused(name, value, NotPermitted, "viewer")
        assert {name: rig.record.values[name] for name in puts} == {name: before[name] for name in puts} | {
            "VAL": rig.record.values["VAL"]
        }
        await rig.put("STOP", 1)
        await rig.stands()
        assert 0.0 < float(rig.get("RBV")[0]) < 1000.0

    check(act, role=Role.VIEWER)


def test_motions_of_others() -> None:
    async def act(rig: MotorRig) -> None:
        rig.world.inner.do(Move("table", 1, to=30.0))
        await rig.tick()
        assert rig.get("DMOV", "MOVN", "VAL") == [0, 1, 0.0]
        await rig.stands()
        assert rig.get("VAL", "RBV") == [30.0, 30.0]

    check(act)


def test_a_move_that_others_stop_fails() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 1000.0)
        rig.world.inner.do(StopAxes("table", 1))
        with pytest.raises(Refusal, match=r"the motion ended at .* mm, not at 1000 mm"):
            await rig.over(put)
        assert rig.get("MISS", "DMOV", "VAL") == [1, 1, 1000.0]
        await rig.put("SPMG", 0)
        val, rbv = rig.get("VAL", "RBV")
        assert val == rbv

    check(act)


def test_a_device_that_is_lost_during_a_move() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 1000.0)
        rig.world.silent.add("table")
        for _ in range(50):
            await rig.tick()
        assert (rig.record.alarm, rig.get("DMOV", "SEVR", "STAT")) == (LOST, [0, 3, 2])
        assert int(rig.get("MSTA")[0]) & StatusBit.COMM_ERROR
        assert not put.done()
        rig.world.inner.do(StopAxes("table", 1))
        for _ in range(50):
            await rig.tick()
        rig.world.silent.clear()
        with pytest.raises(Refusal, match="not at 1000 mm"):
            await rig.over(put)
        assert (rig.record.alarm, rig.get("DMOV", "MISS", "SEVR")) == (NO_ALARM, [1, 1, 0])
        assert not int(rig.get("MSTA")[0]) & StatusBit.COMM_ERROR

    check(act)


def test_velocity_and_acceleration_of_the_registers() -> None:
    async def act(rig: MotorRig) -> None:
        assert rig.get("VELO", "ACCL", "JVEL", "HVEL") == [50.0, 0.5, 50.0, 50.0]
        await rig.put("VELO", 20.0)
        assert rig.get("VELO", "ACCL", "JVEL", "HVEL") == [20.0, 0.5, 20.0, 20.0]
        await rig.put("ACCL", 2.0)
        points = ("table.M1_VMAX", "table.M1_ACC", "table.M1_DEC")
        assert [reading.value for reading in rig.world.read(*points)] == [20.0, 10.0, 10.0]
        await rig.refused("VELO", 0.0, Misuse, "permitted are numbers above 0")

    check(act)


def test_mip_and_tdir_say_what_is_done() -> None:
    async def act(rig: MotorRig) -> None:
        await rig.put("VAL", 1.0)
        assert rig.get("MIP", "TDIR") == [0, 1]
        put = await rig.begin("VAL", -30.0)
        for _ in range(5):
            await rig.tick()
        assert rig.get("MIP", "TDIR") == [ProgressBit.MOVE, 0]
        await rig.begin("SPMG", 1)
        assert rig.get("MIP") == [ProgressBit.STOP]
        await rig.put("SPMG", 3)
        assert rig.get("MIP") == [ProgressBit.MOVE]
        await rig.put("STOP", 1)
        await rig.over(put)
        assert rig.get("MIP") == [0]
        for button, bit in (("JOGF", ProgressBit.JOG_FORWARD), ("JOGR", ProgressBit.JOG_REVERSE)):
            jog = await rig.begin(button, 1)
            assert rig.get("MIP") == [bit]
            await rig.put(button, 0)
            await rig.over(jog)
        rig.world.inner.do(Move("table", 1, to=20.0))
        await rig.tick()
        assert rig.get("MIP") == [ProgressBit.EXTERNAL]
        await rig.stands()
        assert rig.get("MIP") == [0]

    check(act)


def test_what_reads_the_controller_anew_and_what_never_changes() -> None:
    async def act(rig: MotorRig) -> None:
        assert rig.get("NTM", "RTRY", "RCNT", "BDST", "FRAC", "DLY", "UEIP", "DISP", "SCAN") == [1, 0, 0, 0.0, 1.0, 0.0, 0, 0, 0]
        assert rig.get("UDF", "JAR") == [0, 100.0]
        await rig.put("ACCL", 1.0)
        assert rig.get("JAR") == [50.0]
        rig.world.inner.do(Enable("table", 1, on=False))
        assert rig.get("CNEN") == [1]
        await rig.record.put(ME, "STUP", 1)
        assert rig.get("CNEN", "STUP") == [0, 0]
        rig.world.inner.do(Enable("table", 1, on=True))
        await rig.record.put(ME, "PROC", 1)
        assert rig.get("CNEN") == [1]

    check(act)


def test_sync_gives_val_the_position() -> None:
    async def act(rig: MotorRig) -> None:
        put = await rig.begin("VAL", 1000.0)
        await rig.refused("SYNC", 1, Refusal, "it moves", OTHER)
        rig.world.inner.do(StopAxes("table", 1))
        with pytest.raises(Refusal, match="not at 1000 mm"):
            await rig.over(put)
        assert rig.get("VAL") == [1000.0]
        await rig.put("SYNC", 1)
        val, rbv, sync = rig.get("VAL", "RBV", "SYNC")
        assert (val, sync) == (rbv, 0)

    check(act)


def test_an_axis_of_an_m1486() -> None:
    """It tells no velocity, switches no drive and does not home."""

    async def act(rig: MotorRig) -> None:
        assert rig.get("VELO", "ACCL", "JVEL", "HVEL", "MRES", "EGU") == [0.0, 0.0, 0.0, 0.0, 1.0, "min. microsteps"]
        assert not int(rig.get("MSTA")[0]) & StatusBit.GAIN_SUPPORT
        await rig.refused("VELO", 5.0, Refusal, "no register has its velocity")
        await rig.refused("CNEN", 1, Refusal, "does not switch its drive")
        await rig.refused("JOGF", 1, Misuse, "JVEL is 0")
        await rig.put("HVEL", 100.0)
        await rig.refused("HOMF", 1, SteptwinError, "cannot do home")
        assert rig.get("HOMF", "DMOV") == [0, 1]
        await rig.refused("VAL", 5000.0, Refusal, "no multiple of 64")
        assert rig.get("VAL", "DMOV") == [0.0, 1]
        await rig.put("VAL", 6400.0)
        assert rig.get("RBV", "VAL", "DMOV", "MISS") == [6400.0, 6400.0, 1, 0]
        await rig.put("JVEL", 2000.0)
        jog = await rig.begin("JOGR", 1)
        await rig.until(lambda: float(rig.get("RBV")[0]) < 6000.0)
        await rig.put("JOGR", 0)
        await rig.over(jog)
        await rig.stands()
        val, rbv = rig.get("VAL", "RBV")
        assert val == rbv

    check(act, CHIP)


def test_commands_are_in_the_audit_log() -> None:
    async def act(rig: MotorRig) -> None:
        found: list[tuple[object, ...]] = []
        rig.world.audit = lambda who, do, fields, outcome: found.append((str(who), do, outcome))
        await rig.put("VAL", 5.0)
        await rig.refused("VAL", 1e9, Misuse, "permitted")
        jog = await rig.begin("JOGF", 1, OTHER)
        await rig.until(lambda: float(rig.get("RBV")[0]) > 60.0)
        await rig.put("JOGF", 0, OTHER)
        await rig.over(jog)
        me, other = "me@here (EPICS, 127.0.0.1:1)", "other@there (EPICS, 127.0.0.1:2)"
        assert found == [(me, "move", "done"), (me, "move", "misuse"), (other, "jog", "done")]

    check(act)


def test_velocities_stay_within_vmax() -> None:
    async def act(rig: MotorRig) -> None:
        (most,) = rig.get("VMAX")
        assert float(most) > 0.0
        for value in (2.0 * float(most), 1e9):
            for name in ("VELO", "JVEL", "HVEL"):
                await rig.put(name, value)
        assert rig.get("VELO", "JVEL", "HVEL") == [most] * 3
        await rig.put("VELO", 5.0)
        assert rig.get("VELO") == [5.0]

    check(act)


def test_a_bit_of_the_status_is_that_of_the_drive() -> None:
    async def act(rig: MotorRig) -> None:
        found = []
        for on in (1, 0, 1):
            await rig.put("CNEN", on)
            found.append((*rig.get("CNEN"), int(rig.get("MSTA")[0]) & 0x20))
        assert found == [(1, 0x20), (0, 0), (1, 0x20)]

    check(act)
