"""Steps read from tables, one by one and in lists."""

from __future__ import annotations

from steptwin.controller import SECOND
from steptwin.simulation.describe.steptable import read_step, read_steps
from steptwin.simulation.script.steps import Note, Wait
from steptwin.simulation.toml.reader import TomlText

TEXT = 'do = { wait = "1 s" }\nsteps = [{ wait = "1 s" }, 3, { note = "x" }]\nelse = 3\n'


def test_a_step_and_a_list_of_them() -> None:
    text = TomlText("w", TEXT)
    assert read_step(text, ("do",), text.data["do"]) == Wait(SECOND)
    assert text.findings == []
    assert read_step(text, ("else",), text.data["else"]) is None
    assert len(read_steps(text, ("steps",), text.data["steps"])) == 3
    assert read_steps(text, ("steps",), text.data["steps"])[::2] == (Wait(SECOND), Note("x"))
    found = [(TEXT[one.span.start : one.span.end], one.message) for one in text.findings]
    assert found == [("else = 3", "the step is 3"), *[("3", "step 2 is 3")] * 2]
