"""Motion commands that wait for a trigger (MIC-16)."""

from __future__ import annotations

from mic488_rig import Rig, controller

from steptwin.controller import SECOND


def test_trigger_example_of_the_manual() -> None:
    """Three axes to 10, 15 and 20 together."""
    rig = Rig()
    rig.enable(1, 2, 3)
    rig.word("AXIS_CTR_MODE", 1)
    for axis, target in ((1, 10.0), (2, 15.0), (3, 20.0)):
        rig.set("POS_ABS", target, axis)
    rig.wait(1.0)
    assert [rig.status(axis) for axis in (1, 2, 3)] == [1, 1, 1]
    rig.word("AXIS_POS_ABS_TRIG", 7)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [3, 3, 3, 0]
    started = {axis.profile.start for axis in rig.device.axes[:3]}
    assert started == {SECOND}
    for axis in (1, 2, 3):
        rig.until(axis, 4)
    assert [rig.position(axis) for axis in (1, 2, 3)] == [10.0, 15.0, 20.0]


def test_mic_16_a_trigger_consumes_values_of_its_axes_and_reads_back_its_mask(rig: Rig) -> None:
    rig.enable(1, 2)
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_REL", 10.0, 1)
    rig.set("POS_REL", 20.0, 2)
    rig.word("AXIS_POS_REL_TRIG", 1)
    rig.until(1, 4)
    assert rig.position(2) == 0.0
    rig.word("AXIS_POS_REL_TRIG", 3)
    rig.wait(5.0)
    assert (rig.position(1), rig.position(2)) == (10.0, 20.0)
    assert rig.word("AXIS_POS_REL_TRIG") == 3
    assert rig.word("AXIS_POS_ABS_TRIG") == 0
    rig.word("AXIS_POS_REL_TRIG", 3)
    rig.wait(5.0)
    assert (rig.position(1), rig.position(2)) == (10.0, 20.0)


def test_mic_16_a_trigger_without_a_new_value_is_told(rig: Rig) -> None:
    rig.enable(1, 2)
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_REL", 10.0, 1)
    rig.word("AXIS_POS_REL_TRIG", 3)
    assert [(event.axis, event.text) for event in rig.events("trigger-empty")] == [
        (2, "trigger of M2 without a new value of POS_REL")
    ]
    rig.until(1, 4)
    rig.word("AXIS_POS_REL_TRIG", 1)
    assert (rig.status(), [event.axis for event in rig.events("trigger-empty")]) == (4, [2, 1])


def test_mic_16_values_are_kept_where_it_is_configured() -> None:
    rig = Rig(controller(trigger_keeps=1))
    rig.enable(1)
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_REL", 10.0)
    for position in (10.0, 20.0):
        rig.word("AXIS_POS_REL_TRIG", 3)
        rig.until(1, 4)
        assert rig.position() == position
    assert {event.axis for event in rig.events("trigger-empty")} == {2}


def test_mic_16_each_kind_has_its_own_stored_value_and_the_last_one_counts(rig: Rig) -> None:
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("VEL_ABS", 100.0)
    rig.set("VEL_ABS", 200.0)
    rig.set("VEL_REL", 50.0)
    rig.set("POS_ABS", 5000.0)
    rig.word("AXIS_VEL_ABS_TRIG", 1)
    rig.wait(1.0)
    assert rig.velocity() == 200.0
    rig.word("AXIS_VEL_REL_TRIG", 1)
    rig.wait(1.0)
    assert rig.velocity() == 250.0
    rig.word("AXIS_POS_ABS_TRIG", 1)
    rig.until(1, 4)
    assert rig.position() == 5000.0


def test_triggers_mean_nothing_in_direct_mode(rig: Rig) -> None:
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_ABS", 100.0)
    rig.word("AXIS_CTR_MODE", 0)
    rig.word("AXIS_POS_ABS_TRIG", 1)
    rig.wait(1.0)
    assert rig.status() == 1
    rig.set("POS_ABS", 5.0)
    assert rig.status() == 3


def test_homing_does_not_wait_for_a_trigger(rig: Rig) -> None:
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("HOME", -100.0)
    assert rig.status() == 6


def test_jog_does_not_wait_for_a_trigger(rig: Rig) -> None:
    rig.word("AXIS_CTR_MODE", 1)
    rig.jog(1, +1, True)
    assert rig.status() == 2
