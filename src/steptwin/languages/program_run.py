"""Run a single program in a generated world to its end: the parts common to `run_wbc` and `run_m1486`."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple, Self

from steptwin.controller import SECOND, Nanos
from steptwin.files.coverage import CoverageReports
from steptwin.files.export import axis_views, bar, write_trace
from steptwin.files.timedinputs import TimedInput
from steptwin.files.world import World
from steptwin.simulation.describe.generated import InputChange
from steptwin.simulation.describe.overrides import NO_OVERRIDES, Overrides
from steptwin.wbc.real import real_text

USUAL_LIMIT_NS: Nanos = 60 * SECOND
LIMIT_UNTIL_IDLE_NS: Nanos = 3600 * SECOND
SLICE_NS: Nanos = SECOND
"""The longest virtual time between two checks whether the program has ended."""
NOTE = "note"
"""The subject of records of `InputChange`."""

Print = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramRun:
    """Options of a run that apply to any program."""

    program: Path
    limit: Nanos | None = None
    """Ends the run at the latest; None: the default."""
    until_idle: bool = False
    """Whether the run also ends when only an input could cause anything further."""
    inputs: Sequence[TimedInput] = ()
    trace: Path | None = None
    coverage: Sequence[str] = ()
    """Files for coverage of the program; ``-`` for a table."""
    questions: Sequence[str] = ()
    """Questions that are answered at the end (`steptwin.why`)."""
    as_json: bool = False
    print_world: bool = False

    @classmethod
    def of(cls, given: ProgramRun, **own: Any) -> Self:
        """With these options, and those that only programs in one language have."""
        return cls(**{field.name: getattr(given, field.name) for field in fields(ProgramRun)}, **own)

    @property
    def longest(self) -> Nanos:
        """The limit, or its default."""
        return self.limit if self.limit is not None else LIMIT_UNTIL_IDLE_NS if self.until_idle else USUAL_LIMIT_NS


class Ending(NamedTuple):
    """The time of the last event, and the reason for the end: ``ended``, ``waiting`` (for ever) or ``limit``."""

    at: Nanos
    why: str


class Outcome(NamedTuple):
    """The end of a run, and the real time it took."""

    ending: Ending
    wall_s: float

    @property
    def virtual_s(self) -> float:
        return self.ending.at / SECOND

    @property
    def ratio(self) -> float:
        return self.virtual_s / self.wall_s

    def __str__(self) -> str:
        faster = f"{self.ratio:,.0f} times faster than real time"
        return f"{self.virtual_s:.6f} s of virtual time in {self.wall_s:.3f} s: {faster}"


def changes_of(inputs: Sequence[TimedInput], controller: str) -> Iterator[InputChange]:
    """The changes of inputs of the only controller."""
    for change in inputs:
        level = f"{real_text(change.value)} V" if change.pin.startswith("AIN") else "on" if change.value else "off"
        yield InputChange(change.time, f"{controller}.{change.pin}", change.value, f"{change.pin} {level}")


@contextmanager
def world_of(
    text: str, files: Mapping[str, bytes], options: ProgramRun, *, keep_trace: bool, overrides: Overrides = NO_OVERRIDES
) -> Generator[World]:
    name, asks = f"run {options.program.name}", bool(options.questions)
    with World.from_toml(text, files, name=name, overrides=overrides, keep_trace=keep_trace, keep_inputs=asks) as world:
        if asks:
            world.keep_states()
        yield world


def run_on(
    world: World, limit: Nanos, due: Callable[[], Nanos | None], has_ended: Callable[[], bool], *, until_idle: bool
) -> str:
    """Run until a program has ended and nothing from outside is to come, at most to ``limit``; with ``until_idle`` also where
    nothing will happen any more. Gives why it ended, as in `Ending`; ``due`` is the moment at which something happens next."""
    while True:
        moment = due()
        if not world.scripts and has_ended():
            return "ended"
        if world.now >= limit:
            return "limit"
        if moment is None and until_idle:
            return "waiting"
        world.run_to(limit if moment is None else min(max(moment, world.now + SLICE_NS), limit))


def write(world: World, where: Path | None, title: str, ended: Nanos) -> None:
    if where is not None:
        write_trace(world.trace, where, views=axis_views(world), title=title, ended=ended, watch=bar)


def report_causes(world: World, questions: Sequence[str], out: Print) -> None:
    """Print the answers to questions about the end of a run. Raises `Misuse` for what is no question there."""
    if questions:
        past = world.past
        for question in questions:
            out(f"\n{past.ask(question).text()}")


def report_coverage(reports: CoverageReports, out: Print) -> None:
    """Write coverage, and print its table if that was asked for."""
    reports.write(lambda table: out(f"\n{table}"))
