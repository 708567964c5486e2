"""No program and no request brings the adapter down: every request is answered, or refused with a reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from debug_rig import CHIP, WBC
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.dap.adapter import CAPABILITIES, Adapter
from steptwin.errors import SteptwinError

TURNS = 20
"""Parts of a run before it is paused."""
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 2000) | st.floats() | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=5,
)
LINES = st.lists(
    st.fixed_dictionaries(
        {"line": st.integers(-1, 30) | ANYTHING},
        optional={
            "condition": st.sampled_from(["n > 1", "n >", "1 / 0", "nothing", ""]) | ANYTHING,
            "hitCondition": st.sampled_from(["2", "% 2", ">= x"]) | ANYTHING,
            "logMessage": st.sampled_from(["n is {n}", "{", "{1 / 0}"]) | ANYTHING,
        },
    ),
    max_size=3,
)
EXPRESSIONS = st.sampled_from(["n", "n + 1", "IN3 = ON", "variable", "go 1 ms", "go x", "branch", "why", "why n", "((", "m.OUT1"])
RUNS = ("continue", "next", "stepIn", "stepOut", "stepBack", "reverseContinue", "configurationDone", "pause", "restart")


def arguments(path: Path) -> dict[str, st.SearchStrategy[dict[str, Any]]]:
    """Of the requests, as editors send them, but for their values."""
    threads, references = st.fixed_dictionaries({"threadId": st.integers(0, 3)}), st.integers(0, 3000)
    source = st.just({"path": str(path)})
    name, value = st.sampled_from(["n", "IN1", "B1", "M1.position", "variable", "x"]), st.sampled_from(["1", "n", "1 /", "1e400"])
    frame = {"frameId": st.sampled_from([None, 0, 1000, 1001, 2000])}
    return {
        **dict.fromkeys(RUNS, threads),
        "setBreakpoints": st.fixed_dictionaries({"source": source, "breakpoints": LINES}),
        "breakpointLocations": st.fixed_dictionaries({"source": source, "line": st.integers(-1, 40)}),
        "setFunctionBreakpoints": st.fixed_dictionaries(
            {"breakpoints": st.lists(st.fixed_dictionaries({"name": st.sampled_from(["MAIN", "@1", "INT_IN3", ""])}), max_size=2)}
        ),
        "dataBreakpointInfo": st.fixed_dictionaries({"name": name, "variablesReference": references}),
        "setDataBreakpoints": st.fixed_dictionaries(
            {"breakpoints": st.lists(st.fixed_dictionaries({"dataId": st.sampled_from(["m/n", "n", "m/OUT1"])}), max_size=2)}
        ),
        "setExceptionBreakpoints": st.fixed_dictionaries({"filters": st.lists(st.sampled_from(["limit", "wrong-data", "x"]))}),
        "stackTrace": threads,
        "scopes": st.fixed_dictionaries({"frameId": st.integers(0, 3000)}),
        "variables": st.fixed_dictionaries({"variablesReference": references}),
        "evaluate": st.fixed_dictionaries({"expression": EXPRESSIONS, "context": st.sampled_from(["repl", "hover"]), **frame}),
        "setVariable": st.fixed_dictionaries({"variablesReference": references, "name": name, "value": value}),
        "setExpression": st.fixed_dictionaries({"expression": name, "value": value, **frame}),
        "source": st.fixed_dictionaries({"source": source}),
        "loadedSources": st.just({}),
        "threads": st.just({}),
        "nothing": st.just({}),
    }


@st.composite
def programs(draw: st.DrawFn) -> tuple[str, str]:
    """A language by its ending, and a text: right, half-typed, or with anything in it."""
    ending, text = draw(st.sampled_from([(".prg", WBC), (".m1486", CHIP)]))
    at = draw(st.integers(0, len(text)))
    end = draw(st.sampled_from([at, len(text)]))
    return ending, text[:at] + draw(st.sampled_from(["", "\n", "JUMP ", "IF n", "@", "L", "é🙂", "\0"])) + text[end:]


@settings(max_examples=60, deadline=None)
@given(programs(), st.data())
def test_every_request_about_any_program_is_answered(
    tmp_path_factory: pytest.TempPathFactory, program: tuple[str, str], data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("p") / f"p{program[0]}"
    path.write_text(program[1], encoding="utf-8")
    events: list[str] = []
    reasons: list[str] = []
    adapter = Adapter(lambda name, _: events.append(name))

    def ask(command: str, given: dict[str, Any]) -> bool:
        try:
            adapter.answer(command, given)
        except SteptwinError as refusal:
            reasons.append(str(refusal))
            return False
        return True

    assert adapter.answer("initialize", {}) == CAPABILITIES
    is_launched = ask("launch", {"program": str(path), "stopOnEntry": data.draw(st.booleans())})
    requests = arguments(path)
    for _ in range(data.draw(st.integers(1, 12))):
        command = data.draw(st.sampled_from(sorted(requests)))
        ask(command, data.draw(requests[command] | st.dictionaries(st.sampled_from(["line", "name", "x"]), ANYTHING, max_size=2)))
        for _ in range(TURNS if adapter.is_running else 0):
            adapter.go_on()
    if adapter.is_running:
        assert ask("pause", {"threadId": 1})
        adapter.go_on()
    assert ask("threads", {}) is is_launched
    assert ask("disconnect", {})
    assert events[-1:] == ["terminated"] or events[-2:] == ["terminated", "exited"]
    assert all(reasons)
