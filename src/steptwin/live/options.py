"""Options of commands that run until they are ended."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from steptwin.errors import Misuse
from steptwin.files.worldoptions import ShownOptions, WorldRunOptions
from steptwin.options import Option, OptionGroup

if TYPE_CHECKING:
    from steptwin.access.audit import Audit
    from steptwin.live.output import Output

TEXT, JSON = "text", "json"

ReadyFile: TypeAlias = Annotated[
    Path | None, Option("JSON file with the end points, written when all of them are open.", is_written=True)
]
AuditInto: TypeAlias = Annotated[
    Path | None,
    Option("Append every command of a gateway and its client to a file of JSON lines.", metavar="FILE", is_written=True),
]
ListenAny: TypeAlias = Annotated[
    bool,
    Option("Permit addresses that other computers can reach; 'serve' without any address then listens on all interfaces."),
]


@dataclass(frozen=True, kw_only=True)
class LiveOptions(OptionGroup):
    """The pace of a world in real time, and what is open for other programs."""

    heading = "Options of real time"

    speed: Annotated[
        str,
        Option("Virtual seconds per second: 0.1, 1, 10; 'max' for worlds without external clients; 0 starts paused."),
    ] = "1"
    name: Annotated[str | None, Option("Name by which --device finds it. Default: that of the file, or the kind of a twin.")] = (
        None
    )
    trace: Annotated[
        str | None,
        Option(
            "Write a trace to a file or into a directory; 'ring N' keeps the last N records for 'save'; 'off' keeps none. "
            "Default: that of the description, if there is one.",
            metavar="FILE",
            is_written=True,
        ),
    ] = None
    control: Annotated[
        str | None, Option("Also open the control endpoint on this loopback TCP address.", metavar="HOST:PORT")
    ] = None
    listen_any: ListenAny = False
    log_frames: Annotated[bool, Option("Print the traffic of every line with time, direction, bytes and meaning.")] = False


@dataclass(frozen=True, kw_only=True)
class LogOptions(OptionGroup):
    """The form of the output, and where traces of requests go."""

    heading = "Options of logs and traces"

    log_format: Annotated[str, Option("How output is written: as text, or as lines of JSON.", metavar="text|json")] = TEXT
    traces: Annotated[
        str | None,
        Option("Send traces of requests there, by OTLP over HTTP: http://127.0.0.1:4318/v1/traces.", metavar="URL"),
    ] = None

    def output(self) -> Output:
        """Raises `Misuse` for an unknown format, or where structlog is missing."""
        from steptwin.extras import missing
        from steptwin.live.output import Output

        if self.log_format == TEXT:
            return Output(sys.stdout)
        if self.log_format != JSON:
            raise Misuse(f"--log-format {self.log_format}: permitted are {TEXT} and {JSON}")
        try:
            from steptwin.live.jsonoutput import JsonOutput
        except ImportError:
            raise missing(f"--log-format {JSON}", "logs") from None
        return JsonOutput(sys.stdout)

    def tracing(self, subject: str, notice: Callable[[str], object]) -> AbstractContextManager[object]:
        """While it is entered requests are traced; ``notice`` is called, in a thread, when traces are lost.

        Raises `Misuse` for an address that is none, or where OpenTelemetry is missing.
        """
        if self.traces is None:
            return nullcontext()
        from steptwin.extras import missing

        try:
            from steptwin.live.telemetry import exporting
        except ImportError:
            raise missing("--traces", "traces") from None
        return exporting(self.traces, subject, notice)


@dataclass(frozen=True, slots=True, kw_only=True)
class UpOptions:
    """A world in real time, as the commands `up`, `serve` and `studio` run it."""

    world: Path | None
    """A description, or a recording to continue; None for a world made from options."""
    run: WorldRunOptions = field(default_factory=WorldRunOptions)
    live: LiveOptions = field(default_factory=LiveOptions)
    shown: ShownOptions = field(default_factory=ShownOptions)
    log: LogOptions = field(default_factory=LogOptions)
    ready_file: Path | None = None
    keeps_inputs: bool = False
    """Whether the world is recorded, to be written on request only."""
    past: bool = False
    """Whether the past is kept, for questions about it."""
    coverage: tuple[str, ...] = ()
    """Files for coverage of programs; ``-`` for a table."""
    audit: Audit | None = None
    """Where commands of gateways are recorded."""
    is_closed: bool = False
    """Whether nothing is open for other programs: neither lines nor the control endpoint."""

    @property
    def is_recorded(self) -> bool:
        return self.keeps_inputs or self.run.session is not None
