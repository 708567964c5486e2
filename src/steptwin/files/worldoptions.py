"""Options of commands that run a world: how it begins, what is shown of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from steptwin.options import Option, OptionGroup

if TYPE_CHECKING:
    from steptwin.controller import Nanos
    from steptwin.simulation.describe.overrides import Overrides

Faults: TypeAlias = Annotated[
    tuple[str, ...], Option("Fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds.")
]
Coverage: TypeAlias = Annotated[
    tuple[str, ...],
    Option(
        "Report which statements of programs were executed, and which branches were taken: .info (lcov), .html, .json; "
        "'-' prints a table. Repeatable.",
        metavar="PATH",
        is_written=True,
    ),
]


@dataclass(frozen=True, kw_only=True)
class WorldRunOptions(OptionGroup):
    """How a world begins, and its recording."""

    heading = "Options of worlds"

    fault: Faults = ()
    seed: Annotated[int | None, Option("Random seed. Default: that of the description.")] = None
    with_: Annotated[
        tuple[str, ...],
        Option(
            "Replace a value of the description, or a parameter of what it uses, such as x.pitch=4.0; repeatable.",
            metavar="NAME.KEY=VALUE",
            flags=("--with",),
        ),
    ] = ()
    state: Annotated[
        Path | None,
        Option("Directory of the non-volatile memory. Default: that of the description, or none.", metavar="DIR"),
    ] = None
    session: Annotated[Path | None, Option("Write a recording for 'steptwin replay' when it ends.", is_written=True)] = None
    from_: Annotated[
        str | None,
        Option("Of a recording: continue from this moment, such as 2.5s. Default: its end.", metavar="TIME", flags=("--from",)),
    ] = None
    strict: Annotated[bool, Option("Exit code 1 also for a wait that timed out, and a write that was refused.")] = False
    allow_outside: Annotated[bool, Option("Permit files outside the folder of the description.")] = False

    @property
    def overrides(self) -> Overrides:
        """Values that replace those of the description. Raises `Misuse`."""
        from steptwin.simulation.describe.overrides import read_overrides

        return read_overrides(self.with_)

    @property
    def moment(self) -> Nanos | None:
        """The moment of a recording to continue from. Raises `Misuse`."""
        from steptwin.files.timedinputs import parse_duration

        return None if self.from_ is None else parse_duration(self.from_, "--from")


@dataclass(frozen=True, kw_only=True)
class ShownOptions(OptionGroup):
    """The selection of what is shown of a world (`steptwin.simulation.world.records.Selection`)."""

    heading = "Options for the output of worlds"

    of: Annotated[
        tuple[str, ...],
        Option("Show only what these controllers, elements, lines do; scripts: 'world'.", metavar="NAME,..."),
    ] = ()
    show: Annotated[
        tuple[str, ...],
        Option("Show only these kinds: program, status, note, report, button, input, fault.", metavar="KIND,..."),
    ] = ()
