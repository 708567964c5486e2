"""The monitor on a terminal. The stop keys work with any focus, because nothing here is modal."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import ClassVar

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Event, InputEvent, Key, Paste
from textual.widget import Widget
from textual.widgets import DataTable, Footer, Input, RichLog, Static, TabbedContent, TabPane, Tabs

from steptwin.drivers.mic488.frames import ObservedFrame
from steptwin.drivers.stale import BEAT_S, StaleInput
from steptwin.errors import LineFailure, SteptwinError
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.registermap import DataType, Register, Type
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS
from steptwin.mic488.values import value_of
from steptwin.monitor.groups import USER, USER_SHOWN, groups_of, permitted, shown
from steptwin.monitor.session import MonitorSession, Picture
from steptwin.wire.slave import FrameDirection

NOTHING = "–"
PROGRAM_STATES = ("stopped", "running", "paused")
FRAMES_KEPT = 500
STOP_KEYS = ("space", "escape")

HELP = """\
[b]SPACE or ESC  stop all axes at once; a running program is paused[/b]
1 2 3 4       choose an axis          e   switch its drive on or off
← →           jog while held (*)      v   set the jog velocity
m             move to a position      b   move by a distance
h             home at a velocity: negative towards KL, positive towards KR
Tab           axes, registers, …      ↑ ↓ Enter   write a register
\\[ ]           groups of registers     n p   next, previous user registers
f             frames or registers     r   reads among the frames
q             quit; axes continue their motions
?             close this
(*) While Axes has the focus. A held key is one that your terminal repeats:
until it does, and when you release it, the axis comes to rest by itself."""


class Monitor(App[None]):
    """The application: shows a session."""

    ENABLE_COMMAND_PALETTE = False
    TITLE = "steptwin monitor"
    CSS = """
    #head { height: auto; max-height: 3; background: $primary-background; padding: 0 1; }
    #head.lost { background: $error; color: $text; text-style: bold; }
    #axes { height: 7; border: round $primary; }
    #axes:focus { border: round $accent; }
    #io { height: 2; padding: 0 2; color: $text-muted; }
    #panes { height: 1fr; }
    #groups { height: 2; }
    #registers { height: 1fr; }
    #meaning { height: 1; padding: 0 1; color: $text-muted; }
    #ask { display: none; height: 3; border: round $accent; }
    #ask.open { display: block; }
    #said { height: auto; min-height: 1; max-height: 4; padding: 0 1; }
    #said.bad { color: $error; text-style: bold; }
    #help { display: none; layer: above; dock: bottom; offset-y: -3; height: auto; border: round $accent; padding: 0 1;
            background: $panel; }
    #help.open { display: block; }
    Screen { layers: base above; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(",".join(STOP_KEYS), "stop", "STOP", key_display="SPACE/ESC", priority=True),
        Binding("e", "enable", "Drive on/off"),
        Binding("m", "ask_motion('move')", "Move to"),
        Binding("b", "ask_motion('by')", "Move by", show=False),
        Binding("h", "ask_motion('home')", "Home"),
        Binding("v", "ask_velocity", "Jog velocity"),
        *[Binding(str(n), f"axis({n})", f"M{n}", show=False) for n in range(1, 5)],
        Binding("left_square_bracket", "group(-1)", "Group", show=False),
        Binding("right_square_bracket", "group(1)", "Group", key_display="[ ]"),
        Binding("n", "page(1)", "Next user registers", show=False),
        Binding("p", "page(-1)", "Previous user registers", show=False),
        Binding("f", "frames", "Frames"),
        Binding("r", "reads", "Reads too", show=False),
        Binding("question_mark", "help", "Keys", key_display="?"),
        Binding("q", "quit", "Quit"),
    ]

    def __init__(self, session: MonitorSession) -> None:
        super().__init__()
        self.session = session
        self._axis = 1
        self._jog_velocity = 1.0
        self._groups = groups_of(session.registers)
        self._group = "M1"
        self._page = 0
        self._firmware = session.mic.firmware
        self._shows_reads = False
        self._stale = StaleInput()
        self._began: Nanos | None = None
        self._before: Widget | None = None
        self._answer: Callable[[str], Awaitable[object]] | None = None
        session.on_picture = self._pictured
        session.on_frame = self._on_frame

    # ------------------------------------------------------------------ what there is

    def compose(self) -> ComposeResult:
        yield Static(f"{self.session.place}: connecting …", id="head", markup=False)
        yield AxisTable(id="axes", cursor_type="row", zebra_stripes=True)
        yield Static("", id="io", markup=False)
        with TabbedContent(id="panes"):
            with TabPane("Registers", id="registers-pane"), Vertical():
                yield Tabs(id="groups")
                yield DataTable(id="registers", cursor_type="row", zebra_stripes=True)
                yield Static("", id="meaning", markup=False)
            with TabPane("Frames", id="frames-pane"):
                yield RichLog(id="frames", max_lines=FRAMES_KEPT, wrap=False)
        yield Ask(id="ask")
        yield Static("", id="said", markup=False)
        yield Static(HELP, id="help")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        axes = self.query_one("#axes", DataTable)
        axes.border_title = "Axes"
        for column, width in (("axis", 4), ("position", 14), ("velocity", 12), ("unit", 6), ("drive", 5), ("status", 24)):
            label = Text(column.rjust(width) if column in ("position", "velocity") else column)
            axes.add_column(label, key=column, width=width)
        for number in range(1, 5):
            axes.add_row(f"M{number}", NOTHING, NOTHING, "", "", "", key=str(number))
        registers = self.query_one("#registers", DataTable)
        for column, width in (("register", 19), ("value", 22), ("unit", 9), ("address", 12), ("write", 6)):
            registers.add_column(column, key=column, width=width)
        self._fill_groups()
        axes.focus()
        self.run_worker(self.session.run(), name="session", exit_on_error=True)
        self.run_worker(self._beat(), name="beat", exit_on_error=True)

    def _fill_groups(self) -> None:
        tabs = self.query_one("#groups", Tabs)
        if not tabs.tab_count:
            for name in (*self._groups, USER):
                tabs.add_tab(name)
        self._fill_registers()

    # ------------------------------------------------------------------ input

    async def _beat(self) -> None:
        while True:
            self._stale.beat()
            await asyncio.sleep(BEAT_S)

    async def on_event(self, event: Event) -> None:
        is_input = isinstance(event, InputEvent | Paste) and not event.is_forwarded
        if is_input and not (isinstance(event, Key) and event.key in STOP_KEYS) and self._stale.is_stale():
            self._say("the monitor was suspended: what was typed meanwhile is ignored, except SPACE and ESC", bad=True)
            return
        await super().on_event(event)

    # ------------------------------------------------------------------ what was found

    @property
    def _is_shown(self) -> bool:
        """Whether the screen exists: the session continues for a moment after the user has quit."""
        return len(self.screen_stack) > 0 and bool(self.query("#head"))

    def _pictured(self, picture: Picture) -> None:
        if not self._is_shown:
            return
        if self._firmware != self.session.mic.firmware:
            self._firmware = self.session.mic.firmware
            self._groups = groups_of(self.session.registers)
            self._fill_registers()
        head = self.query_one("#head", Static)
        head.set_class(picture.trouble is not None, "lost")
        if picture.trouble is not None:
            head.update(f"NOT CONNECTED, trying again: {picture.trouble}")
        elif picture.status is not None:
            program = PROGRAM_STATES[picture.status.program] if picture.status.program < 3 else "?"
            error = CONTROLLER_STATUS_TEXTS.get(picture.status.controller or 0, "unknown")
            head.update(
                f"{self.session.place}   firmware {self._firmware}   program {program}   jog ← → {self._jog_velocity:g} u/s"
                + (f"   ERR: {error}" if picture.status.controller else "")
            )
        self._show_axes(picture)
        self._show_io(picture)
        self._show_values(picture)

    def _show_axes(self, picture: Picture) -> None:
        table = self.query_one("#axes", DataTable)
        status = picture.status
        for n in range(4):
            row = str(n + 1)
            cells = {"position": NOTHING, "velocity": NOTHING, "unit": "", "drive": "", "status": ""}
            if status is not None and picture.trouble is None:
                code = status.axes[n]
                cells = {
                    "position": f"{status.positions[n]:>14.4f}",
                    "velocity": f"{status.velocities[n]:>12.4f}",
                    "unit": status.units[n],
                    "drive": "on" if code else "off",
                    "status": AXIS_STATUS_TEXTS.get(code, f"unknown status {code}"),
                }
            for column, text in cells.items():
                table.update_cell(row, column, text)

    def _show_io(self, picture: Picture) -> None:
        status = picture.status
        if status is None or picture.trouble is not None:
            self.query_one("#io", Static).update("")
            return
        text = Text()
        for name, levels in (("IN ", status.inputs), ("OUT", status.outputs)):
            text.append(f"{name} ")
            for number, level in enumerate(levels, 1):
                text.append(f"{number} ", style="bold reverse" if level else "dim")
            text.append("\n" if name == "IN " else "")
        self.query_one("#io", Static).update(text)

    def _on_frame(self, frame: ObservedFrame) -> None:
        if self._began is None:
            self._began = frame.time
        is_read = ": read " in frame.meaning
        if (is_read and not self._shows_reads) or not self._is_shown:
            return
        arrow = "?" if frame.direction is None else "→" if frame.direction is FrameDirection.IN else "←"
        style = "red" if "exception" in frame.meaning or frame.direction is None else "dim" if is_read else ""
        since = frame.time - self._began
        self.query_one("#frames", RichLog).write(Text(f"{since / SECOND:10.3f} s {arrow} {frame.meaning}", style=style))

    # ------------------------------------------------------------------ registers

    def _rows(self) -> list[tuple[str, Register]]:
        if self._group == USER:
            register = self.session.registers.of("USER_REGISTER")
            first = self._page * USER_SHOWN
            return [(f"{register.name}[{n}]", register) for n in range(first, min(first + USER_SHOWN, register.cells))]
        return [(register.name, register) for register in self._groups[self._group]]

    def _fill_registers(self) -> None:
        table = self.query_one("#registers", DataTable)
        table.clear()
        rows = self._rows()
        for name, register in rows:
            address = register.address + (int(name[name.index("[") + 1 : -1]) if register.type is Type.MEMORY else 0)
            writing = register.effect.value if register.accepts else NOTHING
            table.add_row(name, NOTHING, "", f"{address} 0x{address:04X}", writing, key=name)
        self.session.watch([name for name, register in rows if register.reads])

    def _show_values(self, picture: Picture) -> None:
        table = self.query_one("#registers", DataTable)
        for name, register in self._rows():
            if name not in table.rows:
                continue
            value, unit = picture.values.get(name, (None, ""))
            text = NOTHING if value is None else shown(register, value)
            table.update_cell(name, "value", text)
            table.update_cell(name, "unit", unit)

    def on_tabs_tab_activated(self, event: Tabs.TabActivated) -> None:
        if event.tabs.id == "groups" and event.tab.label_text != self._group:
            self._group = event.tab.label_text
            self._page = 0
            self._fill_registers()

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        if event.data_table.id == "axes":
            self._axis = event.cursor_row + 1
        elif self._is_shown and event.row_key.value is not None:
            found = dict(self._rows()).get(event.row_key.value)
            self.query_one("#meaning", Static).update("" if found is None else found.meaning)

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        if event.data_table.id != "registers" or event.row_key.value is None:
            return
        name = event.row_key.value
        register = dict(self._rows())[name]
        if not register.accepts:
            self._say(f"{name} can only be read", bad=True)
            return
        _, unit = self.session.picture.values.get(name, (None, ""))
        takes = permitted(register, DataType.REAL, unit or "u")

        async def write(typed: str) -> None:
            await self.session.mic.set(name, value_of(register, typed))
            self._say(f"{name} = {typed.strip()}")

        self._ask(f"{name}: {takes}", write)

    # ------------------------------------------------------------------ asking

    def _ask(self, title: str, answer: Callable[[str], Awaitable[object]]) -> None:
        """Ask for a value, and again with a message if it is wrong. Esc stops the axes and closes the input."""
        self._answer = answer
        ask = self.query_one("#ask", Input)
        ask.value = ""
        ask.border_title = title
        ask.border_subtitle = "Enter sends · Esc stops and closes"
        ask.add_class("open")
        self._before = self.focused
        ask.focus()

    def _close_ask(self) -> None:
        ask = self.query_one("#ask", Input)
        if ask.has_class("open"):
            ask.remove_class("open")
            (self._before or self.query_one("#axes")).focus()
        self._answer = None

    def on_input_submitted(self, event: Input.Submitted) -> None:
        answer = self._answer
        if answer is None:
            return
        if not event.value.strip():
            self._close_ask()
            return

        async def send() -> None:
            await answer(event.value)
            self._close_ask()

        self._do(send())

    def _say(self, text: str, *, bad: bool = False) -> None:
        if not self._is_shown:
            return
        said = self.query_one("#said", Static)
        said.set_class(bad, "bad")
        said.update(text)

    def _do(self, action: Awaitable[object]) -> None:
        """Execute an action in its own task and show its errors."""

        async def done() -> None:
            try:
                await self.session.do(action)
            except LineFailure as failure:
                self._say(f"NOT DONE: {failure}", bad=True)
            except SteptwinError as error:
                self._say(str(error), bad=True)

        self.run_worker(done(), exit_on_error=True)

    # ------------------------------------------------------------------ keys

    def action_stop(self) -> None:
        self._close_ask()

        async def stop() -> None:
            self._say(f"all axes {await self.session.stop()}")

        self._do(stop())

    def action_axis(self, number: int) -> None:
        self._axis = number
        self.query_one("#axes", DataTable).move_cursor(row=number - 1)

    def action_enable(self) -> None:
        status = self.session.picture.status
        axis = self.session.mic.axis(self._axis)
        is_on = status is not None and status.axes[self._axis - 1] != 0
        self._do(axis.disable() if is_on else axis.enable())

    def action_ask_motion(self, kind: str) -> None:
        axis = self.session.mic.axis(self._axis)
        number = self._axis
        unit = axis.unit if kind != "home" else f"{axis.unit}/s"
        begin, title, doing = {
            "move": (axis.move_to, f"M{number}: move to position, {unit}", "moving to"),
            "by": (axis.move_by, f"M{number}: move by distance, {unit}", "moving by"),
            "home": (axis.home, f"M{number}: home at velocity, {unit}, negative towards KL, positive towards KR", "homing at"),
        }[kind]

        async def move(typed: str) -> None:
            await begin(_number(typed))
            self._say(f"M{number}: {doing} {typed.strip()} {unit}")

        self._ask(title, move)

    def action_ask_velocity(self) -> None:
        async def take(typed: str) -> None:
            velocity = abs(_number(typed))
            if not velocity:
                raise SteptwinError("a jog at 0 does not move")
            self._jog_velocity = velocity
            self._say(f"the arrow keys jog at {velocity:g} u/s")

        self._ask("jog velocity, u/s", take)

    def action_jog(self, direction: int) -> None:
        async def jog() -> None:
            end = await self.session.jog(self._axis, direction * self._jog_velocity)
            if end:
                self._say(end, bad=True)

        self._do(jog())

    def action_group(self, step: int) -> None:
        tabs = self.query_one("#groups", Tabs)
        if step > 0:
            tabs.action_next_tab()
        else:
            tabs.action_previous_tab()

    def action_page(self, step: int) -> None:
        if self._group != USER:
            return
        cells = self.session.registers.of("USER_REGISTER").cells
        self._page = max(0, min(self._page + step, (cells - 1) // USER_SHOWN))
        self._fill_registers()

    def action_frames(self) -> None:
        panes = self.query_one("#panes", TabbedContent)
        panes.active = "frames-pane" if panes.active == "registers-pane" else "registers-pane"

    def action_reads(self) -> None:
        self._shows_reads = not self._shows_reads
        self._say("frames: reads too" if self._shows_reads else "frames: without reads")

    def action_help(self) -> None:
        self.query_one("#help").toggle_class("open")


class AxisTable(DataTable[str]):
    """The table of axes. The left and right arrow keys jog."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "app.jog(-1)", show=False),
        Binding("right", "app.jog(1)", show=False),
    ]


class Ask(Input):
    """The input of a value. Space stops the axes here, too, because values contain no blank."""

    def check_consume_key(self, key: str, character: str | None) -> bool:
        return key != "space" and super().check_consume_key(key, character)


def _number(typed: str) -> float:
    try:
        return float(typed.strip().replace(",", "."))
    except ValueError:
        raise SteptwinError(f"{typed.strip()!r} is not a number") from None
