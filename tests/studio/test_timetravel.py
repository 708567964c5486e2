"""Time travel of viewers, in memory: what they are shown, and what they cannot do meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import pytest
from tests.support.studio_rig import OPERATOR, VIEWER, Studio, Tab

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Refusal
from steptwin.later import Later
from steptwin.simulation.world.snapshotlog import PastWorld, SnapshotLog
from steptwin.simulation.world.worldprograms import WorldPrograms
from steptwin.studio import timetravel
from steptwin.subject.debugcommands import (
    Branch,
    ClearBreakpoint,
    ListBreakpoints,
    LookAt,
    RunProgram,
    SetBreakpoint,
    SetValue,
    StepProgram,
    StopOn,
)
from steptwin.subject.subscriptions import EventBatch, Filter
from steptwin.subject.world import WorldSubject

T = TypeVar("T")


class Kept:
    """The past of the world of a studio, looked at at once."""

    def __init__(self, studio: Studio) -> None:
        self.snapshots = SnapshotLog(studio.world)
        self.open_views = 0
        self._studio = studio

    @property
    def begin(self) -> Nanos:
        return self.snapshots.begin

    def open(self) -> _View:
        if self.open_views:
            raise Refusal("too many")
        self.open_views += 1
        return _View(self, PastWorld(self.snapshots), self._studio.subject)

    def events(
        self, begin: Nanos, end: Nanos, what: Filter, bound: int, at_begin: Callable[[WorldSubject], T]
    ) -> Later[tuple[T, EventBatch]]:
        past = PastWorld(self.snapshots)
        for _ in past.go(begin):
            pass
        subject = WorldSubject(past.world)
        found = at_begin(subject)
        subscription = subject.subscribe(what, bound)
        for _ in past.go_on(end):
            pass
        later = Later[tuple[T, EventBatch]]()
        later.put((found, subscription.take()))
        return later


class _View:
    def __init__(self, kept: Kept, past: PastWorld, real: WorldSubject) -> None:
        self._kept, self._past, self._real = kept, past, real
        self.subject = WorldSubject(past.world)
        self.programs = WorldPrograms(past.world)

    @property
    def now(self) -> Nanos:
        return self._past.world.now

    def go(self, moment: Nanos) -> Later[None]:
        for _ in self._past.go(moment):
            pass
        later = Later[None]()
        later.put(None)
        return later

    def go_back(self) -> None:
        self._real.go_back(self._past.world.snapshot(), None)
        self._kept.snapshots.gone_back()

    def close(self) -> None:
        self._kept.open_views -= 1


@pytest.fixture
def studio() -> Studio:
    """M1 has moved from 0 mm to 20 mm from 1 s on; now it is 4 s later."""
    made = Studio(time_travel=Kept)
    tab = made.open()
    made.run(1000)
    tab.ok("enable", controller="table", axis=1)
    tab.ok("move", controller="table", axis=1, to=20)
    made.run(4000)
    tab.close()
    return made


def values(tab: Tab) -> dict[int, Any]:
    return dict(map(tuple, tab.newest("values")["1"]))


def test_the_past_is_shown_while_the_world_goes_on(studio: Studio) -> None:
    tab, other = studio.open(), studio.open()
    tab.ok("watch", points=["table.M1.position", "table.M1.status", "time"])
    tab.read()
    assert values(tab) == {0: 20.0, 1: 4, 2: 5.0}
    assert tab.ok("show_moment", to_ns=str(1200 * MILLISECOND)) == {"time_ns": "1200000000", "from_ns": "0"}
    tab.read()
    past = tab.newest("past")
    assert (past["time_ns"], past["from_ns"]) == ("1200000000", "0")
    assert past["state"]["table"]["axes"][0]["enabled"] is True
    assert [plan["axis"] for plan in past["plans"] if plan["plan"]["segments"]] == ["1"]
    seen = values(tab)
    assert 0.0 < seen[0] < 20.0
    assert seen[2] == 1.2
    # The same over requests, and for what is watched from now on.
    assert tab.ok("read", points=["table.M1.position"])[0]["value"] == seen[0]
    assert tab.ok("state", controller="table") == past["state"]["table"]
    tab.ok("watch", points=["time"])
    (message,) = tab.read()
    assert message["values"] == {"2": [[0, 1.2]]}
    # Others see the present, events go on, and what is shown stands.
    assert other.ok("read", points=["time"])[0]["value"] == 5.0
    tab.ok("subscribe", kinds=["note"], id=70)
    other.ok("note", text="later")
    studio.run(1000)
    messages = tab.read()
    assert [event["note"] for message in messages for event in message.get("events", ())] == ["later"]
    assert not any("values" in message for message in messages)
    # Another moment, then the present.
    tab.ok("show_moment", to_ns="0")
    tab.read()
    assert values(tab) == {0: 0.0, 1: 0, 2: 0.0}
    assert tab.ok("show_moment") is None
    studio.run(40)
    tab.read()
    assert tab.newest("past") is None
    assert values(tab)[0] == 20.0
    assert values(tab)[2] > 5.9


def test_who_looks_back_changes_nothing_but_may_stop(studio: Studio) -> None:
    tab = studio.open()
    tab.ok("show_moment", to_ns=str(SECOND))
    tab.read()
    may = tab.newest("past")["may"]
    assert {"read", "stop", "stop_all", "show_moment", "go_back"} <= set(may)
    assert not {"move", "write", "pause", "set", "jog"} & set(may)
    code, message = tab.error("move", controller="table", axis=1, to=3)
    assert (code, message) == ("refusal", "move: the past cannot be changed: return to the present first")
    assert tab.ok("stop", controller="table") == {"program": "stopped"}
    assert tab.ok("stop_all")["controllers"]
    tab.ok("show_moment")
    tab.ok("move", controller="table", axis=1, to=3)


def test_a_debugger_steps_from_the_past_but_values_are_not_set_there(studio: Studio) -> None:
    asked: list[object] = []
    kinds: tuple[type, ...] = (SetBreakpoint, ClearBreakpoint, StopOn, StepProgram, RunProgram, LookAt, Branch, SetValue)
    studio.subject.dispatcher.add(dict.fromkeys(kinds, asked.append))
    tab, other = studio.open(), studio.open("Anna")
    tab.ok("show_moment", to_ns=str(SECOND))
    tab.read()
    forwards = {"breakpoint", "clear_breakpoint", "stop_on", "step_program", "run", "look_at", "branch"}
    may = set(tab.newest("past")["may"])
    assert forwards <= may
    assert "set_value" not in may
    tab.ok("step_program", controller="table", way="over")
    tab.ok("breakpoint", label="MAIN")
    assert asked == [StepProgram("table", "over"), SetBreakpoint(label="MAIN")]
    assert tab.error("set_value", controller="table", name="n", expression="1")[1].startswith(
        "set_value: the past cannot be changed"
    )
    # It needs control, as what else changes the machine.
    assert other.error("run")[0] == "refusal"
    other.ok("take_control", over=True)
    other.ok("run")
    assert asked[2:] == [RunProgram("forwards")]
    assert tab.error("run")[1].startswith("run needs control, which Anna")


def test_a_viewer_sees_breakpoints_and_sets_none() -> None:
    studio = Studio(tokens=True)
    studio.subject.dispatcher.add({ListBreakpoints: lambda _: {"breakpoints": []}, RunProgram: lambda _: None})
    tab = studio.open(token=VIEWER)
    may = set(tab.messages[0]["hello"]["may"])
    assert {"breakpoints", "stack", "values", "evaluate"} <= may
    assert not {"breakpoint", "step_program", "run", "set_value", "branch"} & may
    assert tab.ok("breakpoints") == {"breakpoints": []}
    assert tab.error("run")[1].startswith("run is for the role operator")
    studio.open(token=OPERATOR).ok("run")


def test_the_whole_state_and_the_past_with_it(studio: Studio) -> None:
    tab = studio.open()
    tab.ok("watch", points=["time"])
    tab.ok("show_moment", to_ns=str(SECOND))
    tab.read()
    tab.ok("resync")
    messages = tab.read()
    assert [next(key for key in one if key not in ("seq", "time_ns")) for one in messages] == ["hello", "past", "values"]
    assert messages[0]["hello"]["time_ns"] == "5000000000"
    assert messages[2]["values"] == {"1": [[0, 1.0]]}


def test_moments_that_are_not_kept_are_refused(studio: Studio) -> None:
    tab = studio.open()
    assert tab.error("show_moment", to_ns=str(60 * SECOND)) == (
        "misuse",
        "60 s: the past is kept from 0 s to 5 s",
    )
    assert tab.error("go_back") == ("refusal", "this viewer is at the present")
    tab.ok("show_moment", to_ns="0")  # the first one has left nothing open
    other = studio.open()
    assert other.error("show_moment", to_ns="0") == ("refusal", "too many")
    tab.close()
    other.ok("show_moment", to_ns="0")


def test_the_world_goes_back_for_all(studio: Studio) -> None:
    tab, other = studio.open(), studio.open()
    other.ok("watch", points=["table.M1.position"])
    other.ok("subscribe", kinds=["restored"], id=71)
    other.read()
    tab.ok("show_moment", to_ns=str(1200 * MILLISECOND))
    seen = tab.ok("read", points=["table.M1.position"])[0]["value"]
    tab.ok("go_back")
    tab.read()
    assert tab.newest("past") is None
    assert studio.world.now == 1200 * MILLISECOND
    assert studio.value("table.M1.position") == seen
    studio.hub.tick(studio.now)
    (event,) = other.read()[-1]["events"]
    assert (event["kind"], event["snapshot"], event["text"]) == ("restored", None, "time went back to here")
    studio.run(4000)
    assert studio.value("table.M1.position") == 20.0


def test_going_back_is_for_who_holds_control(studio: Studio) -> None:
    tab, other = studio.open(), studio.open("Anna")
    other.ok("take_control")
    tab.ok("show_moment", to_ns="0")
    assert tab.error("go_back")[1].startswith("go_back needs control, which Anna")


def test_where_no_past_is_kept_nothing_is_offered() -> None:
    tab = Studio().open()
    assert not {"show_moment", "go_back"} & set(tab.messages[0]["hello"]["may"])
    assert tab.error("show_moment", to_ns="0") == ("refusal", "show_moment: no past is kept here")


def test_what_happened_before_a_viewer_came_can_be_asked_for(studio: Studio) -> None:
    tab = studio.open()
    found = tab.ok("past_events", from_ns="0", to_ns=str(4 * SECOND), kinds=["plan", "edge"])
    assert (found["from_ns"], found["to_ns"]) == ("0", str(4 * SECOND))
    assert found["state"]["table"]["axes"][0]["enabled"] is False
    assert [plan["plan"]["segments"] for plan in found["plans"]] == [[]] * len(found["plans"])
    moves = [event for event in found["events"] if event["kind"] == "plan" and event["plan"]["segments"]]
    assert [(event["time_ns"], event["axis"], event["plan"]["final"]) for event in moves] == [(str(SECOND), "1", 2000)]
    assert {event["kind"] for event in found["events"]} == {"plan", "edge"}
    assert tab.ok("read", points=["time"])[0]["value"] == 5.0, "the viewer still looks at the present"


def test_how_much_of_the_past_is_read_at_once_is_limited(studio: Studio) -> None:
    tab = studio.open()
    studio.run(61_000)
    for begin, end in ((0, 61 * SECOND), (2 * SECOND, SECOND)):
        assert tab.error("past_events", from_ns=str(begin), to_ns=str(end)) == (
            "misuse",
            f"past_events from {begin / SECOND:g} s to {end / SECOND:g} s: permitted is up to 60 s in one answer",
        )


def test_of_too_many_events_the_last_ones_are_left(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timetravel, "MOST_PAST_EVENTS", 1)
    found = studio.open().ok("past_events", from_ns="0", to_ns=str(4 * SECOND))
    assert (found["plans"], found["state"], len(found["events"])) == ([], {}, 1)
    assert found["from_ns"] == found["events"][0]["time_ns"]
