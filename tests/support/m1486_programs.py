"""Random programs that the language of the M1486 permits."""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

from hypothesis import strategies as st

from steptwin.m1486.commands import TABLE, ArgType, CommandSpec, takes_variable
from steptwin.m1486.syntax import ChipCommand, JumpCondition, ParsedProgram, ProgramLine
from steptwin.m1486.variants import Variant


class Programs(Protocol):
    """Programs of commands that the variant takes, in any order; with ``numbered`` no number is left out."""

    def __call__(self, variant: Variant, *, numbered: bool = False) -> st.SearchStrategy[ParsedProgram]: ...


@lru_cache
def permitted_programs(variant: Variant, *, numbered: bool = False) -> st.SearchStrategy[ParsedProgram]:
    command = st.one_of([_command(spec, variant, numbered) for spec in TABLE])
    comment = st.none() | st.text(st.characters(exclude_characters="\r\n"), max_size=10).map(str.strip)
    line = st.builds(ProgramLine, st.none() | command, comment)
    return st.lists(line, max_size=30).map(lambda lines: ParsedProgram(tuple(lines)))


def _command(spec: CommandSpec, variant: Variant, numbered: bool) -> st.SearchStrategy[ChipCommand]:
    if spec.kind is ArgType.NONE:
        return st.just(ChipCommand(spec.key))
    numbers = st.sampled_from(spec.permitted(variant))
    if spec.kind is ArgType.CONDITION:
        labels = st.integers(1, variant.labels)
        return st.builds(JumpCondition, numbers, st.booleans(), labels).map(lambda condition: ChipCommand(spec.key, condition))
    if takes_variable(spec.key) and not numbered:
        numbers = st.none() | numbers
    return numbers.map(lambda number: ChipCommand(spec.key, number))
