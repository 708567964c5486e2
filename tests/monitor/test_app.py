"""The monitor as its user has it: keys go in, the screen is looked at, and the twin is asked what really happened."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from textual.events import Key
from textual.pilot import Pilot
from textual.widgets import DataTable, Input, RichLog, Static

from steptwin.drivers import stale
from steptwin.drivers.stale import QUIET_S
from steptwin.mic488.status import AxisStatus
from steptwin.monitor import session
from steptwin.monitor.app import HELP, Monitor
from steptwin.monitor.session import KEY_S, session_at
from steptwin.testing import Mic488Rig

PROGRAMS = Path(__file__).parents[2] / "examples" / "mic488"
HELD_S = 0.05
"""A terminal repeats a key more often than this."""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow this process is, it was not suspended."""
    monkeypatch.setattr(stale, "SUSPENDED_S", 60.0)


class Screen:
    """The monitor, and what is on it."""

    def __init__(self, app: Monitor, pilot: Pilot[None]) -> None:
        self.app = app
        self.pilot = pilot

    def text(self, name: str) -> str:
        return str(self.app.query_one(f"#{name}", Static).content)

    def cell(self, table: str, row: str, column: str) -> str:
        cells = self.app.query_one(f"#{table}", DataTable)
        return str(cells.get_cell(row, column)).strip() if row in cells.rows else ""

    @property
    def frames(self) -> str:
        return "\n".join(line.text for line in self.app.query_one("#frames", RichLog).lines)

    @property
    def is_asking(self) -> bool:
        return self.app.query_one("#ask", Input).has_class("open")

    async def until(self, condition: Callable[[], object], what: str) -> None:
        for _ in range(1000):
            if condition():
                break
            await asyncio.sleep(0.01)
        else:
            raise AssertionError(f"not yet: {what}")
        await self.pilot.pause(0.01)

    async def press(self, *keys: str) -> None:
        """As the terminal would say it. (The pilot's own waits for an idle process, and a process with a twin in it is none.)"""
        for key in keys:
            self.app.post_message(Key(key, key if len(key) == 1 else None))
            await self.pilot.pause(0.01)

    async def type(self, text: str) -> None:
        """Into the field that is about to open."""
        await self.until(lambda: self.is_asking and isinstance(self.app.focused, Input), "a value is asked for")
        await self.press(*text, "enter")

    async def choose(self, row: str) -> None:
        """A register of the group that is shown, with the keyboard."""
        registers = self.app.query_one("#registers", DataTable)
        registers.focus()
        registers.move_cursor(row=list(registers.rows).index(row))  # type: ignore[arg-type]
        await self.press("enter")


def run(mic488: Mic488Rig, scenario: Callable[[Screen], Awaitable[None]]) -> None:
    async def main() -> None:
        app = Monitor(session_at(mic488.device_address, 5.0))
        app.animation_level = "none"
        async with app.run_test(size=(110, 40)) as pilot:
            screen = Screen(app, pilot)
            await screen.until(lambda: app.session.is_connected, "connected")
            await scenario(screen)

    asyncio.run(main())


