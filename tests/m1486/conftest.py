"""Programs to test with: random ones that the language permits, and the manual's own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import strategies as st

from steptwin.m1486.commands import TABLE, CommandSpec, Kind, takes_variable
from steptwin.m1486.syntax import Command, Condition, Line, Program
from steptwin.m1486.variants import Variant

EXAMPLES = Path(__file__).parents[2] / "examples" / "m1486"


def _command(spec: CommandSpec, variant: Variant) -> st.SearchStrategy[Command]:
    if spec.kind is Kind.NONE:
        return st.just(Command(spec.key))
    numbers = st.sampled_from(spec.permitted(variant))
    if spec.kind is Kind.CONDITION:
        labels = st.integers(1, variant.labels)
        return st.builds(Condition, numbers, st.booleans(), labels).map(lambda condition: Command(spec.key, condition))
    if takes_variable(spec.key):
        numbers = st.none() | numbers
    return numbers.map(lambda number: Command(spec.key, number))


def _program(variant: Variant) -> st.SearchStrategy[Program]:
    command = st.one_of([_command(spec, variant) for spec in TABLE])
    comment = st.none() | st.text(st.characters(exclude_characters="\r\n"), max_size=10).map(str.strip)
    line = st.builds(Line, st.none() | command, comment)
    return st.lists(line, max_size=30).map(lambda lines: Program(tuple(lines)))


@pytest.fixture(scope="session")
def permitted_programs() -> Callable[[Variant], st.SearchStrategy[Program]]:
    """Programs of commands that the variant takes, in any order."""
    return _program


@pytest.fixture(scope="session")
def manual_examples() -> dict[int, str]:
    """The text of the manual's motion program examples 1 to 6 (chapter VIII)."""
    return {number: (EXAMPLES / f"example{number}.m1486").read_text() for number in range(1, 7)}
