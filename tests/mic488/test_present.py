"""The present state of a MIC488: what its status registers mean (manual 1.70, 4.7, 4.8), the place in its program."""

from __future__ import annotations

from dataclasses import fields

import pytest
from mic488_rig import EN, MM, Rig, controller, loaded, programmed, started

from steptwin.controllerstate import ControllerState, ProgramActivity, StateProgram, StatusLevel
from steptwin.jsonvalues import read, to_json
from steptwin.mic488.config import AxisConfig, ProgramConfig
from steptwin.mic488.present import axis_status, controller_status, current_line, empty_banks, state_of

OK, WARNING, ERROR = StatusLevel.OK, StatusLevel.WARNING, StatusLevel.ERROR


def state(rig: Rig) -> ControllerState:
    return state_of(rig.device, rig.now)


def program(rig: Rig) -> StateProgram:
    found = state(rig).program
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("code", "text", "level"),
    [
        (0, "off", OK), (1, "on at rest", OK), (2, "velocity mode", OK), (3, "moving to position", OK),
        (4, "position reached", OK), (5, "position error", ERROR), (6, "homing", OK),
        (8, "position correction", OK), (9, "stopped at limit L", WARNING),
        (10, "stopped at limit R", WARNING), (7, "unknown status 7", OK),
    ],
)  # fmt: skip
def test_status_of_an_axis(code: int, text: str, level: StatusLevel) -> None:
    found = axis_status(code)
    assert (found.code, found.text, found.level) == (code, text, level)


@pytest.mark.parametrize(
    ("code", "text", "level"),
    [
        (0, "ok", OK), (1, "drive position error", ERROR), (2, "program error", ERROR),
        (3, "Modbus master communication error", ERROR), (4, "unknown status 4", ERROR),
    ],
)  # fmt: skip
def test_status_of_the_controller(code: int, text: str, level: StatusLevel) -> None:
    found = controller_status(code)
    assert (found.code, found.text, found.level) == (code, text, level)


def test_axes_in_their_units() -> None:
    """100 imp/mm: 50 mm/s for 1 s; a controller without configuration has pulses."""
    rig = Rig(controller(MM, AxisConfig(gear=2.0)))
    rig.enable(1, 2)
    rig.set("VEL_ABS", 50.0, 1)
    rig.wait(3)
    rig.set("VEL_ABS", 0.0, 1)
    rig.wait(1)
    rig.set("POS_ACT", 12.5, 1)
    rig.set("VEL_ABS", -20.0, 2)
    rig.wait(1)
    found = state(rig)
    assert [axis.number for axis in found.axes] == [1, 2, 3, 4]
    assert [(axis.name, axis.unit) for axis in found.axes] == [("M1", "mm"), ("M2", "imp"), ("M3", "imp"), ("M4", "imp")]
    one, two, three, _ = found.axes
    assert (one.position, one.velocity, one.moving, one.enabled, one.status.code) == (12.5, 0.0, False, True, 1)
    assert (two.position, two.velocity, two.moving, two.enabled, two.status.code) == (rig.position(2), -20.0, True, True, 2)
    assert (three.enabled, three.status.text) == (False, "off")
    assert two.encoder == rig.get("ENC_IMP", 2)
    assert (found.variant, found.time_s, found.status.code) == ("1.70", 5.0, 0)
    assert found.pins == dict(rig.pins())


def test_details_are_what_registers_show() -> None:
    rig = Rig()
    assert state(rig).details == {
        "data_type": "REAL", "axis_control_mode": "DIRECT", "program_bank": 0, "position_bank": 0, "user_registers": {},
    }  # fmt: skip
    rig.word("DATA_TYPE", 1)
    rig.word("AXIS_CTR_MODE", 1)
    rig.word("PROG_BANK_SEL", 3)
    rig.word("POS_BANK_SEL", 5)
    rig.i(7, -1)
    rig.i(1999, 3)
    assert state(rig).details == {
        "data_type": "DINT", "axis_control_mode": "TRIGGER", "program_bank": 3, "position_bank": 5,
        "user_registers": {"7": 65535, "1999": 3},
    }  # fmt: skip