def test_axes_registers_and_inputs_are_live(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        assert "firmware 1.70" in screen.text("head")
        await screen.until(lambda: screen.cell("registers", "M1_ACC", "value") == "50", "registers are read")
        assert screen.cell("registers", "M1_ACC", "unit") == "u/s²"
        assert screen.cell("registers", "M1_STATUS", "value") == "off (0)"
        assert screen.cell("registers", "M1_EN", "value") == "–"  # can only be written
        mic488.call(lambda device, now: device.axes[0].enable(now))
        await screen.until(lambda: screen.cell("axes", "1", "drive") == "on", "the drive is on")
        await screen.press("right_square_bracket", *["right_square_bracket"] * 4)
        mic488.set_pin("IN7", 1)
        await screen.until(lambda: screen.cell("registers", "IN7", "value") == "on", "the input is on")

    run(mic488, scenario)


def test_a_register_is_written_and_a_wrong_value_is_asked_again(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.choose("M1_ACC")
        await screen.type("-3")
        await screen.until(lambda: "M1_ACC = -3" in screen.text("said"), "the value is refused")
        assert "permitted" in screen.text("said")
        assert screen.is_asking
        screen.app.query_one("#ask", Input).value = ""
        await screen.type("80,5")
        await screen.until(lambda: screen.cell("registers", "M1_ACC", "value") == "80.5", "the value is there")
        await screen.until(lambda: not screen.is_asking, "nothing is asked any more")
        await screen.choose("M1_STATUS")
        await screen.until(lambda: screen.text("said") == "M1_STATUS can only be read", "it is told")

    run(mic488, scenario)


def test_names_of_values_and_user_registers_can_be_typed(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press(*["right_square_bracket"] * 4)
        await screen.until(lambda: screen.cell("registers", "AXIS_CTR_MODE", "value"), "the controller's registers")
        await screen.choose("AXIS_CTR_MODE")
        await screen.type("trigger")
        await screen.until(lambda: screen.cell("registers", "AXIS_CTR_MODE", "value") == "TRIGGER (1)", "the mode has changed")
        await screen.press(*["right_square_bracket"] * 3)
        await screen.until(lambda: screen.cell("registers", "USER_REGISTER[0]", "value") == "0", "user registers")
        await screen.press("n")
        await screen.until(lambda: screen.cell("registers", "USER_REGISTER[40]", "value") == "0", "the next ones")
        await screen.choose("USER_REGISTER[40]")
        await screen.type("0x1F")
        await screen.until(lambda: screen.cell("registers", "USER_REGISTER[40]", "value") == "31", "the value is there")
        assert mic488.call(lambda device, _: device.user[40]) == 31

    run(mic488, scenario)


def test_an_axis_is_switched_on_moved_and_stopped_even_while_a_value_is_asked_for(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("2", "e")
        await screen.until(lambda: screen.cell("axes", "2", "drive") == "on", "the drive is on")
        await screen.press("m")
        await screen.type("240")
        await screen.until(lambda: screen.cell("axes", "2", "status") == "moving to position", "it moves")
        await screen.until(lambda: not screen.is_asking, "nothing is asked any more")
        await screen.press("m")
        await screen.until(lambda: isinstance(screen.app.focused, Input), "a value is asked for")
        await screen.press("1", "space")
        await screen.until(lambda: mic488.axis(2).velocity == 0.0, "it stands")
        assert mic488.axis(2).position < 240.0
        await screen.until(lambda: not screen.is_asking, "nothing is asked any more")
        await screen.until(lambda: screen.text("said") == "all axes stopped", "it is told")

    run(mic488, scenario)


@pytest.mark.mic488(speed=5.0)
def test_homing(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("e")
        await screen.until(lambda: screen.cell("axes", "1", "drive") == "on", "the drive is on")
        await screen.press("h")
        await screen.type("-10")
        await screen.until(lambda: mic488.axis(1).status is AxisStatus.REACHED, "it is home")
        assert mic488.axis(1).position == 0.0

    run(mic488, scenario)


def test_a_jog_runs_for_as_long_as_the_key_is_held(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("e")
        await screen.until(lambda: screen.cell("axes", "1", "drive") == "on", "the drive is on")
        await screen.press("v")
        await screen.type("20")
        await screen.until(lambda: screen.app.focused is screen.app.query_one("#axes"), "the axes have the focus again")
        while mic488.axis(1).position < 10.0:
            await screen.press("right")
            await asyncio.sleep(HELD_S)
            if mic488.axis(1).velocity == 0.0:  # this process was held up: the key has to be let go
                await asyncio.sleep(2 * KEY_S)
        await screen.until(lambda: mic488.axis(1).velocity == 0.0, "it has come to rest by itself")
        # A tap comes to rest too, and the other way round.
        there = mic488.axis(1).position
        assert there >= 10.0
        await screen.press("left")
        await screen.until(lambda: mic488.axis(1).position < there, "it moves")
        await screen.until(lambda: mic488.axis(1).velocity == 0.0, "it rests")
        await screen.until(lambda: mic488.call(lambda device, _: device.axes[0].vmax_p) == 2500.0, "VMAX is what it was")

    run(mic488, scenario)


def test_a_stop_ends_a_jog_whose_key_is_held_on(mic488: Mic488Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "KEY_S", 60.0)  # however slow this process is, the key is one that is held

    async def scenario(screen: Screen) -> None:
        await screen.press("e")
        await screen.until(lambda: screen.cell("axes", "1", "drive") == "on", "the drive is on")
        await screen.press("right")
        await screen.until(lambda: mic488.axis(1).velocity > 0.0, "it moves")
        await screen.press("right", "escape")
        await screen.until(lambda: mic488.axis(1).velocity == 0.0, "it stands")
        there = mic488.axis(1).position
        for _ in range(10):
            await screen.press("right")
        assert mic488.axis(1).position == there

    run(mic488, scenario)


def test_a_jog_with_the_drive_off_says_why_nothing_moves(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("right")
        await screen.until(lambda: "M1 of unit 1 is switched off: enable it first" in screen.text("said"), "it is told")
        assert mic488.axis(1).position == 0.0

    run(mic488, scenario)


@pytest.mark.mic488(config=PROGRAMS / "feeder.cfg", program=PROGRAMS / "feeder.prg")
def test_a_stop_pauses_the_program_that_would_move_the_axes_again(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        mic488.driver.program.start()
        await screen.until(lambda: "program running" in screen.text("head"), "it runs")
        await screen.press("space")
        await screen.until(lambda: "program paused" in screen.text("head"), "it is paused")
        await screen.until(lambda: screen.text("said") == "all axes stopped; the program is paused", "it is told")
        await screen.until(lambda: all(mic488.axis(axis).velocity == 0.0 for axis in (1, 2, 3, 4)), "all stand")
        assert "program paused" in screen.text("head")

    run(mic488, scenario)


def test_a_lost_controller_is_told_plainly_and_found_again(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.until(lambda: screen.cell("registers", "M1_ACC", "value") == "50", "registers are read")
        mic488.fault("no-answer lost=request name=cable")
        await screen.until(lambda: screen.text("head").startswith("NOT CONNECTED, trying again: "), "it is told")
        assert screen.cell("axes", "1", "position") == "–"
        assert screen.cell("registers", "M1_ACC", "value") == "–"
        await screen.press("space")
        await screen.until(lambda: "could not be stopped" in screen.text("said"), "that the stop was not heard is told")
        mic488.clear_faults()
        await screen.until(lambda: screen.app.session.is_connected, "it is found again")
        await screen.until(lambda: screen.cell("axes", "1", "position") == "0.0000", "values are back")

    run(mic488, scenario)


@pytest.mark.mic488(firmware="1.23", faults=["no-answer lost=request"])
def test_a_controller_that_comes_later_is_found_with_its_firmware(mic488: Mic488Rig) -> None:
    async def main() -> None:
        app = Monitor(session_at(mic488.device_address, 5.0))
        app.animation_level = "none"
        async with app.run_test() as pilot:
            screen = Screen(app, pilot)
            await screen.until(lambda: "NOT CONNECTED" in screen.text("head"), "nobody answers")
            mic488.clear_faults()
            await screen.until(lambda: "firmware 1.23" in screen.text("head"), "it is found")
            await screen.until(lambda: screen.cell("registers", "M1_POS_ACT", "address") == "1020 0x03FC", "its map is shown")
            assert "NOT CONNECTED" not in screen.text("head")

    asyncio.run(main())


def test_frames_are_in_words_and_reads_among_them_on_request(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("f", "e")
        await screen.until(lambda: "← unit 1: wrote M1_EN = ON" in screen.frames, "the frame is there")
        assert "read" not in screen.frames
        await screen.press("r")
        await screen.until(lambda: "unit 1: read " in screen.frames, "reads are there")

    run(mic488, scenario)


def test_the_help_names_every_key_and_opens_and_closes(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        shown = screen.app.query_one("#help", Static)
        await screen.press("question_mark")
        await screen.until(lambda: shown.has_class("open"), "it is open")
        for key in ("SPACE", "ESC", "1 2 3 4", "e ", "←", "v ", "m ", "b ", "h ", "[ ]", "n p", "f ", "r ", "q ", "?"):
            assert key in HELP
        await screen.press("question_mark")
        await screen.until(lambda: not shown.has_class("open"), "it is closed")

    run(mic488, scenario)


@pytest.mark.parametrize("size", [(80, 24), (100, 30)])
def test_every_column_is_on_the_screen(mic488: Mic488Rig, size: tuple[int, int]) -> None:
    async def main() -> None:
        app = Monitor(session_at(mic488.device_address, 5.0))
        app.animation_level = "none"
        async with app.run_test(size=size) as pilot:
            screen = Screen(app, pilot)
            await screen.until(lambda: screen.cell("registers", "M1_ACC", "value") == "50", "registers are read")
            for name in ("axes", "registers"):
                table = app.query_one(f"#{name}", DataTable)
                assert table.virtual_size.width <= table.scrollable_content_region.width, name
                assert table.size.height >= 3, name

    asyncio.run(main())


def test_the_error_of_the_controller_is_shown(mic488: Mic488Rig) -> None:
    async def scenario(screen: Screen) -> None:
        assert "ERR" not in screen.text("head")
        mic488.driver.set("PROGRAM_CTRL", 1)  # of an empty bank
        await screen.until(lambda: "ERR: program error" in screen.text("head"), "the error is shown")

    run(mic488, scenario)


@pytest.mark.parametrize(("first", "then"), [("1.70", "1.23"), ("1.23", "1.70")])
def test_a_controller_that_comes_back_with_another_firmware_is_shown_with_its_map(
    serve: Callable[..., Any], first: str, then: str
) -> None:
    old = serve("--firmware", first)
    address, position = {"1.23": "1020 0x03FC", "1.70": "10020 0x2724"}, "M1_POS_ACT"

    async def main() -> None:
        app = Monitor(session_at(f"tcp://127.0.0.1:{old.tcp_port}", 10.0))
        app.animation_level = "none"
        async with app.run_test(size=(110, 40)) as pilot:
            screen = Screen(app, pilot)
            await screen.until(lambda: f"firmware {first}" in screen.text("head"), "the first controller is found")
            await screen.until(lambda: screen.cell("registers", position, "address") == address[first], "its map is shown")
            await asyncio.to_thread(old.end)
            await screen.until(lambda: "NOT CONNECTED" in screen.text("head"), "its end is told")
            await asyncio.to_thread(serve, "--firmware", then, "--tcp", f"127.0.0.1:{old.tcp_port}")
            await screen.until(lambda: f"firmware {then}" in screen.text("head"), "the other one is found")
            await screen.until(lambda: screen.cell("registers", position, "address") == address[then], "its map is shown")
            await screen.until(lambda: screen.cell("registers", position, "value") == "0", "and its registers")
            assert "NOT CONNECTED" not in screen.text("head")

    asyncio.run(main())


def test_keys_that_piled_up_during_a_suspension_move_nothing_except_to_stop(
    mic488: Mic488Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario(screen: Screen) -> None:
        await screen.press("e")
        await screen.until(lambda: screen.cell("axes", "1", "drive") == "on", "the drive is on")
        await screen.press("m")
        await screen.until(lambda: screen.is_asking and isinstance(screen.app.focused, Input), "a value is asked for")
        mic488.driver.axis(1).move_to(200.0)
        monkeypatch.setattr(stale, "SUSPENDED_S", 0.5)
        time.sleep(1.0)  # noqa: ASYNC251  (the process stands, as it does when it is suspended)
        for key in ("1", "0", "enter", "left", "left"):
            screen.app.post_message(Key(key, key if len(key) == 1 else None))
        await screen.until(lambda: screen.text("said").startswith("the monitor was suspended"), "the suspension is told")
        monkeypatch.setattr(stale, "SUSPENDED_S", 60.0)
        assert screen.app.query_one("#ask", Input).value == ""
        assert mic488.axis(1).velocity > 0.0
        await screen.press("space")
        await screen.until(lambda: mic488.axis(1).velocity == 0.0, "the stop is not ignored")
        there = mic488.axis(1).position
        await asyncio.sleep(2 * QUIET_S)
        assert mic488.axis(1).position == there
        await screen.press("left")
        await screen.until(lambda: mic488.axis(1).position < there, "a fresh key moves")

    run(mic488, scenario)
