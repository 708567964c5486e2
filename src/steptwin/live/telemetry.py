"""Traces of requests to an OpenTelemetry collector, by OTLP over HTTP, from a thread of its own."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from urllib.parse import urlsplit

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import ReadableSpan, SpanProcessor, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter, SpanExportResult
from opentelemetry.trace import Span as SdkSpan
from opentelemetry.trace import get_current_span

from steptwin import __version__
from steptwin.errors import Misuse
from steptwin.tracing import Attribute, NoSpan, TraceSpan, traced_by

TIMEOUT_S = 5


@contextmanager
def exporting(url: str, subject: str, notice: Callable[[str], object]) -> Generator[None]:
    """Within, requests are traced. ``notice`` is called, in a thread, when the collector takes none, and when it does again.

    OTEL_TRACES_SAMPLER of the environment decides which; without it all. Raises `Misuse` for an address that is none.
    """
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise Misuse(f"--traces {url}: expected http://HOST:PORT/v1/traces")
    logging.getLogger("opentelemetry").addHandler(logging.NullHandler())
    logging.getLogger("opentelemetry").propagate = False
    exporter = _NotifyingExporter(OTLPSpanExporter(endpoint=url, timeout=TIMEOUT_S), url, notice)
    with traces_to(BatchSpanProcessor(exporter), subject):
        yield


@contextmanager
def traces_to(processor: SpanProcessor, subject: str) -> Generator[None]:
    """Within, spans go to ``processor``; what it has is sent at the end."""
    resource = Resource.create({"service.name": "steptwin", "service.version": __version__, "steptwin.subject": subject})
    provider = TracerProvider(resource=resource, shutdown_on_exit=False)
    provider.add_span_processor(processor)
    tracer = provider.get_tracer("steptwin", __version__)

    @contextmanager
    def span(name: str, attributes: Mapping[str, Attribute], is_part: bool) -> Generator[TraceSpan]:
        if is_part and not get_current_span().get_span_context().is_valid:
            yield NoSpan()
            return
        with tracer.start_as_current_span(
            name, attributes={f"steptwin.{key}": value for key, value in attributes.items()}
        ) as made:
            yield _OpenTelemetrySpan(made)

    try:
        with traced_by(span):
            yield
    finally:
        provider.shutdown()


class _OpenTelemetrySpan:
    def __init__(self, span: SdkSpan) -> None:
        self._span = span

    def set_attribute(self, name: str, value: Attribute) -> None:
        self._span.set_attribute(f"steptwin.{name}", value)


class _NotifyingExporter(SpanExporter):
    """Says once when spans are lost, and once when they are not any more."""

    def __init__(self, inner: SpanExporter, url: str, notice: Callable[[str], object]) -> None:
        self._inner = inner
        self._url = url
        self._notice = notice
        self._is_lost = False

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        result = self._inner.export(spans)
        is_lost = result is not SpanExportResult.SUCCESS
        if is_lost is not self._is_lost:
            self._is_lost = is_lost
            self._notice(f"traces: {self._url} {'takes none: spans are lost' if is_lost else 'takes them again'}")
        return result

    def shutdown(self) -> None:
        self._inner.shutdown()

    def force_flush(self, timeout_millis: int = 30_000) -> bool:
        return self._inner.force_flush(timeout_millis)
