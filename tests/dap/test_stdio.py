"""`steptwin dap` as a process, asked by a client of our own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from dap_client import LONG_S, DapClient, Refused
from debug_rig import BOTH, CHIP, WBC

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def client() -> Iterator[DapClient]:
    client = DapClient()
    yield client
    assert client.close() == 0


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "Förderer.prg"
    path.write_text(WBC, encoding="utf-8")
    return str(path)


def where(client: DapClient, thread: int = 1) -> tuple[str, int]:
    frame = client.ask("stackTrace", threadId=thread)["stackFrames"][0]
    return frame["name"], frame["line"]


def go(client: DapClient, command: str, thread: int = 1) -> dict[str, object]:
    client.ask(command, threadId=thread)
    return client.event("stopped")


def test_a_session_forwards_and_backwards(client: DapClient, program: str) -> None:
    assert client.ask("initialize", adapterID="x")["supportsStepBack"] is True
    client.ask("launch", program=program, stopOnEntry=True)
    client.event("initialized")
    (point,) = client.ask("setBreakpoints", source={"path": program}, breakpoints=[{"line": 7}])["breakpoints"]
    assert (point["verified"], point["line"]) == (True, 8)
    client.ask("configurationDone")
    assert client.event("stopped")["reason"] == "entry"
    assert client.ask("threads") == {"threads": [{"id": 1, "name": "mic488"}]}
    assert where(client) == ("program", 1)
    stopped = go(client, "continue")
    assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("breakpoint", [point["id"]])
    assert where(client) == ("COUNT", 8)
    assert [go(client, "stepIn") and where(client)[1] for _ in range(2)] == [9, 10]
    assert [go(client, "stepBack") and where(client)[1] for _ in range(4)] == [9, 8, 4, 3]
    stopped = go(client, "reverseContinue")
    assert (stopped["reason"], stopped["text"]) == ("pause", "no older moment is kept")
    go(client, "continue")
    go(client, "continue")
    assert where(client) == ("COUNT", 8)
    assert client.ask("evaluate", expression="n + 0.5", frameId=1000)["result"] == "2.5"
    stack = client.ask("stackTrace", threadId=1)["stackFrames"]
    assert [(frame["name"], frame["line"]) for frame in stack][:2] == [("COUNT", 8), ("MAIN", 5)]
    assert stack[0]["source"]["path"] == program
    why = client.ask("evaluate", expression="why", frameId=1000, context="repl")["result"]
    assert why.startswith("mic488 does not wait: line ")
    go(client, "stepOut")
    assert where(client)[1] == 5


def test_values_are_shown_and_set(client: DapClient, program: str) -> None:
    client.launch(program=program, stopOnEntry=True)
    client.ask("configurationDone")
    client.event("stopped")
    scopes = {scope["name"]: scope["variablesReference"] for scope in client.ask("scopes", frameId=1000)["scopes"]}
    assert list(scopes)[:3] == ["Variables", "Axes", "Pins"]
    go(client, "next")
    (n,) = client.ask("variables", variablesReference=scopes["Variables"])["variables"]
    assert (n["name"], n["value"]) == ("n", "0")
    assert client.ask("setVariable", variablesReference=scopes["Variables"], name="n", value="41")["value"] == "41"
    go(client, "next")
    assert client.ask("evaluate", expression="n", frameId=1000, context="hover")["result"] == "42"
    assert client.ask("setExpression", expression="IN3", value="1", frameId=1000)["value"] == "1"
    pins = {one["name"]: one["value"] for one in client.ask("variables", variablesReference=scopes["Pins"])["variables"]}
    assert pins["IN3"] == "1"
    registers = client.ask("variables", variablesReference=scopes["Registers"])["variables"]
    assert len(registers) > 100
    go(client, "stepBack")
    with pytest.raises(Refused, match=r"n cannot be set .* before the present: branch"):
        client.ask("setVariable", variablesReference=scopes["Variables"], name="n", value="1")
    assert client.ask("evaluate", expression="branch", context="repl")["result"].startswith("the world goes on from")
    client.ask("setVariable", variablesReference=scopes["Variables"], name="n", value="1")
    assert client.ask("evaluate", expression="go 1 ms", context="repl")["result"] == "at 0.001000 s"


def test_conditions_logs_labels_data_and_events(client: DapClient, program: str) -> None:
    client.launch(program=program)
    client.ask(
        "setBreakpoints",
        source={"path": program},
        breakpoints=[{"line": 9, "condition": "n = 3"}, {"line": 10, "logMessage": "n is {n}"}, {"line": 8, "hitCondition": "7"}],
    )
    client.ask("setExceptionBreakpoints", filters=["program-error"])
    client.ask("configurationDone")
    assert client.event("output", lambda body: "n is" in body["output"])["output"] == "0.006000 s  n is 1\n"
    assert client.event("stopped")["reason"] == "breakpoint"
    assert client.ask("evaluate", expression="n", frameId=1000)["result"] == "3"
    found = client.ask("dataBreakpointInfo", name="n", variablesReference=1001)
    client.ask("setBreakpoints", source={"path": program}, breakpoints=[])
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": found["dataId"]}])
    stopped = go(client, "continue")
    assert (stopped["reason"], stopped["text"]) == ("data breakpoint", "n: 3 → 4")
    assert found["accessTypes"] == ["write"]
    (wrong,) = client.ask("setDataBreakpoints", breakpoints=[{"dataId": found["dataId"], "accessType": "readWrite"}])[
        "breakpoints"
    ]
    assert (wrong["verified"], wrong["message"]) == (
        False,
        "accessType = 'readWrite': it can stop when a value changes ('write')",
    )
    unknown = client.ask("dataBreakpointInfo", name="OTU1", variablesReference=1001)
    assert unknown["dataId"] is None
    assert "did you mean" in unknown["description"]
    client.ask("setDataBreakpoints", breakpoints=[])
    (label, wrong) = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "COUNT"}, {"name": "CUONT"}])["breakpoints"]
    assert (label["verified"], wrong["verified"]) == (True, False)
    assert "did you mean 'COUNT'?" in wrong["message"]
    assert go(client, "continue")["reason"] == "function breakpoint"


def test_a_run_is_paused_and_goes_on(client: DapClient, program: str) -> None:
    client.launch(program=program)
    client.ask("configurationDone")
    with pytest.raises(Refused, match="the program runs: pause it first"):
        client.ask("stackTrace", threadId=1)
    client.ask("pause", threadId=1)
    assert client.event("stopped")["reason"] == "pause"
    assert where(client)[1] in range(1, 11)
    client.ask("restart")
    client.ask("pause", threadId=1)
    client.event("stopped")


def test_the_end_of_a_program_ends_the_session(client: DapClient, tmp_path: Path) -> None:
    path = tmp_path / "short.prg"
    path.write_text("n = 1\nEND\n")
    client.launch(program=str(path))
    client.ask("configurationDone")
    client.event("terminated")
    assert client.event("exited") == {"exitCode": 0}


def test_an_m1486_program(client: DapClient, tmp_path: Path) -> None:
    path = tmp_path / "c.m1486"
    path.write_text(CHIP)
    client.launch(program=str(path), stopOnEntry=True)
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "@2"}])
    client.ask("configurationDone")
    client.event("stopped")
    assert where(client) == ("label 1", 4)
    go(client, "continue")
    assert where(client) == ("label 2", 11)
    go(client, "stepBack")
    assert where(client) == ("label 1", 7)


def test_a_world_with_two_controllers_and_a_breakpoint_in_each(client: DapClient, tmp_path: Path) -> None:
    (tmp_path / "m.prg").write_text(WBC)
    (tmp_path / "c.m1486").write_text(CHIP)
    (tmp_path / "two.toml").write_text(BOTH)
    client.launch(world=str(tmp_path / "two.toml"), program=str(tmp_path / "m.prg"))
    client.ask("setBreakpoints", source={"path": str(tmp_path / "m.prg")}, breakpoints=[{"line": 8}])
    client.ask("setBreakpoints", source={"path": str(tmp_path / "c.m1486")}, breakpoints=[{"line": 8}])
    (other,) = client.ask("setBreakpoints", source={"path": str(tmp_path / "x.prg")}, breakpoints=[{"line": 8}])["breakpoints"]
    assert "x.prg is not a program of this session" in other["message"]
    client.ask("configurationDone")
    assert client.event("stopped")["threadId"] == 1
    assert [thread["name"] for thread in client.ask("threads")["threads"]] == ["m", "c"]
    assert go(client, "continue")["threadId"] == 2
    assert where(client, 2)[1] == 8

    def why(question: str, thread: int) -> str:
        return client.ask("evaluate", expression=f"why {question}", frameId=1000 * thread, context="repl")["result"]

    assert why("out1", 1).startswith("m.out1 is ")
    assert why("variable", 2).startswith("c.variable is ")
    assert why("c", 1).startswith("c ")
    assert why("n", 1).startswith("m.n is ")  # the other controller has a pin n


def test_a_program_that_is_not_in_the_world_is_refused_and_another_launch_is_taken(client: DapClient, tmp_path: Path) -> None:
    (tmp_path / "m.prg").write_text(WBC)
    (tmp_path / "c.m1486").write_text(CHIP)
    (tmp_path / "two.toml").write_text(BOTH)
    with pytest.raises(Refused, match=r"x\.prg is not a program of .*two\.toml: there are .*m\.prg"):
        client.launch(world=str(tmp_path / "two.toml"), program=str(tmp_path / "x.prg"))
    client.launch(world=str(tmp_path / "two.toml"))
    assert len(client.ask("loadedSources")["sources"]) == 2


def test_an_example_with_its_files(client: DapClient) -> None:
    program = str(EXAMPLES / "mic488" / "pick_and_place.prg")
    client.launch(program=program, stopOnEntry=True)
    client.ask("configurationDone")
    client.event("stopped")
    axes = client.ask("variables", variablesReference=1002)["variables"]
    assert {"M1.position", "M4.status"} <= {one["name"] for one in axes}


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({}, "launch: give 'program' .* or 'world'"),
        ({"program": 5}, "launch: program = 5: expected a text"),
        ({"program": "/nowhere/x.prg"}, "nowhere"),
        ({"program": "x.prg", "variant": "E1"}, "launch: variant is not for WBC programs"),
        ({"world": "x.toml", "config": "x.cfg"}, "config cannot be given with a world"),
    ],
)
def test_what_cannot_be_launched_has_its_reason(client: DapClient, arguments: dict[str, object], problem: str) -> None:
    with pytest.raises(Refused, match=problem):
        client.launch(**arguments)


def test_requests_that_make_no_sense_are_refused_and_the_session_goes_on(client: DapClient, program: str) -> None:
    with pytest.raises(Refused, match="nothing was launched"):
        client.ask("threads")
    with pytest.raises(Refused, match="there is no such request"):
        client.ask("fly")
    client.launch(program=program, stopOnEntry=True)
    client.ask("configurationDone")
    client.event("stopped")
    for command, arguments, problem in (
        ("stackTrace", {"threadId": 9}, "threadId = 9: permitted are 1 to 1"),
        ("stackTrace", {}, "stackTrace: the argument threadId is missing"),
        ("scopes", {"frameId": 777}, "frameId = 777: nothing that is shown has this number"),
        ("variables", {"variablesReference": 12345}, "variablesReference = 12345: nothing that is shown has this number"),
        ("variables", {"variablesReference": 1099}, "there is no such group"),
        ("evaluate", {"expression": "nothing"}, "'nothing' means nothing to mic488"),
        ("evaluate", {"expression": "go 9 h", "context": "repl"}, "the past is kept from"),
        ("setExceptionBreakpoints", {"filters": ["x"]}, "'x' is none of program-error"),
    ):
        with pytest.raises(Refused, match=problem):
            client.ask(command, **arguments)
    assert where(client) == ("program", 1)


def test_a_breakpoint_of_another_type_is_refused_and_the_next_is_set(client: DapClient, program: str) -> None:
    client.launch(program=program)
    for wrong in ({"line": 3, "condition": {"n": 3}}, {"line": 3, "logMessage": 5}, {"line": "3"}, {}):
        with pytest.raises(Refused, match=r"expected a text|of another type|line is missing"):
            client.ask("setBreakpoints", source={"path": program}, breakpoints=[wrong])
    (label,) = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "COUNT"}])["breakpoints"]
    assert label["verified"]
    with pytest.raises(Refused, match="column 1: found"):
        client.ask("evaluate", expression="\ud800", frameId=1000)


def test_what_is_no_message_ends_the_session() -> None:
    client = DapClient()
    stream = client.process.stdin
    assert stream is not None
    data = b"[" * 200_000
    stream.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
    stream.flush()
    assert client.process.wait(LONG_S) == 0
    client.end()
