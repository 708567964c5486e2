"""Questions while a world goes on, in the virtual time of the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from tests.live.test_pace import Rig

from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import result_of
from steptwin.files.world import World
from steptwin.later import start
from steptwin.live import why as module
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.subject.commands import read_command
from steptwin.why import pastquestions

Run = Callable[..., Any]

LAMP = """
[world]
name = "lamp"
[[mic488]]
name = "cell"
program = "lamp.prg"
start = true
[[button]]
name = "go"
to = "cell.IN1"
"""
PROGRAM = b"""WAIT IN1 = ON
OUT1 = ON
MAIN:
    WAIT IN2 = ON
    WAIT IN2 = OFF
JUMP MAIN
"""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow this machine is now."""
    monkeypatch.setattr(module, "PART_S", 3600.0)


class Asked(Rig):
    """A live world with questions."""

    def __init__(self, world: World | None = None) -> None:
        super().__init__(world or World.from_toml(LAMP, {"lamp.prg": PROGRAM}))

    def begin_time_travel(self) -> WorldTimeTravel:
        return WorldTimeTravel(self.live, self.realtime, self.pace)

    async def why(self, question: str | None = None, **fields: object) -> Any:
        asked = {"question": question, **fields}
        return (await result_of(start(self.control.answer(read_command("why", asked))))).value


def links(answer: Any) -> list[str]:
    return [link["text"] for link in answer["links"]]


def test_the_answer_is_that_of_the_session(run: Run) -> None:
    async def scene() -> None:
        rig = Asked()
        rig.begin_time_travel()
        await asyncio.sleep(1)
        rig.do("press", button="go")
        await asyncio.sleep(2)
        for question in ("cell", "cell.OUT1 == 1", "IN2", "cell.program"):
            told = await rig.why(question)
            assert told["text"] == rig.world.why(question).text()
        assert links(await rig.why("OUT1"))[-1] == "from outside: presses go"
        tried = (await rig.why("OUT1", try_without=True))["trials"]
        assert [(one["effect"], one["without"]) for one in tried] == [("otherwise", "cell.OUT1 is 0")]
        rig.close()

    run(scene())


def test_a_chain_is_followed_to_older_states(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []
    monkeypatch.setattr(
        pastquestions,
        "_Known",
        lambda snapshots, at, *more, real=pastquestions._Known: made.append(at) or real(snapshots, at, *more),
    )

    async def scene() -> None:
        rig = Asked()
        rig.begin_time_travel()
        await asyncio.sleep(1)
        rig.do("press", button="go")
        await asyncio.sleep(300)
        assert links(await rig.why("OUT1"))[-1] == "from outside: presses go"
        assert len(made) == 2  # 5 s, and about the last change
        await asyncio.sleep(1)
        rig.do("set", levels={"cell.IN2": 1})
        assert links(await rig.why("IN2")) == ["cell.IN2 became 1", "from outside: sets cell.IN2 = 1"]
        assert (await rig.why("cell"))["state"] == "cell waits at line 4 `WAIT IN2 = ON`"
        await asyncio.sleep(1)
        assert (await rig.why("cell"))["state"] == "cell waits at line 5 `WAIT IN2 = OFF`"
        count = len(made)
        assert (await rig.why("cell"))["state"] == "cell waits at line 5 `WAIT IN2 = OFF`"
        assert len(made) == count
        assert (await rig.why("OUT1 == 0", at_ns=500_000_000))["state"] == "cell.OUT1 == 0 is true"
        rig.close()

    run(scene())


def test_what_was_before_the_past_that_is_kept_is_not_known(run: Run) -> None:
    async def scene() -> None:
        rig = Asked()
        await asyncio.sleep(1)
        rig.do("press", button="go")
        await asyncio.sleep(1)
        with pytest.raises(Refusal, match=r"no past is kept here: start the twin with 'steptwin up --past' or in the studio"):
            await rig.why("OUT1")
        rig.begin_time_travel()
        await asyncio.sleep(3)
        assert (await rig.why("OUT1"))["text"].splitlines() == [
            "cell.OUT1 is 1, since before 2.000000 s (at 5 s)",
            "    5.000000 s  cell       cell.OUT1 is 1 since before 2.000000 s",
            "    5.000000 s  cell       no way leads from line 4 `WAIT IN2 = ON` to line 2 `OUT1 = ON`",
            "                (what was before 2.000000 s is not known)",
        ]
        assert (await rig.why("cell"))["text"].splitlines() == [
            "cell waits at line 4 `WAIT IN2 = ON`, since before 2.000000 s (at 5 s)",
            "    5.000000 s  cell       cell.IN2 is 0 since before 2.000000 s, to which nothing is wired",
            "    2.000000 s  cell       line 4 `WAIT IN2 = ON` was in execution before",
            "                (what was before 2.000000 s is not known)",
        ]
        with pytest.raises(Misuse, match=r"0\.001 us: the past is kept from 2 s to 5 s"):
            await rig.why("cell", at_ns="1")
        with pytest.raises(Misuse, match="no signal 'nope'"):
            await rig.why("nope")
        rig.close()

    run(scene())


def test_a_moving_axis_began_to_move_before(run: Run) -> None:
    async def scene() -> None:
        rig = Asked()
        rig.do("enable", controller="cell", axis=1)
        rig.do("jog", controller="cell", axis=1, velocity=5)
        await asyncio.sleep(1)
        rig.begin_time_travel()
        await asyncio.sleep(1)
        told = await rig.why("cell.M1.position")
        assert links(told) == ["cell.M1 began to move"]
        assert told["links"][0]["time_ns"] == "0"
        assert not told["complete"]
        rig.close()

    run(scene())


def test_a_world_that_went_back_has_another_past(run: Run) -> None:
    async def scene() -> None:
        rig = Asked()
        rig.begin_time_travel()
        rig.do("snapshot", name="begin")
        await asyncio.sleep(1)
        rig.do("press", button="go")
        await asyncio.sleep(1)
        assert (await rig.why("OUT1"))["state"] == "cell.OUT1 is 1"
        rig.do("restore", name="begin")
        assert (await rig.why("OUT1"))["state"] == "cell.OUT1 is 0"
        rig.do("set", levels={"cell.IN2": 1})
        assert (await rig.why("IN2"))["state"] == "cell.IN2 is 1"
        rig.close()

    run(scene())


def test_a_question_that_is_too_long_leaves_what_is_known(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pastquestions, "MOST_NOTED", 3)

    async def scene() -> None:
        rig = Asked()
        rig.begin_time_travel()
        await asyncio.sleep(1)
        rig.do("press", button="go")
        with pytest.raises(Misuse, match="more than 3 records and statements since 0 s: too many to search"):
            await asyncio.gather(asyncio.sleep(1), rig.why("OUT1"))
        rig.close()

    run(scene())


def test_questions_wait_for_each_other_and_are_bounded(run: Run) -> None:
    async def scene() -> None:
        rig = Asked()
        rig.begin_time_travel()
        await asyncio.sleep(1)
        given = [start(rig.control.answer(read_command("why", {"question": "OUT1"}))) for _ in range(18)]
        told = await asyncio.gather(*(result_of(one) for one in given), return_exceptions=True)
        texts = [one.value["state"] if not isinstance(one, BaseException) else str(one) for one in told]
        refused = "too many questions: the limit is 16; wait for an answer"
        assert set(texts) <= {"cell.OUT1 is 0", refused}
        assert texts[0] == "cell.OUT1 is 0"
        rig.close()

    run(scene())
