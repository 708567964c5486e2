"""Groups of options: how a command takes them, and how its help shows them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from steptwin.cli.optiongroups import GroupedCommand, grouped
from steptwin.errors import Misuse
from steptwin.options import Option, OptionGroup


@dataclass(frozen=True, kw_only=True)
class Cutting(OptionGroup):
    heading = "Options of cutting"

    blade_width: Annotated[float, Option("In mm.")] = 1.5
    from_: Annotated[str | None, Option("Where to begin.", flags=("--from",))] = None
    part: Annotated[tuple[str, ...], Option("Only this one; repeatable.")] = ()


@dataclass(frozen=True, kw_only=True)
class Printing(OptionGroup):
    heading = "Options of printing"

    paper: Annotated[Path | None, Option("What to print on.")] = None


app = typer.Typer(rich_markup_mode=None)
given: list[tuple[str, bool, Cutting, Printing]] = []


@app.command(cls=GroupedCommand)
@grouped
def work(
    name: Annotated[str, typer.Argument(help="Of the work.")],
    cutting: Cutting,
    fast: Annotated[bool, Option("Without pauses.")] = False,
    *,
    printing: Printing,
) -> None:
    """Work."""
    given.append((name, fast, cutting, printing))


def ran(*arguments: str) -> str:
    given.clear()
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_command_gets_its_groups_as_values() -> None:
    ran("saw", "--blade-width", "2", "--from", "left", "--part", "a", "--part", "b", "--paper", "p.txt", "--fast")
    cutting = Cutting(blade_width=2.0, from_="left", part=("a", "b"))
    assert given == [("saw", True, cutting, Printing(paper=Path("p.txt")))]


def test_options_that_are_not_given_have_the_defaults_of_their_fields() -> None:
    ran("saw")
    assert given == [("saw", False, Cutting(), Printing())]


def test_the_help_has_a_section_for_each_group() -> None:
    sections = re.findall(r"^(\S.*):\n((?:  .*\n)+)", ran("--help"), re.MULTILINE)
    options = {heading: re.findall(r"^  (--[a-z-]+)", rows, re.MULTILINE) for heading, rows in sections}
    assert list(options) == ["Arguments", "Options", "Options of cutting", "Options of printing"]
    assert options["Options of cutting"] == ["--blade-width", "--from", "--part"]
    assert options["Options of printing"] == ["--paper"]
    assert {"--fast", "--help"} <= {*options["Options"]}


@pytest.mark.parametrize(
    ("cutting", "option"),
    [
        (Cutting(blade_width=2.0), "--blade-width"),
        (Cutting(from_=""), "--from"),
        (Cutting(part=("a",)), "--part"),
    ],
)
def test_an_option_that_was_given_is_refused_by_its_name(cutting: Cutting, option: str) -> None:
    with pytest.raises(Misuse, match=f"^{option} is not for paper$"):
        cutting.refuse("paper")


@pytest.mark.parametrize("cutting", [Cutting(), Cutting(blade_width=1.5)])
def test_options_that_were_not_given_are_not_refused(cutting: Cutting) -> None:
    assert cutting.refuse("paper") is None  # raises nothing
