"""The state of a subject as metrics, with names by the conventions of Prometheus; docs/gateways/prometheus.md lists them.

What is unknown has no sample.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias, cast

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from steptwin import __version__
from steptwin.controller import SECOND
from steptwin.errors import LineFailure
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.heldstate import BUSY
from steptwin.subject import commands as command
from steptwin.subject.contract import Description
from steptwin.subject.subscriptions import Filter

MetricSample: TypeAlias = tuple[tuple[str, ...], bool | float | None]
"""Values of the labels, and the value; None where it is unknown."""

PREFIX = "steptwin_"
COUNTED = frozenset({"status", "report", "note", "fault", "input", "button"})
"""Kinds of events that are counted; others are as frequent as motion."""
MOST_EVENTS = 4096
"""Events that may happen between two reads of the metrics; of more, the rest is counted as missed."""

_AXIS = ("controller", "axis")


class Metrics:
    """Metrics of ``subject``; counters begin now."""

    def __init__(self, subject: GatewaySubject) -> None:
        self._subject = subject
        self._subscription = subject.subscribe(Filter(COUNTED), MOST_EVENTS)
        self._counts: Counter[tuple[str, str]] = Counter()
        self._missed = 0

    def close(self) -> None:
        self._subscription.close()

    async def read(self) -> list[Metric]:
        """The present values."""
        description = self._subject.description
        sheets = {part.name: part.datasheet for part in description.controllers}
        states = {name: await self._state(name) for name in sheets}
        up = [((name, sheet.kind, sheet.variant), states[name] is not None) for name, sheet in sheets.items()]
        known = {name: state for name, state in states.items() if state is not None}
        return [
            _gauge("build_info", "Version of the program.", ("version", "subject"), [((__version__, description.name), True)]),
            *await self._time(description),
            _gauge("controller_up", "Whether it answers.", ("controller", "kind", "variant"), up),
            *_of_controllers(known),
            *_of_axes(known),
            *self._events(),
            *self._lines(),
        ]

    async def _state(self, controller: str) -> Mapping[str, Any] | None:
        """None for a device that does not answer."""
        try:
            return cast("Mapping[str, Any]", (await self._subject.do(command.ReadState(controller))).value)
        except LineFailure:
            return None

    async def _time(self, description: Description) -> list[Metric]:
        if "time" not in description.commands:
            return []
        time = cast("Mapping[str, Any]", (await self._subject.do(command.Time())).value)
        return [
            _gauge("time_seconds", "Time of the subject: virtual for twins.", (), [((), int(time["time_ns"]) / SECOND)]),
            _gauge("paused", "Whether its time is paused.", (), [((), time["paused"])]),
        ]

    def _events(self) -> list[Metric]:
        missed, events = self._subscription.take()
        self._missed += missed
        self._counts.update((event.controller, event.kind) for event in events)
        counted = CounterMetricFamily(f"{PREFIX}events", "Events since the gateway was opened.", labels=("controller", "kind"))
        for labels, count in sorted(self._counts.items()):
            counted.add_metric(labels, count)
        return [counted, CounterMetricFamily(f"{PREFIX}events_missed", "Events that were not counted.", value=self._missed)]

    def _lines(self) -> list[Metric]:
        traffic = self._subject.traffic()
        requests = CounterMetricFamily(f"{PREFIX}line_requests", "Requests that programs have sent.", labels=("line",))
        errors = CounterMetricFamily(f"{PREFIX}line_errors", "Those that were refused, lost or not answered.", labels=("line",))
        for line, counts in traffic.items():
            requests.add_metric((line,), counts.requests)
            errors.add_metric((line,), counts.errors)
        return [requests, errors]


def _of_controllers(states: Mapping[str, Mapping[str, Any]]) -> list[Metric]:
    statuses = [((name, one["status"]["level"], one["status"]["text"]), True) for name, one in states.items()]
    programs = [((name,), one["program"]["state"] in BUSY) for name, one in states.items() if one["program"]["state"] is not None]
    pins = [((name, pin), level) for name, one in states.items() for pin, level in one["pins"].items()]
    return [
        _gauge("controller_status", "1 for the present status.", ("controller", "level", "text"), statuses),
        _gauge("program_running", "Whether its program runs or waits.", ("controller",), programs),
        _gauge("pin_level", "Level of a pin: 0, 1 or volts.", ("controller", "pin"), pins),
    ]


def _of_axes(states: Mapping[str, Mapping[str, Any]]) -> list[Metric]:
    axes = [(name, axis) for name, one in states.items() for axis in one["axes"]]

    def values(key: str, *labels: str) -> list[MetricSample]:
        return [((name, axis["name"], *(axis[label] for label in labels)), axis[key]) for name, axis in axes]

    statuses = [((name, axis["name"], axis["status"]["level"], axis["status"]["text"]), True) for name, axis in axes]
    in_unit = (*_AXIS, "unit")
    return [
        _gauge("axis_position", "Counted position in the unit of the axis.", in_unit, values("position", "unit")),
        _gauge("axis_velocity", "Velocity in units per second.", in_unit, values("velocity", "unit")),
        _gauge("axis_moving", "Whether it moves.", _AXIS, values("moving")),
        _gauge("axis_enabled", "Whether its drive is on.", _AXIS, values("enabled")),
        _gauge("axis_encoder_counts", "Counts of its encoder.", _AXIS, values("encoder")),
        _gauge("axis_status", "1 for the present status.", (*_AXIS, "level", "text"), statuses),
    ]


def _gauge(name: str, meaning: str, labels: tuple[str, ...], samples: Iterable[MetricSample]) -> Metric:
    found = GaugeMetricFamily(PREFIX + name, meaning, labels=labels)
    for values, value in samples:
        if value is not None:
            found.add_metric(values, float(value))
    return found
