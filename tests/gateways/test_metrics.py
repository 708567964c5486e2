"""Metrics of a world, and the pages that have them."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest
from gateway_rig import GatewayWorld

from steptwin.controller import SECOND
from steptwin.gateways.prometheus.gateway import Pages
from steptwin.gateways.prometheus.metrics import MOST_EVENTS, Metrics
from steptwin.simulation.script import steps
from steptwin.subject import commands as command

TEXT = """
    [world]
    name = "hall"
    [[mic488]]
    name = "table"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    vel = 40.0
    acc = 400.0
    dec = 400.0
    [[m1486]]
    name = "drum"
"""


def samples(metrics: Metrics) -> dict[tuple[str, tuple[str, ...]], float]:
    """By name and the values of the labels."""
    found = asyncio.run(metrics.read())
    return {(sample.name, tuple(sample.labels.values())): sample.value for metric in found for sample in metric.samples}


def test_axes_have_position_and_velocity_with_their_unit() -> None:
    subject = GatewayWorld(TEXT)
    metrics = Metrics(subject)
    subject.inner.do(command.Enable("table", 1))
    subject.inner.do(command.Move("table", 1, to=50.0))
    subject.world.advance(SECOND)
    found = samples(metrics)
    # 0.1 s of acceleration to 40 mm/s are 2 mm, and 0.9 s at 40 mm/s are 36 mm.
    assert found["steptwin_axis_position", ("table", "M1", "mm")] == pytest.approx(38.0, abs=0.01)
    assert found["steptwin_axis_velocity", ("table", "M1", "mm")] == pytest.approx(40.0)
    assert found["steptwin_axis_moving", ("table", "M1")] == 1.0
    assert found["steptwin_axis_enabled", ("table", "M2")] == 0.0
    assert found["steptwin_axis_status", ("table", "M1", "ok", "moving to position")] == 1.0
    assert found["steptwin_axis_position", ("drum", "M1", "min. microsteps")] == 0.0
    assert found["steptwin_time_seconds", ()] == 1.0
    assert found["steptwin_pin_level", ("table", "M1_EN")] == 1.0


def test_lines_have_their_traffic() -> None:
    subject = GatewayWorld(TEXT.replace('name = "table"', 'name = "table"\nline = "bus"') + '[[line]]\nname = "bus"\n')
    subject.inner.do(steps.Write((("table", "M1_VMAX", 500.0),)))
    subject.world.advance(SECOND)
    found = samples(Metrics(subject))
    assert found["steptwin_line_requests_total", ("bus",)] == 1.0
    assert found["steptwin_line_errors_total", ("bus",)] == 0.0


def test_what_is_unknown_has_no_sample() -> None:
    found = samples(Metrics(GatewayWorld(TEXT)))
    assert ("steptwin_axis_enabled", ("table", "M1")) in found
    assert ("steptwin_axis_enabled", ("drum", "M1")) not in found  # an M1486 does not switch its drive


def test_events_are_counted_from_the_beginning_of_the_gateway() -> None:
    subject = GatewayWorld(TEXT)
    subject.inner.do(steps.Note("before"))
    metrics = Metrics(subject)
    for _ in range(3):
        subject.inner.do(steps.Note("after"))
    counted = {labels: value for (name, labels), value in samples(metrics).items() if name == "steptwin_events_total"}
    assert [value for (_, kind), value in counted.items() if kind == "note"] == [3.0]
    subject.inner.do(steps.Note("later"))
    again = {labels: value for (name, labels), value in samples(metrics).items() if name == "steptwin_events_total"}
    assert [value for (_, kind), value in again.items() if kind == "note"] == [4.0]


def test_events_beyond_the_bound_are_counted_as_missed() -> None:
    subject = GatewayWorld(TEXT)
    metrics = Metrics(subject)
    for _ in range(MOST_EVENTS + 5):
        subject.inner.do(steps.Note("x"))
    found = samples(metrics)
    notes = sum(value for (name, labels), value in found.items() if name == "steptwin_events_total" and labels[1] == "note")
    assert notes + found["steptwin_events_missed_total", ()] == MOST_EVENTS + 5
    assert found["steptwin_events_missed_total", ()] == 5.0


def test_after_the_end_nothing_is_followed() -> None:
    subject = GatewayWorld(TEXT)
    metrics = Metrics(subject)
    assert subject.inner.subscribers
    metrics.close()
    assert not subject.inner.subscribers


def answer(subject: GatewayWorld, path: str, method: str = "GET", accept: str = "*/*") -> tuple[int, str, str]:
    """Status, content type and text."""
    sent: list[Mapping[str, Any]] = []

    async def send(message: Mapping[str, Any]) -> None:
        sent.append(message)

    scope = {"type": "http", "method": method, "path": path, "headers": [(b"accept", accept.encode())]}
    asyncio.run(Pages(Metrics(subject))(scope, None, send))
    start, body = sent
    return start["status"], dict(start["headers"])[b"content-type"].decode(), body["body"].decode()


def test_the_page_is_in_the_format_that_is_asked_for() -> None:
    status, kind, text = answer(GatewayWorld(TEXT), "/metrics")
    assert (status, kind.split(";")[0]) == (200, "text/plain")
    assert 'steptwin_axis_position{axis="M1",controller="table",unit="mm"} 0.0\n' in text
    _, kind, text = answer(GatewayWorld(TEXT), "/metrics", accept="application/openmetrics-text;version=1.0.0")
    assert kind.startswith("application/openmetrics-text")
    assert text.endswith("# EOF\n")


def test_a_silent_device_is_not_ready() -> None:
    subject = GatewayWorld(TEXT)
    assert answer(subject, "/ready")[0::2] == (200, "ready\n")
    subject.silent.add("drum")
    assert answer(subject, "/ready")[0::2] == (503, "no answer from drum\n")
    assert answer(subject, "/health")[0] == 200
    found = samples(Metrics(subject))
    assert [found["steptwin_controller_up", labels] for labels in (("table", "mic488", "1.70"), ("drum", "m1486", "B"))] == [
        1.0,
        0.0,
    ]


@pytest.mark.parametrize(("path", "method", "status"), [("/", "GET", 404), ("/metrics", "POST", 405), ("/metrics/", "GET", 404)])
def test_other_requests_are_refused(path: str, method: str, status: int) -> None:
    found, _, text = answer(GatewayWorld(TEXT), path, method)
    assert found == status
    assert text.startswith(("served are", "only GET"))


def test_head_has_no_body() -> None:
    status, _, text = answer(GatewayWorld(TEXT), "/metrics", "HEAD")
    assert (status, text) == (200, "")
