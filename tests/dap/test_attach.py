"""`steptwin dap` attached to a twin that runs in a process of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dap_client import DapClient, Refused
from debug_rig import WBC, running_twin
from tests.conftest import until

from steptwin.live.remote import ask
from steptwin.subject.commands import Pause, ReadPoints, Resume, Time
from steptwin.subject.debugcommands import ListBreakpoints


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[Path]:
    """The folder of a running twin called ``two``."""
    with running_twin(tmp_path):
        yield tmp_path


@pytest.fixture
def client() -> Iterator[DapClient]:
    client = DapClient()
    yield client
    assert client.close() == 0


def attach(client: DapClient, **arguments: object) -> None:
    client.ask("initialize", adapterID="steptwin")
    client.ask("attach", **arguments)
    client.event("initialized")


def line(client: DapClient) -> int:
    return client.ask("stackTrace", threadId=1)["stackFrames"][0]["line"]


def go(client: DapClient, command: str) -> dict[str, Any]:
    client.ask(command, threadId=1)
    return client.event("stopped")


def paused() -> bool:
    return ask("two", Time())["paused"]


def test_breakpoints_steps_and_the_past_of_a_running_twin(twin: Path, client: DapClient) -> None:
    attach(client, twin="two")
    source = {"path": str(twin / "m.prg")}
    (point,) = client.ask("setBreakpoints", source=source, breakpoints=[{"line": 7}])["breakpoints"]
    assert (point["verified"], point["line"]) == (True, 8)
    client.ask("configurationDone")
    stopped = client.event("stopped")
    assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("breakpoint", [point["id"]])
    assert paused()
    frame = client.ask("stackTrace", threadId=1)["stackFrames"][0]
    assert (frame["line"], frame["source"]["path"]) == (8, str(twin / "m.prg"))
    count = int(client.ask("evaluate", expression="n", frameId=1000)["result"])
    assert [go(client, "next") and line(client) for _ in range(2)] == [9, 10]
    assert [go(client, "stepBack") and line(client) for _ in range(2)] == [9, 8]
    go(client, "continue")  # through the past, to the breakpoint in the next round
    assert line(client) == 8
    assert int(client.ask("evaluate", expression="n", frameId=1000)["result"]) == count + 1
    pins = client.ask("variables", variablesReference=1003)["variables"]
    assert {"IN1", "OUT1"} <= {one["name"] for one in pins}
    assert client.ask("setVariable", variablesReference=1001, name="n", value="1000")["value"] == "1000"
    assert ask("two", ReadPoints(("time",)))[0]["quality"] == "good"
    go(client, "continue")
    assert client.ask("evaluate", expression="n", frameId=1000)["result"] == "1001"
    why = client.ask("evaluate", expression="why m.program", context="repl")["result"]
    assert why.startswith("m.program is 1, ")


def test_who_detaches_leaves_the_twin_as_it_was_found(twin: Path, client: DapClient) -> None:
    attach(client, twin=str(twin / "two.toml"), stopOnEntry=True)
    client.ask("configurationDone")
    assert client.event("stopped")["reason"] == "pause"
    assert paused()
    client.ask("disconnect")
    until(lambda: not paused(), "it goes on")


def test_a_twin_that_stands_goes_on_when_it_is_told_to(twin: Path, client: DapClient) -> None:
    ask("two", Pause())
    attach(client, twin="two")
    client.ask("configurationDone")
    assert client.event("stopped")["reason"] == "pause"
    assert paused()
    client.ask("continue", threadId=1)
    until(lambda: not paused(), "it goes on")


@pytest.mark.parametrize("is_terminated", [False, True])
def test_an_editor_that_ends_leaves_the_twin_as_it_was_found(twin: Path, is_terminated: bool) -> None:
    client = DapClient()
    attach(client, twin="two")
    client.ask("setBreakpoints", source={"path": str(twin / "m.prg")}, breakpoints=[{"line": 7}])
    client.ask("setExceptionBreakpoints", filters=["limit"])
    client.ask("configurationDone")
    client.event("stopped")
    if is_terminated:
        client.process.terminate()
    client.end()
    assert not paused()
    assert ask("two", ListBreakpoints()) == {"breakpoints": [], "stop_on": [], "stop": None}


def test_what_others_do_is_seen(twin: Path, client: DapClient) -> None:
    attach(client)
    client.ask("configurationDone")
    with pytest.raises(Refused, match="pause it first"):
        client.ask("stackTrace", threadId=1)
    ask("two", Pause())
    assert client.event("stopped")["reason"] == "pause"
    ask("two", Resume())
    client.event("continued")
    client.ask("pause", threadId=1)
    assert client.event("stopped")["reason"] == "pause"


def test_logs_labels_and_texts_without_files(twin: Path, client: DapClient) -> None:
    (twin / "m.prg").unlink()
    attach(client, twin="two")
    named = {source["name"]: source for source in client.ask("loadedSources")["sources"]}
    assert set(named) == {"m, m.prg", "c.m1486"}
    source = named["m, m.prg"]
    assert client.ask("source", sourceReference=source["sourceReference"])["content"] == WBC
    client.ask("setBreakpoints", source=source, breakpoints=[{"line": 9, "logMessage": "n is {n}"}])
    client.ask("configurationDone")
    client.event("output", lambda body: "n is" in body["output"])
    (label, wrong) = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "@2"}, {"name": "CUONT"}])["breakpoints"]
    assert (label["verified"], wrong["verified"]) == (True, False)
    stopped = client.event("stopped")
    assert (stopped["reason"], stopped["threadId"]) == ("function breakpoint", 2)


def test_what_cannot_be_attached_to_has_its_reason(client: DapClient) -> None:
    with pytest.raises(Refused, match="no twin"):
        client.ask("attach", twin="nowhere")
    with pytest.raises(Refused, match="twin = 5: expected the name"):
        client.ask("attach", twin=5)
    with pytest.raises(Refused, match="nothing was launched"):
        client.ask("threads")
