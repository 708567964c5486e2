"""The files of examples/plant: rules and a dashboard on the metrics."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from gateway_rig import GatewayWorld

from steptwin.gateways.prometheus.metrics import Metrics

PLANT = Path(__file__).parents[2] / "examples/plant"
WORLD = '[[mic488]]\nname = "table"\n[[m1486]]\nname = "drum"\n'


@pytest.mark.parametrize(
    "arguments",
    [("check", "rules", "alerts.yml"), ("check", "config", "prometheus.yml"), ("test", "rules", "alerts.test.yml")],
)
def test_promtool_takes_the_rules(arguments: tuple[str, ...], require_peer: Callable[[str], str]) -> None:
    checked = subprocess.run(
        [require_peer("promtool"), *arguments], cwd=PLANT, capture_output=True, text=True, timeout=60, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def expressions() -> list[str]:
    dashboard = json.loads((PLANT / "grafana-dashboard.json").read_text())
    found = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    found += [variable["query"] for variable in dashboard["templating"]["list"]]
    return [*found, *re.findall(r"expr: (.*)", (PLANT / "alerts.yml").read_text())]


def test_dashboard_and_rules_use_metrics_and_labels_that_are_served() -> None:
    served: dict[str, set[str]] = {}
    world = GatewayWorld(WORLD)
    metrics = Metrics(world)
    for metric in asyncio.run(metrics.read()):
        name = f"{metric.name}_total" if metric.type == "counter" else metric.name
        served[name] = {label for sample in metric.samples for label in sample.labels}
    served["steptwin_events_total"] = {"controller", "kind"}
    used = [(name, labels) for one in expressions() for name, labels in re.findall(r"(steptwin_\w+)(?:\{([^}]*)\})?", one)]
    assert len(used) > 10
    assert {name for name, _ in used} <= set(served)
    for name, labels in used:
        assert set(re.findall(r"(\w+)\s*(?:=|!)", labels)) <= served[name], name


def test_the_dashboard_has_panels_side_by_side() -> None:
    dashboard = json.loads((PLANT / "grafana-dashboard.json").read_text())
    places = [(p["gridPos"]["x"], p["gridPos"]["y"], p["gridPos"]["w"], p["gridPos"]["h"]) for p in dashboard["panels"]]
    cells = [(column, row) for x, y, w, h in places for column in range(x, x + w) for row in range(y, y + h)]
    assert len(cells) == len(set(cells)), "two panels overlap"
    assert max(column for column, _ in cells) < 24
