"""Viewers of a studio in memory: what they may, what they are sent, what of it waits."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.support.studio_rig import ENGINEER, OPERATOR, TOKENS, VIEWER, Studio, Tab, check_message

from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.controller import MILLISECOND
from steptwin.errors import Refusal
from steptwin.studio import viewersession
from steptwin.studio.hub import MOST_VIEWERS
from steptwin.studio.requests import ALL
from steptwin.studio.viewersession import ViewerSession
from steptwin.subject.commands import VERSION, StopAxes
from steptwin.subject.dispatch import command_of
from steptwin.subject.subscriptions import filter_of


def kinds(messages: list[dict[str, Any]]) -> list[str]:
    return [next(key for key in message if key not in ("seq", "time_ns", "missed")) for message in messages]


# ---------------------------------------------------------------------- hello


def test_hello_is_answered_and_followed_by_the_whole_state() -> None:
    studio = Studio()
    tab = Tab(studio)
    assert tab.session.take(studio.now) == []
    assert tab.ok("hello", name="Anna", lang="pl") == {"viewer": 1, "name": "Anna", "role": "engineer"}
    (hello,) = tab.read()
    whole = hello["hello"]
    assert (whole["viewer"], whole["viewers"], whole["control"], whole["virtual"]) == (1, 1, None, True)
    assert [one["name"] for one in whole["description"]["controllers"]] == ["table", "drum"]
    assert set(whole["state"]) == {"table", "drum"}
    axes = [("table", "1"), ("table", "2"), ("table", "3"), ("table", "4"), ("drum", "1")]
    assert [(plan["controller"], plan["axis"]) for plan in whole["plans"]] == axes
    assert {"move", "jog", "save", "audit"} <= set(whole["may"])
    assert tab.read() == []


def test_a_client_of_another_version_is_refused_with_both_versions() -> None:
    tab = Tab(Studio())
    old = "hello: version is missing, as in version 1 of the protocol: this studio has version 2"
    error = rest(tab.session, tab.studio, "hello")["error"]
    assert (error["code"], error["message"]) == ("misuse", old)
    assert tab.error("hello", version=1) == ("misuse", "version = 1: this subject has version 2")
    assert not tab.session.has_entered
    tab.ok("hello")
    assert tab.error("time", version=1) == ("misuse", "version = 1: this subject has version 2")


def test_nothing_but_stops_is_done_before_hello() -> None:
    tab = Tab(Studio())
    assert tab.error("read", points=["time"]) == ("refusal", "read: the first request is hello")
    assert tab.error("move", controller="table", axis=1, to=1)[0] == "refusal"
    assert tab.ok("stop", controller="table") == {"program": "stopped"}
    assert tab.ok("stop_all") == {"controllers": ["table", "drum"], "scripts": []}
    tab.ok("hello")
    assert tab.error("hello")[0] == "misuse"


def test_a_wrong_token_is_refused_and_the_connection_is_to_be_cut_off() -> None:
    tab = Tab(Studio(tokens=True))
    assert tab.error("hello") == (
        "refusal",
        "no token: it is in the address that the studio prints on a terminal, and in its file of tokens",
    )
    assert tab.session.is_refused
    tab = Tab(Studio(tokens=True))
    assert tab.error("hello", token="engineer-012345678") == ("refusal", "wrong token")
    assert tab.session.is_refused


def test_who_has_no_token_is_asked_for_one_when_a_device_comes() -> None:
    """As in the demo: until then only what reaches devices needs it."""
    has_device = False
    gate = AccessGate(TOKENS, open_to=Role.ENGINEER, is_open=lambda: not has_device)
    studio = Studio(gate=gate)
    stranger, owner, script = studio.open(), studio.open(token=ENGINEER), studio.rest()
    asked = ["connect", "scan", "verify", "work", "cancel_work"]
    assert {*stranger.newest("hello")["with_token"]} == {*asked}
    assert owner.newest("hello")["with_token"] == []
    assert {*asked} - {*stranger.newest("hello")["may"]} == {*asked}
    assert stranger.error("scan") == ("refusal", "scan needs the token of this studio, which is in its file of tokens")
    assert owner.error("scan") == ("misuse", "there are no lines here")
    stranger.ok("enable", controller="table", axis=1)
    has_device = True
    assert (stranger.session.is_refused, owner.session.is_refused) == (True, False)
    assert stranger.error("move", controller="table", axis=1, to=1)[1].startswith("no token")
    stranger.ok("stop", controller="table")
    assert "no token" in str(script.receive('{"do": "state", "controller": "table"}', 0).result())
    owner.ok("state", controller="table")
    assert Tab(studio).error("hello", token="wrong-0123456789") == ("refusal", "wrong token")
    has_device = False
    stranger.ok("move", controller="table", axis=1, to=1)


def test_resync_gives_the_whole_state_and_counts_from_there() -> None:
    studio = Studio()
    tab = studio.open()
    tab.ok("watch", points=["table.M1.position"])
    tab.ok("enable", controller="table", axis=1)
    studio.run(100)
    assert len(tab.read()) > 1
    tab.ok("resync")
    messages = tab.read()
    assert kinds(messages) == ["hello", "values"]  # values are not in the state, so all of them follow
    assert messages[0]["hello"]["state"]["table"]["axes"][0]["enabled"] is True
    assert messages[0]["hello"]["control"]["viewer"] == 1


def test_no_more_viewers_than_there_is_room_for() -> None:
    studio = Studio()
    tabs = [studio.open() for _ in range(MOST_VIEWERS)]
    assert Tab(studio).error("hello") == ("refusal", f"there are {MOST_VIEWERS} viewers already, the most possible")
    tabs[0].close()
    studio.open()


# ---------------------------------------------------------------------- roles and control


def test_roles_may_what_their_tokens_say() -> None:
    studio = Studio(tokens=True)
    viewer, operator = studio.open(token=VIEWER), studio.open(token=OPERATOR)
    assert viewer.ok("read", points=["table.M1.position"])[0]["value"] == 0.0
    code, message = viewer.error("enable", controller="table", axis=1)
    assert (code, message) == ("refusal", "enable is for the role operator; hall has the role viewer")
    assert viewer.ok("stop", controller="table") == {"program": "stopped"}
    operator.ok("enable", controller="table", axis=1)
    assert operator.error("fault", fault="crc nth=3")[1] == "fault is for the role engineer; piotr has the role operator"
    assert operator.error("audit")[0] == "refusal"
    assert "fault" not in operator.messages[0]["hello"]["may"]
    assert "move" not in viewer.messages[0]["hello"]["may"]


def test_two_viewers_see_the_same_and_hand_control_over() -> None:
    studio = Studio()
    anna, piotr = studio.open("Anna"), studio.open("Piotr")
    anna.ok("enable", controller="table", axis=1)
    for tab in (anna, piotr):
        tab.read()
        assert tab.newest("control") == {"viewer": 1, "name": "Anna"}
        assert tab.newest("viewers") == 2 if tab is anna else True
    code, message = piotr.error("move", controller="table", axis=1, to=5)
    assert (code, message) == (
        "refusal",
        "move needs control, which Anna (viewer 1) holds: take it over first",
    )
    assert piotr.error("take_control")[0] == "refusal"
    piotr.ok("take_control", over=True)
    piotr.ok("move", controller="table", axis=1, to=5)
    assert anna.error("move", controller="table", axis=1, to=0)[0] == "refusal"
    anna.ok("stop", controller="table", axis=1)
    piotr.close()
    anna.read()
    assert anna.newest("control") is None
    assert anna.newest("viewers") == 1
    anna.ok("move", controller="table", axis=1, to=0)


def test_a_refused_act_takes_no_control() -> None:
    studio = Studio()
    tab = studio.open()
    assert tab.error("enable", controller="nowhere", axis=1)[0] == "misuse"
    assert studio.hub.control.holder is None


def test_the_audit_log_has_who_did_what_with_which_outcome() -> None:
    studio = Studio(tokens=True)
    anna, hall = studio.open(token=ENGINEER), studio.open(token=VIEWER)
    anna.ok("enable", controller="table", axis=1)
    anna.error("move", controller="table", axis=9, to=1)
    anna.ok("read", points=["time"])
    hall.error("move", controller="table", axis=1, to=1)
    hall.ok("stop", controller="table")
    entries = [(one["viewer"], one["do"], one["outcome"]) for one in anna.ok("audit")]
    assert entries == [
        ("anna (viewer 1)", "enable", "done"),
        ("anna (viewer 1)", "move", "misuse"),
        ("hall (viewer 2)", "move", "refusal"),
        ("hall (viewer 2)", "stop", "done"),
    ]


# ---------------------------------------------------------------------- values and events


def test_values_come_when_they_have_changed_and_not_more_often_than_asked() -> None:
    studio = Studio()
    tab = studio.open()
    watch = tab.ok("watch", points=["table.M1.position", "table.M2.position", "drum.counter"], rate=10)
    assert watch["points"][0] == {"point": "table.M1.position", "unit": "mm"}
    (first,) = tab.read()
    assert first["values"] == {"1": [[0, 0.0], [1, 0.0], [2, 0.0]]}
    studio.run(1000)
    assert "values" not in kinds(tab.read())
    tab.ok("enable", controller="table", axis=1)
    tab.ok("move", controller="table", axis=1, to=100)
    found = []
    for _ in range(100):
        studio.run(10)
        found += [one for one in tab.read() if "values" in one]
    assert 8 <= len(found) <= 11
    assert all([index for index, _ in one["values"]["1"]] == [0] for one in found)
    assert found[-1]["values"]["1"][0][1] == pytest.approx(studio.value("table.M1.position"), abs=5)
    tab.ok("unwatch", watch=watch["watch"])
    assert tab.error("unwatch", watch=watch["watch"]) == ("misuse", "unwatch: no watch 1; there are none")
    studio.run(500)
    assert "values" not in kinds(tab.read())


def test_at_the_highest_rate_values_and_events_come_with_every_tick_although_they_are_taken_a_little_later() -> None:
    studio = Studio()
    tab = studio.open()
    tab.ok("watch", points=["time"], rate=30)
    tab.ok("subscribe", id="all")
    tab.read()
    found = []
    for _ in range(30):
        studio.run(1000 / 30)
        tab.ok("note", text="tick")
        found += [json.loads(text) for text in tab.session.take(studio.now + 2 * MILLISECOND)]
    assert sum("values" in one for one in found) >= 29
    assert sum("events" in one for one in found) >= 28


def test_points_are_read_once_for_all_viewers(monkeypatch: pytest.MonkeyPatch) -> None:
    studio = Studio()
    tabs = [studio.open() for _ in range(20)]
    for n, tab in enumerate(tabs):
        tab.ok("watch", points=["table.M1.position", "time"] if n % 2 else ["time"], rate=30)
    read: list[tuple[str, ...]] = []
    actual = studio.subject.read
    monkeypatch.setattr(studio.subject, "read", lambda *points: (read.append(points), actual(*points))[1])
    studio.run(1000)
    assert 25 <= len(read) <= 31
    assert {tuple(sorted(points)) for points in read} == {("table.M1.position", "time")}
    assert all(tab.read()[-1]["values"] for tab in tabs)


def test_a_wrong_point_is_named() -> None:
    code, message = Studio().open().error("watch", points=["table.M1.position", "table.M1.colour"])
    assert code == "misuse"
    assert "colour" in message


class _Bounds(Mock):
    """A history that says between which moments it is read."""

    def gateways(self) -> tuple[()]:
        return ()

    async def values(self, points: object, run: int, begin_s: float, end_s: float | None) -> None:
        raise Refusal(f"{begin_s} to {end_s}")

    async def writes(self, run: int, begin_s: float, end_s: float | None) -> None:
        raise Refusal(f"{begin_s} to {end_s}")

    async def compare(self, points: object, runs: object, begin_s: float, end_s: float | None) -> None:
        raise Refusal(f"{begin_s} to {end_s}")


@pytest.mark.parametrize(
    ("name", "fields"),
    [("history_values", {"points": ["x"]}), ("history_writes", {}), ("compare_history", {"run": 1, "other": 2})],
)
def test_an_interval_of_the_history_goes_from_its_beginning_to_its_end(name: str, fields: dict[str, Any]) -> None:
    studio = Studio()
    studio.hub.around = replace(studio.hub.around, services=_Bounds())
    tab = studio.open()
    assert tab.error(name, **fields, from_s=1, to_s=2.5) == ("refusal", "1.0 to 2.5")
    assert tab.error(name, **fields) == ("refusal", "0.0 to None")


def test_events_come_once_however_many_follows_want_them() -> None:
    studio = Studio()
    tab = studio.open()
    assert len(tab.ok("subscribe", id="a", kinds=["plan"])["plans"]) == 5
    tab.ok("subscribe", id="b", kinds=["plan", "edge"], controllers=["table"])
    tab.ok("enable", controller="table", axis=1)
    tab.ok("move", controller="table", axis=1, to=1)
    studio.run(100)
    (batch,) = [one for one in tab.read() if "events" in one]
    assert batch["missed"] == 0
    numbers = [event["number"] for event in batch["events"]]
    assert numbers == sorted(set(numbers))
    assert {event["kind"] for event in batch["events"]} == {"plan", "edge"}
    tab.ok("unsubscribe", subscription="b")
    tab.ok("set", levels={"table.IN3": 1})
    tab.ok("unsubscribe", subscription="a")
    tab.ok("move", controller="table", axis=1, to=0)
    studio.run(100)
    assert "events" not in kinds(tab.read())
    assert tab.error("unsubscribe", subscription="a")[0] == "misuse"


def test_between_the_whole_state_and_the_events_after_it_nothing_is_lost() -> None:
    studio = Studio()
    control = studio.open()
    control.ok("enable", controller="table", axis=1)
    everything = studio.subject.subscribe(filter_of(["plan", "edge"]), 1000)
    tabs = []
    for phase in range(60):
        if phase % 7 == 0:
            control.ok("set", levels={"table.IN3": phase % 2})
        if phase % 10 == 0:
            control.ok("move", controller="table", axis=1, to=phase % 20)
        tab = Tab(studio)
        tab.ok("hello", kinds=["plan", "edge"])
        tabs.append(tab)
        studio.run(15)
        if phase % 3:  # it reads only later
            tab.read()
    control.ok("set", levels={"table.IN3": 1})
    studio.run(1000)
    events = [event.to_json() for event in everything.take()[1]]
    assert len({event["time_ns"] for event in events}) > 10
    for tab in tabs:
        tab.read()
        begin = tab.newest("hello")["number"]
        came = [event for one in tab.messages for event in one.get("events", ())]
        assert came == [event for event in events if event["number"] > begin]


def test_what_waits_is_not_lost_when_another_follow_begins() -> None:
    studio = Studio()
    tab = studio.open()
    tab.ok("subscribe", id="a", kinds=["edge"])
    tab.ok("set", levels={"table.IN3": 1})
    tab.ok("subscribe", id="b", kinds=["note"])
    tab.ok("note", text="now")
    studio.run(100)
    (batch,) = [one for one in tab.read() if "events" in one]
    assert [event["kind"] for event in batch["events"]] == ["edge", "note"]


def test_a_slow_reader_loses_the_oldest_events_and_is_told_how_many() -> None:
    studio = Studio()
    slow, quick = studio.open(), studio.open()
    for tab in (slow, quick):
        tab.ok("subscribe", id="a", kinds=["note"], bound=100)
    seen: list[str] = []
    for n in range(1000):
        studio.world.apply_input(note_input(n))
        if n % 50 == 0:
            studio.run(40)
            seen += [event["note"] for one in quick.read() if "events" in one for event in one["events"]]
    studio.run(40)
    (batch,) = [one for one in slow.read() if "events" in one]
    assert batch["missed"] == 900
    assert [event["note"] for event in batch["events"]] == [str(n) for n in range(900, 1000)]
    seen += [event["note"] for one in quick.read() if "events" in one for event in one["events"]]
    assert seen == [str(n) for n in range(1000)]


def note_input(n: int) -> Any:
    from steptwin.simulation.script.steps import Note

    return Note(str(n))


def test_two_streams_of_frames_and_plans_do_not_mix() -> None:
    studio = Studio()
    frames, plans = studio.open(), studio.open()
    frames.ok("subscribe", id=1, kinds=["frame"])
    plans.ok("subscribe", id=1, kinds=["plan"])
    plans.ok("enable", controller="table", axis=1)
    plans.ok("move", controller="table", axis=1, to=1)
    studio.run(100)
    assert {event["kind"] for one in frames.read() if "events" in one for event in one["events"]} == {"frame"}
    assert {event["kind"] for one in plans.read() if "events" in one for event in one["events"]} == {"plan"}


def test_the_clock_comes_once_a_second_and_when_time_goes_otherwise() -> None:
    studio = Studio()
    tab = studio.open()
    studio.run(50)
    tab.read()
    studio.run(2900)
    studio.speed = 2.0
    studio.run(100)
    clocks = [one["clock"] for one in tab.read() if "clock" in one]
    assert clocks == [{"time_ns": str(clocks[0]["time_ns"]), "running": True, "speed": 2.0}]  # the newest alone
    assert int(clocks[0]["time_ns"]) > 2900 * MILLISECOND


def test_the_clock_comes_also_where_time_stands() -> None:
    """A page that hears nothing takes the studio for lost."""
    studio = Studio()
    studio.speed = 0.0
    tab = studio.open()
    studio.run(1100)
    tab.read()
    for _ in range(3):
        studio.run(1100)
        assert [one["clock"]["time_ns"] for one in tab.read() if "clock" in one] == [str(studio.world.now)]


# ---------------------------------------------------------------------- whatever comes


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
STUDIO = Studio()
FIELDS = st.sampled_from(["controller", "axis", "to", "points", "lease", "x"])


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.sampled_from([*ALL, "", "jogg"]), st.dictionaries(FIELDS, JSON))
def test_whatever_the_fields_are_there_is_one_answer_and_nothing_breaks(name: str, fields: dict[str, Any]) -> None:
    entered = Tab(STUDIO)
    entered.session.receive('{"do": "hello", "version": 2}', STUDIO.now)
    for one in (Tab(STUDIO), entered):
        answer = one.session.receive(json.dumps({"do": name, **fields}), STUDIO.now).result()
        check_message(answer)
        one.close()
    assert STUDIO.errors == []


@settings(deadline=None)
@given(st.text() | st.binary().map(lambda data: data.decode("latin-1")))
def test_whatever_the_text_is_there_is_one_answer(text: str) -> None:
    tab = Tab(STUDIO)
    check_message(tab.session.receive(text, STUDIO.now).result())
    assert STUDIO.errors == []


HOSTILE = [
    "", "null", "[]", "[" * 60_000, '{"do": "hello", ' * 1000, '{"do": 5}', "x" * 100_000, "\ud800",
    '{"do":"read","points":' + "[" * 30_000, '{"do": "hello", "id": {}}', '{"do": "hello", "version": true}',
    '{"do": "hello", "token": "' + "a" * 60_000 + '"}',
]  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: ascii(text[:16]))
def test_hostile_messages_are_answered_with_an_error(text: str) -> None:
    tab = Tab(Studio())
    answer: Any = tab.session.receive(text, 0).result()
    assert answer["error"]["code"] == "misuse"
    assert len(answer["error"]["message"]) < 3000


def test_too_many_requests_are_refused_but_stops_are_done() -> None:
    studio = Studio()
    tab = studio.open()
    outcomes = [tab.ask("time").get("error", {}).get("code", "ok") for _ in range(1100)]
    assert outcomes.count("ok") == int(viewersession.BURST) - 1
    assert outcomes[-1] == "refusal"
    assert tab.ok("stop", controller="table") == {"program": "stopped"}
    studio.run(1000)
    tab.ok("time")


# ---------------------------------------------------------------------- without a connection


def rest(session: ViewerSession, studio: Studio, name: str, **fields: object) -> Any:
    return session.receive(json.dumps({"do": name, **fields}), studio.now).result()


def test_who_asks_over_rest_needs_no_hello_and_has_no_stream() -> None:
    studio = Studio()
    session = studio.rest()
    assert rest(session, studio, "enable", controller="table", axis=1)["ok"] is None
    assert studio.hub.control.holder is None  # it acted while nobody held control, and holds none
    error = rest(session, studio, "watch", points=["time"])["error"]
    assert (error["code"], error["message"]) == ("refusal", "watch is about a connection: ask it over the WebSocket")
    assert session.take(studio.now) == []


def test_control_taken_over_rest_passes_when_nothing_is_asked() -> None:
    studio = Studio()
    session, tab = studio.rest(), studio.open()
    rest(session, studio, "take_control")
    assert tab.error("enable", controller="table", axis=1)[0] == "refusal"
    studio.run(59_000)
    assert tab.error("enable", controller="table", axis=1)[0] == "refusal"
    studio.run(2_000)
    tab.ok("enable", controller="table", axis=1)


def test_a_role_holds_over_rest_too() -> None:
    studio = Studio()
    assert rest(studio.rest(Role.VIEWER), studio, "enable", controller="table", axis=1)["error"]["code"] == "refusal"
    assert rest(studio.rest(Role.VIEWER), studio, "enable")["error"]["code"] == "misuse"
    assert rest(studio.rest(Role.VIEWER), studio, "stop_all")["ok"]["controllers"]


def test_a_stop_of_version_1_stops_and_nothing_else_of_it_is_done() -> None:
    """It names its controller `machine`; a hello with version 2 does not come before each stop, and never over REST."""
    tab = Studio().open()
    assert tab.ok("stop", machine="table", axis=1) == tab.ok("stop", controller="table", axis=1)
    assert command_of({"do": "stop", "machine": "table"}) == StopAxes("table")
    refused = [
        tab.ask("move", machine="table", axis=1, to=1.0),
        tab.ask("stop", machine="table", version=VERSION),
    ]
    assert all("no field 'machine'; fields are controller" in one["error"]["message"] for one in refused)
