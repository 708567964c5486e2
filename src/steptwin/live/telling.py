"""How a command that runs until it is ended tells what it does: as text or as JSON, and as traces of requests."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.extras import libraries_of, missing
from steptwin.live.output import Output

TEXT, JSON = "text", "json"


@dataclass(frozen=True, slots=True)
class Telling:
    log_format: str = TEXT
    traces: str | None = None
    """The address to which traces of requests are sent by OTLP over HTTP; None: nowhere."""

    def output(self) -> Output:
        """Raises `Misuse` for an unknown format, or where structlog is missing."""
        if self.log_format == TEXT:
            return Output(sys.stdout)
        if self.log_format != JSON:
            raise Misuse(f"--log-format {self.log_format}: permitted are {TEXT} and {JSON}")
        try:
            from steptwin.live.jsonoutput import JsonOutput
        except ImportError:
            raise missing(f"--log-format {JSON}", libraries_of("logs")) from None
        return JsonOutput(sys.stdout)

    def tracing(self, subject: str, notice: Callable[[str], object]) -> AbstractContextManager[object]:
        """While it is entered requests are traced; ``notice`` is called, in a thread, when traces are lost.

        Raises `Misuse` for an address that is none, or where OpenTelemetry is missing.
        """
        if self.traces is None:
            return nullcontext()
        try:
            from steptwin.live.telemetry import exporting
        except ImportError:
            raise missing("--traces", libraries_of("traces")) from None
        return exporting(self.traces, subject, notice)
