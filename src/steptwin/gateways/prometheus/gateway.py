"""``[gateway.prometheus]``: metrics, health and readiness over HTTP.

``/metrics`` is what Prometheus reads (text or OpenMetrics, as it asks); ``/health`` answers 200 while the process works,
``/ready`` 200 while every controller answers and 503 otherwise.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from pathlib import Path
from typing import Any, TypeAlias

from prometheus_client import CollectorRegistry
from prometheus_client.core import Metric
from prometheus_client.exposition import choose_encoder

from steptwin.access.roles import Role
from steptwin.gateways.contract import ClientState, GatewayState, GatewaySubject
from steptwin.gateways.prometheus.metrics import PREFIX, Metrics
from steptwin.gateways.prometheus.options import PrometheusSpec
from steptwin.httpservice import HttpService, listen
from steptwin.simulation.toml.addresses import Address, parse_address

_Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
TEXT = "text/plain; charset=utf-8"
LONGEST_PROGRAM = 80
MOST_READERS = 16
"""Readers that are remembered: the last ones."""


class PrometheusGateway:
    """Serves the metrics of ``subject`` at the address of ``spec``. A `Gateway`."""

    protocol = "metrics"

    def __init__(self, spec: PrometheusSpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._subject = subject
        self._metrics: Metrics | None = None
        self._service: HttpService | None = None
        self._pages: Pages | None = None

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        listening = listen(parse_address(self._spec.listen, listen_any=listen_any), is_fixed=True)
        self._metrics = Metrics(self._subject)
        self._pages = Pages(self._metrics)
        self._service = HttpService(self._pages, listening)
        self._service.start()
        host, port = listening.getsockname()[:2]
        return {"host": host, "port": port, "url": f"http://{Address(host, port)}/metrics"}

    def state(self) -> GatewayState:
        readers = {} if self._pages is None else self._pages.readers
        clients = [ClientState(program, place, Role.VIEWER.title) for place, program in readers.items()]
        return GatewayState(is_up=True, text="listens", clients=tuple(clients))

    async def close(self) -> None:
        if self._service is not None:
            await self._service.close()
        if self._metrics is not None:
            self._metrics.close()


make = PrometheusGateway


class Pages:
    """The ASGI application."""

    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics
        self.readers: dict[str, str] = {}
        """Programs that have read metrics, by the host that they are on; the last one is the newest."""

    async def __call__(self, scope: Mapping[str, Any], receive: object, send: _Send) -> None:
        if scope["type"] != "http":
            return
        if scope["method"] not in ("GET", "HEAD"):
            await _answer(send, scope, 405, TEXT, b"only GET and HEAD are served\n")
            return
        path = scope["path"]
        if path == "/metrics":
            found = await self._metrics.read()
            headers = dict(scope["headers"])
            accepted = headers.get(b"accept", b"").decode("latin-1")
            self._note((scope.get("client") or ("", 0))[0], headers.get(b"user-agent", b"").decode("latin-1"))
            encode, kind = choose_encoder(accepted)
            await _answer(send, scope, 200, kind, encode(_registry(found)))
        elif path == "/health":
            await _answer(send, scope, 200, TEXT, b"ok\n")
        elif path == "/ready":
            silent = [name for name, is_up in controllers_up(await self._metrics.read()).items() if not is_up]
            text = f"no answer from {', '.join(silent)}\n" if silent else "ready\n"
            await _answer(send, scope, 503 if silent else 200, TEXT, text.encode())
        else:
            await _answer(send, scope, 404, TEXT, b"served are /metrics, /health and /ready\n")

    def _note(self, host: str, program: str) -> None:
        self.readers.pop(host, None)
        self.readers[host] = program[:LONGEST_PROGRAM]
        if len(self.readers) > MOST_READERS:
            del self.readers[next(iter(self.readers))]


def controllers_up(metrics: Iterable[Metric]) -> dict[str, bool]:
    """Whether each controller answers, by name."""
    found = next(metric for metric in metrics if metric.name == f"{PREFIX}controller_up")
    return {sample.labels["controller"]: sample.value > 0 for sample in found.samples}


class _Found:
    """A collector of metrics that have been read."""

    def __init__(self, metrics: Iterable[Metric]) -> None:
        self._metrics = metrics

    def collect(self) -> Iterable[Metric]:
        return self._metrics

    def describe(self) -> Iterable[Metric]:
        return ()


def _registry(metrics: Iterable[Metric]) -> CollectorRegistry:
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Found(metrics))
    return registry


async def _answer(send: _Send, scope: Mapping[str, Any], status: int, kind: str, body: bytes) -> None:
    headers = [(b"content-type", kind.encode()), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": b"" if scope["method"] == "HEAD" else body})