# ---------------------------------------------------------------------- the program


def test_the_statement_that_is_executed() -> None:
    rig = started("x = 2.5\n  WAIT IN1 = ON  // start\n")
    rig.wait(0.01)
    found = program(rig)
    assert (found.state, found.text) == (ProgramActivity.RUNNING, "running at line 2: WAIT IN1 = ON")
    assert (found.line, found.statement, found.variables) == (2, "WAIT IN1 = ON", {"x": 2.5})
    place = current_line(rig.device)
    assert place is not None
    assert found.file == place.file
    rig.pause()
    assert (program(rig).state, program(rig).text) == (ProgramActivity.PAUSED, "paused at line 2: WAIT IN1 = ON")
    rig.halt()
    found = program(rig)
    assert (found.state, found.text, found.file, found.line, found.statement) == (
        ProgramActivity.STOPPED,
        "stopped",
        None,
        None,
        None,
    )
    assert current_line(rig.device) is None


def test_a_program_that_an_error_stopped_names_it() -> None:
    """WBC-5."""
    rig = started("x = 0\ny = 1 / x\n")
    rig.wait(0.1)
    (event,) = rig.events("program-error")
    found = program(rig)
    assert found.state is ProgramActivity.STOPPED
    assert found.text.startswith("stopped by an error: ")
    assert "zero" in found.text
    assert (state(rig).status.level, event.code) == (ERROR, "program-error")


# ---------------------------------------------------------------------- banks that are started at power-on


def test_nothing_is_missing_without_start_at_power_on() -> None:
    assert empty_banks("m", Rig(controller(program=ProgramConfig(activate=0, prog_bank=2))).device) == []


def test_an_empty_bank_is_named_with_what_fills_it() -> None:
    rig = Rig(controller(program=ProgramConfig(activate=1, prog_bank=2)))
    assert rig.pins()["ERR"] == 1.0
    (message,) = empty_banks("feeder", rig.device)
    assert message == (
        "ERR of feeder is on: Activate=1 starts program bank 2 at power-on, which is empty "
        "(--program 2=FILE, or programs = { 2 = 'FILE' })"
    )


def test_wbc_25_an_empty_position_bank_is_named_where_the_program_uses_positions() -> None:
    config = controller(MM, program=ProgramConfig(activate=1, prog_bank=0, pos_bank=4))
    rig = programmed("M1 = ON\nMOVEPTP 0\n", "a;1;x;x;x\n", config)
    assert rig.pins()["ERR"] == 1.0
    (message,) = empty_banks("m", rig.device)
    assert message == (
        "ERR of m is on: Activate=1 starts program bank 0 at power-on with position bank 4, which is empty "
        "(--positions 4=FILE, or positions = { 4 = 'FILE' })"
    )
    rig.device.load_positions(4, loaded("M1 = ON\n", "a;1;x;x;x\n")[1])
    assert empty_banks("m", rig.device) == []
    assert empty_banks("m", programmed("M1 = ON\nWAIT IN1 = ON\n", "", config).device) == []


def test_an_enable_coil_shows_at_once() -> None:
    rig = Rig()
    rig.coil(EN + 2, True)
    assert [axis.enabled for axis in state(rig).axes] == [False, False, True, False]


def test_json_has_every_member() -> None:
    rig = Rig(controller(MM))
    rig.enable(1)
    found = state(rig)
    assert list(to_json(found)) == [one.name for one in fields(found)]
    assert read(ControllerState, to_json(found)) == found


@pytest.mark.parametrize("used", [(), (0,), (1999,), (5, 249, 250, 251, 1000)])
def test_user_registers_that_are_not_0(used: tuple[int, ...]) -> None:
    rig = Rig(controller(MM))
    for number in used:
        rig.device.user[number] = number + 1
    assert state(rig).details["user_registers"] == {str(number): number + 1 for number in used}
