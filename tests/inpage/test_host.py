"""The studio inside a page, as its worker runs it: messages in, messages out, one event loop, time as an argument."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
from studio_rig import WORLD, check_message
from virtual_loop import VirtualLoop, run_virtually

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.files import recording as recordings
from steptwin.inpage import recordings as recordings_of_page
from steptwin.inpage.editor import PageEditor
from steptwin.inpage.host import PageTwin, open_twin
from steptwin.inpage.recordings import INPUTS_AT_ONCE
from steptwin.live import why
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.studio.viewers import MOST_UNSENT
from steptwin.subject.commands import VERSION

TICKING = """
[[script]]
name = "ticks"
repeat = 10000
steps = [{ wait = "0.1 s" }, { note = "tick" }]
[[mic488]]
name = "table"
"""
EXAMPLES = Path(__file__).parents[2] / "examples"


class Page:
    """The other end. What it is sent it takes at once, as long as ``reads``."""

    def __init__(self) -> None:
        self.reads = True
        self.twin: PageTwin | None = None
        self.messages: list[dict[str, Any]] = []
        self.unread = 0
        self.events: list[tuple[str, int]] = []
        self.errors: list[str] = []
        self.refusals: list[str] = []
        self.downloads: list[tuple[str, str]] = []
        self.jobs: list[Any] = []
        self.kept = b""
        self.number = 1
        """Of its connection."""
        self._id = 0

    def opened(self, number: int) -> None:
        self.events.append(("opened", number))

    def send(self, number: int, text: str) -> None:
        self.messages.append(json.loads(text))
        check_message(self.messages[-1])
        if self.reads and self.twin is not None:
            self.twin.connections.taken(number, len(text))
        else:
            self.unread += len(text)

    def closed(self, number: int, code: int) -> None:
        self.events.append(("closed", code))

    def keep(self, state: bytes) -> None:
        self.kept = state

    def swapped(self) -> None:
        """It connects again."""
        assert self.twin is not None
        self.twin.connections.close(self.number)
        self.number += 1
        self.twin.connections.open(self.number)

    def runJob(self, job: Mapping[str, object]) -> None:  # noqa: N802  as the page names it
        self.jobs.append(job)

    def endJob(self) -> None:  # noqa: N802
        self.jobs.append(None)

    def saveText(self, file: str, text: str) -> None:  # noqa: N802  as the page names it
        self.downloads.append((file, text))

    def refused(self, text: str) -> None:
        self.refusals.append(text)

    def failed(self, text: str) -> None:
        self.errors.append(text)

    async def enter(self) -> Any:
        """The whole state."""
        assert self.twin is not None
        self.twin.connections.open(self.number)
        return await self.greet()

    async def greet(self) -> Any:
        self.messages.clear()
        await self.ask("hello", version=VERSION, kinds=["plan", "status"])
        return next(one["hello"] for one in self.messages if "hello" in one)

    async def swap(self, name: str, /, **fields: object) -> Any:
        """The state of the world that is shown after a request."""
        assert self.twin is not None
        before = self.number
        self.twin.connections.receive(before, json.dumps({"do": name, **fields}))
        for _ in range(300):
            await asyncio.sleep(0.01)
            if self.number > before:
                return await self.greet()
        raise AssertionError(f"{name} has shown no other world: {self.messages[-1]}")

    async def ask(self, name: str, /, **fields: object) -> Any:
        answer = await self.answer(name, **fields)
        assert "error" not in answer, answer
        return answer["ok"]

    async def refusal(self, name: str, /, **fields: object) -> Any:
        return (await self.answer(name, **fields))["error"]

    async def answer(self, name: str, /, **fields: object) -> Any:
        assert self.twin is not None
        self._id = asked = self._id + 1
        self.twin.connections.receive(self.number, json.dumps({"do": name, "id": asked, **fields}))
        for _ in range(100):
            await asyncio.sleep(0.01)
            for one in self.messages:
                if one.get("id") == asked:
                    return one
        raise AssertionError(f"{name} was not answered")


def make(page: Page, clock: Callable[[], Nanos] | None = None) -> PageTwin:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualLoop)
    page.twin = PageTwin(page, "hall", dedent(WORLD), {}, clock or (lambda: loop.now_ns))
    page.twin.begin()
    return page.twin


def test_a_viewer_enters_moves_an_axis_and_leaves_while_the_world_goes_on() -> None:
    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        (hello,) = [one["hello"] for one in page.messages if "hello" in one]
        assert hello["role"] == "engineer"
        assert hello["device_kinds"] == []
        # What needs a service, files or processes is not offered.
        missing = {"connect", "ports", "scan", "end_points", "leave_world", "gateways", "history"}
        assert missing & set(hello["may"]) == set()
        assert {"move", "fault", "show_moment", "why", "breakpoint", "download", "resume", "save_recording"} <= set(hello["may"])
        assert {"run_campaign", "end_campaign", "change_campaign"} <= set(hello["may"])
        await page.ask("enable", controller="table", axis=1, on=True)
        await page.ask("move", controller="table", axis=1, to=20.0)
        await asyncio.sleep(2)
        assert [one["plan"] for one in page.messages if "events" in one for one in one["events"] if one["kind"] == "plan"]
        twin.connections.close(1)
        await asyncio.sleep(0.1)
        assert page.events == [("opened", 1), ("closed", 1000)]
        before = twin.hub.around.moment().time
        await asyncio.sleep(1)
        assert twin.hub.around.moment().time == before + SECOND
        assert page.errors == []

    run_virtually(visit())


def test_a_page_that_takes_nothing_is_sent_no_more_than_may_be_unread() -> None:
    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        page.reads = False
        for _ in range(200):
            twin.connections.receive(1, json.dumps({"do": "describe"}))
        await asyncio.sleep(1)
        assert MOST_UNSENT < page.unread < 2 * MOST_UNSENT
        was = page.unread
        page.reads = True
        twin.connections.taken(1, was)
        await page.ask("time")

    run_virtually(visit())


@pytest.mark.parametrize("speed", [1000, "max"])
def test_a_world_that_cannot_keep_up_rests_between_slices_in_which_a_stop_is_answered(
    monkeypatch: pytest.MonkeyPatch, speed: object
) -> None:
    """To compute a second takes 20 ms here."""

    async def visit() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)

        computed = 0

        def slow() -> Nanos:
            nonlocal computed
            if page.twin is not None:
                now = page.twin.world.now
                loop.now_ns += (now - computed) // 50
                computed = now
            return loop.now_ns

        page = Page()
        twin = make(page, slow)
        await page.enter()
        await page.ask("resume", speed=speed)
        slices: list[tuple[Nanos, Nanos]] = []
        whole = RealTimeDriver.advance

        def advance(driver: RealTimeDriver, to: Nanos) -> Nanos:
            began = loop.now_ns
            reached = whole(driver, to)
            slices.append((began, loop.now_ns))
            return reached

        monkeypatch.setattr(RealTimeDriver, "advance", advance)
        begin, real = twin.hub.around.moment().time, loop.now_ns
        await asyncio.sleep(2)
        passed = twin.hub.around.moment().time - begin
        assert 20 < passed / (loop.now_ns - real) < 50
        long = [one for one in slices if one[0] < one[1]]
        assert len(long) > 50
        for (_, ended), (began, _) in pairwise(long):
            assert began - ended >= 4 * MILLISECOND
        asked = loop.now_ns
        await page.ask("stop_all")
        assert loop.now_ns - asked < 50 * MILLISECOND

    run_virtually(visit())


def test_an_answer_comes_in_time_however_much_of_the_past_would_have_to_be_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    async def visit() -> None:
        page = Page()
        make(page)
        await page.enter()
        await page.ask("step", for_ns=str(600 * SECOND))
        monkeypatch.setattr(why, "ANSWER_S", 0.0)
        answer = await page.ask("why", question="table.M1.position")
        assert answer["cut"] is True
        assert 500 * SECOND < int(answer["known_from_ns"]) < 600 * SECOND

    run_virtually(visit())


def test_a_long_step_has_parts_as_short_as_slices() -> None:
    async def visit() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)

        def slow() -> Nanos:
            loop.now_ns += MILLISECOND
            return loop.now_ns

        page = Page()
        twin = PageTwin(page, "hall", TICKING, {}, slow)
        page.twin = twin
        await page.enter()
        for _ in range(3):
            before = loop.now_ns
            part = await page.ask("step", to_ns=str(100 * SECOND))
            assert part["to_ns"] == str(100 * SECOND)
            assert loop.now_ns - before < 50 * MILLISECOND

    run_virtually(visit())


def test_a_recording_becomes_a_download_while_a_stop_comes_between_its_parts(tmp_path: Path) -> None:
    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        await page.ask("enable", controller="table", axis=1, on=True)
        for _ in range(3 * INPUTS_AT_ONCE):
            await page.ask("write", values={"table.M1_ACC": 100.0})
        saving = asyncio.create_task(page.ask("save_recording", name="mine"))
        await asyncio.sleep(0)
        await page.ask("stop_all")
        assert page.downloads == []
        answer = await saving
        ((file, text),) = page.downloads
        assert (file, answer["name"], answer["bytes"]) == ("mine.json", "mine", len(text))
        recorded = tmp_path / file
        recorded.write_text(text)
        recording = recordings.load(recorded)
        assert len(recording.inputs) > 3 * INPUTS_AT_ONCE
        assert recording.replay().trace.digest() == recording.digest
        recordings.save(recording, tmp_path / "again.json")
        assert (tmp_path / "again.json").read_text() == text

        found = await page.ask("recordings")
        assert (found["folder"], found["saved"], found["formats"]) == (None, [], [])
        assert found["recording"]["inputs"] > len(recording.inputs)  # with that of the stop
        assert (await page.refusal("save_recording", name="../mine"))["code"] == "misuse"
        assert (await page.refusal("save", file="/mine.json"))["message"].startswith("no folder for recordings here")
        assert twin.world.keeps_inputs

    run_virtually(visit())


PROGRAM_OF_A_BRANCH = b"$R4 = 0\nDELAY 2\nIF IN3 = ON\n$R4 = 2\nELSE\n$R4 = 1\nENDIF\n"


def test_a_branch_is_shown_in_place_of_the_machine_which_stands_until_it_is_left() -> None:
    async def visit() -> None:
        page = Page()
        text = '[world]\nname = "hall"\n[[mic488]]\nname = "table"\nprogram = "a.prg"\nstart = true\n'
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        page.twin = twin = PageTwin(page, "hall", text, {"a.prg": PROGRAM_OF_A_BRANCH}, lambda: loop.now_ns)
        twin.begin()
        await page.enter()
        await asyncio.sleep(5)
        begun = await page.ask("start_branch", at_ns=str(SECOND))
        assert begun == {"branch": 1, "from_ns": str(SECOND), "url": None}
        assert await page.ask("branches") == [begun]
        assert (await page.refusal("show_branch", branch=2))["message"] == "no branch 2: open are 1"

        shown = await page.swap("show_branch", branch=1)
        assert shown["description"]["name"] == "hall, branch 1 from 1.000 s"
        assert (shown["time_ns"], shown["pace"]["running"]) == (str(SECOND), False)
        assert "leave_world" in shown["may"]
        assert {"recordings", "view_recording"} & set(shown["may"]) == set()
        stood = twin.world.now
        await page.ask("set", levels={"table.IN3": 1})
        await page.ask("resume", speed=20)
        await asyncio.sleep(1)
        assert (await page.ask("read", points=["table.USER_REGISTER[4]:real"]))[0]["value"] == 2
        assert twin.world.now == stood

        # Branches of a branch; all of them share a limit.
        for _ in range(3):
            await page.ask("start_branch")
        assert "the limit is 4" in (await page.refusal("start_branch"))["message"]
        back = await page.swap("leave_world")
        assert (back["description"]["name"], back["pace"]["running"]) == ("hall", True)
        assert (await page.ask("read", points=["table.USER_REGISTER[4]:real"]))[0]["value"] == 1
        await asyncio.sleep(1)
        assert twin.world.now > stood
        assert await page.ask("branches") == [begun]

        # It is as it was left, and ends with its own branches.
        again = await page.swap("show_branch", branch=1)
        assert again["pace"] == {"running": True, "speed": 20}
        await page.swap("leave_world")
        await page.ask("end_branch", branch=1)
        assert await page.ask("branches") == []
        await page.ask("start_branch")
        assert page.errors == []

    run_virtually(visit())


def test_a_chosen_recording_is_shown_as_it_was_in_place_of_the_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        await page.ask("enable", controller="table", axis=1, on=True)
        await page.ask("move", controller="table", axis=1, to=20.0)
        await asyncio.sleep(5)
        await page.ask("save_recording", name="mine")
        ((file, text),) = page.downloads
        until = json.loads(text)["until_ns"]
        await page.ask("move", controller="table", axis=1, to=0.0)
        await asyncio.sleep(5)

        (tmp_path / file).write_text(text)
        shown = await page.swap("view_recording", name="mine")
        assert (shown["time_ns"], shown["pace"]["running"], shown["role"]) == (str(until), False, "viewer")
        assert (await page.ask("read", points=["table.M1.position"]))[0]["value"] == 20.0
        assert {"move", "resume", "start_branch", "view_recording"} & set(shown["may"]) == set()
        await page.ask("show_moment", to_ns=str(SECOND // 2))
        assert 0 < (await page.ask("read", points=["table.M1.position"]))[0]["value"] < 20.0
        await page.swap("leave_world")
        assert (await page.ask("read", points=["table.M1.position"]))[0]["value"] == 0.0

        # One whose replay is another run says so among its events.
        changed = json.loads(text)
        changed["inputs"] = changed["inputs"][:1]
        (tmp_path / file).write_text(json.dumps(changed))
        shown = await page.swap("view_recording", name="mine")
        assert "the replay differs from the run recorded" in json.dumps(shown["events"])
        await page.swap("leave_world")
        assert twin.world.keeps_inputs
        assert page.errors == []

    run_virtually(visit())
    assert list(tmp_path.iterdir()) == []  # it is in memory once


HOSTILE = {
    "x" * (recordings_of_page.MOST_BYTES + 1): "permitted are at most 8388608",
    "[" * 1_600_000: "permitted are at most 1500000",
    '{"a":' * 50_000: "mine.json is not a recording of a world",
    "no JSON": "mine.json is not a recording of a world",
    "{}": "mine.json is not a recording of a world: 'steptwin_session' is missing",
    '{"steptwin_session": 99}': "mine.json is a recording of format 99: this version reads 1",
}


def test_a_file_that_is_no_recording_is_refused_with_its_name_and_the_machine_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        for text, words in HOSTILE.items():
            (tmp_path / "mine.json").write_text(text)
            error = await page.refusal("view_recording", name="mine")
            assert words in error["message"], words
            assert error["code"] == "misuse"
        assert (await page.refusal("view_recording", name="../mine"))["code"] == "misuse"
        assert "cannot read" in (await page.refusal("view_recording", name="mine"))["message"]
        before = twin.world.now
        await asyncio.sleep(1)
        assert twin.world.now > before
        assert page.errors == []

    run_virtually(visit())


def test_time_stands_while_the_page_is_hidden_and_goes_on_only_if_it_went() -> None:
    async def visit() -> None:
        page = Page()
        twin = make(page)
        await page.enter()
        await page.ask("resume", speed=20)

        async def passed() -> float:
            before = twin.world.now
            await asyncio.sleep(1)
            return (twin.world.now - before) / SECOND

        twin.hide(True)
        twin.hide(True)
        assert await passed() == 0
        assert (await page.ask("time"))["paused"] is True
        twin.hide(False)
        assert await passed() == pytest.approx(20, abs=1)  # up to what happened last
        await page.ask("pause")
        twin.hide(True)
        twin.hide(False)
        assert await passed() == 0

    run_virtually(visit())


def test_a_wrong_description_is_refused_with_its_place() -> None:
    page = Page()
    assert open_twin(page, "hall", '[world]\nname = "hall"\n[[nonsense]]\n', {}) is None
    (refusal,) = page.refusals
    assert refusal.startswith("hall:3:")
    assert "Traceback" not in refusal


PROGRAMMED = """
[[mic488]]
name = "table"
programs = { 0 = "a.prg", 1 = "a.prg" }
"""


def test_a_link_has_the_programs_as_they_are_now_or_says_why_it_cannot() -> None:
    async def visit() -> None:
        page = Page()
        page.twin = twin = PageTwin(page, "hall", PROGRAMMED, {"a.prg": b"n = 1\n"}, lambda: 0)
        twin.begin()
        await page.enter()
        assert json.loads(twin.link()) == {"description": PROGRAMMED, "programs": {"a.prg": "n = 1\n"}}
        await page.ask("download", controller="table", place="program 0", text="n = 2\n")
        assert "a.prg" in json.loads(twin.link())["refused"]
        await page.ask("download", controller="table", place="program 1", text="n = 2\n")
        assert json.loads(twin.link())["programs"] == {"a.prg": "n = 2\n"}
        await page.ask("download", controller="table", place="program 2", text="n = 3\n")
        assert "program 2" in json.loads(twin.link())["refused"]

    run_virtually(visit())


def test_a_twin_goes_on_from_a_kept_state_with_what_was_downloaded() -> None:
    async def visit() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        page = Page()
        page.twin = twin = PageTwin(page, "hall", PROGRAMMED, {"a.prg": b"n = 1\n"}, lambda: loop.now_ns)
        twin.begin()
        await page.enter()
        for place in ("program 0", "program 1"):
            await page.ask("download", controller="table", place=place, text="n = 2\n")
        await asyncio.sleep(3)
        other = Page()
        other.twin = again = PageTwin(other, "hall", PROGRAMMED, {"a.prg": b"n = 1\n"}, lambda: loop.now_ns, page.kept)
        again.begin()
        assert twin.world.now - SECOND <= again.world.now <= twin.world.now
        assert json.loads(again.link()) == {"description": PROGRAMMED, "programs": {"a.prg": "n = 2\n"}}
        # Time stands until somebody wants it to go.
        await other.enter()
        stood = again.world.now
        await asyncio.sleep(1)
        assert again.world.now == stood
        # Its beginning is not known, so there is no recording of it.
        assert (await other.ask("recordings"))["recording"] is None
        assert "is not recorded" in (await other.refusal("save_recording"))["message"]
        await other.ask("resume")
        await asyncio.sleep(1)
        assert again.world.now > stood
        await other.ask("download", controller="table", place="program 0", text="n = 3\n")
        assert page.errors == other.errors == []

    run_virtually(visit())


def test_a_link_has_no_file_that_is_no_program() -> None:
    async def visit() -> None:
        text = '[[mic488]]\nname = "table"\nconfig = "a.cfg"\n'
        config = (EXAMPLES / "mic488/feeder.cfg").read_bytes()
        assert "a.cfg" in json.loads(PageTwin(Page(), "hall", text, {"a.cfg": config}).link())["refused"]

    run_virtually(visit())


def test_the_editor_server_answers_in_its_worker() -> None:
    class Editor(Page):
        def send(self, number: int, text: str) -> None:
            self.messages.append(json.loads(text))

    async def visit() -> None:
        page = Editor()
        editor = PageEditor(page, {"steptwin:///table/P1.prg": b"a = 1\n"}).connections
        editor.open(1)
        editor.receive(1, json.dumps({"do": "hello", "token": None}))
        await asyncio.sleep(0.1)
        assert page.messages == [{"ok": None}]
        editor.receive(1, json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"capabilities": {}}}))
        await asyncio.sleep(0.1)
        assert page.messages[1]["result"]["serverInfo"]["name"]
        editor.close(1)
        await asyncio.sleep(0.1)
        assert page.events == [("opened", 1), ("closed", 1000)]

    run_virtually(visit())
