"""The options of commands that run a world: `run`, `up` and `studio`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.optiongroups import OptionGroup
from steptwin.cli.writtenfiles import written

if TYPE_CHECKING:
    from steptwin.live.running import UpOptions
    from steptwin.live.telling import Telling
    from steptwin.machine import Nanos
    from steptwin.simulation.describe.overrides import Overrides

Faults = Annotated[
    list[str] | None,
    typer.Option(help="Fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
]
ReadyFile = Annotated[Path | None, written(help="JSON file with the end points, written when all of them are open.")]
ListenAny = Annotated[bool, typer.Option("--listen-any", help="Permit addresses that other computers can reach.")]
AuditInto = Annotated[
    Path | None,
    written("--audit", metavar="FILE", help="Append every command of a gateway and its client to a file of JSON lines."),
]
Coverage = Annotated[
    list[str] | None,
    written(
        metavar="PATH",
        help="Report which statements of programs were executed, and which branches were taken: .info (lcov), .html, .json; "
        "'-' prints a table. Repeatable.",
    ),
]
Of = Annotated[
    list[str] | None,
    typer.Option("--of", metavar="NAME,...", help="Show only what these controllers, elements, lines do; scripts: 'world'."),
]
Show = Annotated[
    list[str] | None,
    typer.Option(
        "--show", metavar="KIND,...", help="Show only these kinds: program, status, note, report, button, input, fault."
    ),
]
Speed = Annotated[
    str, typer.Option(help="Virtual seconds per second: 0.1, 1, 10; 'max' for worlds without external clients; 0 starts paused.")
]
Control = Annotated[
    str | None, typer.Option(metavar="HOST:PORT", help="Also open the control endpoint on this loopback TCP address.")
]
LogTraffic = Annotated[
    bool, typer.Option("--log-frames", help="Print the traffic of every line with time, direction, bytes and meaning.")
]


@dataclass(frozen=True, kw_only=True)
class WorldRunOptions(OptionGroup):
    """How a world begins, and the recording of a session."""

    heading = "Options of worlds"

    fault: Faults = None
    seed: Annotated[int | None, typer.Option(help="Random seed. Default: that of the description.")] = None
    with_: Annotated[
        list[str] | None,
        typer.Option(
            "--with",
            metavar="NAME.KEY=VALUE",
            help="Replace a value of the description, or a parameter of what it uses, such as x.pitch=4.0; repeatable.",
        ),
    ] = None
    state: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the non-volatile memory. Default: that of the description, or none."),
    ] = None
    session: Annotated[Path | None, written(help="Write a session for 'steptwin replay' when it ends.")] = None
    from_: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="Of a session: continue from this moment, such as 2.5s. Default: its end."),
    ] = None
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 also for a wait that timed out.")] = False
    allow_outside: Annotated[
        bool, typer.Option("--allow-outside", help="Permit files outside the folder of the description.")
    ] = False

    @property
    def overrides(self) -> Overrides:
        """Values that replace those of the description. Raises `Misuse`."""
        from steptwin.simulation.describe.overrides import read_overrides

        return read_overrides(self.with_ or ())

    @property
    def moment(self) -> Nanos | None:
        """The moment of a session to continue from. Raises `Misuse`."""
        from steptwin.files.timedinputs import parse_duration

        return None if self.from_ is None else parse_duration(self.from_, "--from")


@dataclass(frozen=True, kw_only=True)
class ShownOptions(OptionGroup):
    """What is shown of what happens in a world."""

    heading = "Options for the output of worlds"

    of: Of = None
    show: Show = None


@dataclass(frozen=True, kw_only=True)
class LiveOptions(OptionGroup):
    """Of a world in real time."""

    heading = "Options of real time"

    speed: Speed = "1"
    name: Annotated[str | None, typer.Option(help="Name by which --device finds it. Default: that of the file.")] = None
    trace: Annotated[
        str | None,
        written(
            metavar="FILE",
            help="Write a trace to a file or into a directory; 'ring N' keeps the last N records for 'save'; 'off' keeps none. "
            "Default: that of the description.",
        ),
    ] = None
    control: Control = None
    listen_any: ListenAny = False
    log_frames: LogTraffic = False


@dataclass(frozen=True, kw_only=True)
class LogOptions(OptionGroup):
    """Of commands that run until they are ended."""

    heading = "Options of logs and traces"

    log_format: Annotated[str, typer.Option(metavar="text|json", help="How output is written: as text, or as lines of JSON.")] = (
        "text"
    )
    traces: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Send traces of requests there, by OTLP over HTTP: http://127.0.0.1:4318/v1/traces."),
    ] = None

    def telling(self) -> Telling:
        from steptwin.live.telling import Telling

        return Telling(self.log_format, self.traces)


def up_options(
    world: Path | None, ready_file: Path | None, live: LiveOptions, options: WorldRunOptions, log: LogOptions
) -> UpOptions:
    """Raises `Misuse`."""
    from steptwin.live.running import UpOptions

    return UpOptions(
        world=world,
        moment=options.moment,
        seed=options.seed,
        overrides=options.overrides,
        state=options.state,
        speed=live.speed,
        name=live.name,
        session=options.session,
        trace=live.trace,
        faults=tuple(options.fault or ()),
        ready_file=ready_file,
        control=live.control,
        strict=options.strict,
        listen_any=live.listen_any,
        log_frames=live.log_frames,
        allow_outside=options.allow_outside,
        telling=log.telling(),
    )
