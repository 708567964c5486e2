"""Two campaigns beside each other, such as before and after a change of the program."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import erfc, sqrt
from pathlib import Path
from typing import Any

from steptwin.errors import Misuse
from steptwin.inputfiles import read_recorded

REPORT = "report.json"
SURE = 0.05
"""A difference of pass rates is reported if its probability by chance is below this."""


def compare(before: Path, after: Path) -> dict[str, Any]:
    """Differences between the reports in two folders, as JSON. Raises `Misuse` for a folder without one.

    ``p_value``: how often chance alone makes pass rates differ so much (two proportions, pooled, two-sided).
    """
    one, other = _report(before), _report(after)
    try:
        old, new = ({(cause["property"], cause["cause"]) for cause in of["causes"]} for of in (one, other))
        return {
            "before": _head(one),
            "after": _head(other),
            "p_value": _p_value(one, other),
            "verdict": _verdict(one, other),
            "properties": {
                name: {"before": _property(one, name), "after": _property(other, name)}
                for name in {**one["properties"], **other["properties"]}
            },
            "gone": [list(cause) for cause in sorted(old - new)],
            "new": [list(cause) for cause in sorted(new - old)],
            "measures": _measures(one, other),
        }
    except (LookupError, TypeError, ValueError, AttributeError):
        raise Misuse(f"{before} or {after}: {REPORT} is not a report of a campaign") from None


def _report(folder: Path) -> Mapping[str, Any]:
    path = folder / REPORT
    if not path.is_file():
        raise Misuse(f"{folder} has no {REPORT}: run its campaign to the end")
    try:
        found = json.loads(read_recorded(path))
    except ValueError:
        raise Misuse(f"{path} is not a report of a campaign") from None
    if not isinstance(found, dict):
        raise Misuse(f"{path} is not a report of a campaign")
    return found


def _head(report: Mapping[str, Any]) -> dict[str, Any]:
    return {key: report[key] for key in ("name", "runs", "failed", "pass_rate", "interval", "digest")}


def _p_value(one: Mapping[str, Any], other: Mapping[str, Any]) -> float | None:
    n, m = one["runs"], other["runs"]
    if not n or not m:
        return None
    pooled = (one["failed"] + other["failed"]) / (n + m)
    deviation = sqrt(pooled * (1.0 - pooled) * (1.0 / n + 1.0 / m))
    if deviation == 0.0:
        return 1.0
    return erfc(abs(one["failed"] / n - other["failed"] / m) / deviation / sqrt(2.0))


def _verdict(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    p_value = _p_value(one, other)
    if one["digest"] == other["digest"]:
        return "the same"
    if p_value is None or p_value >= SURE:
        return "no difference of pass rates that chance would not make"
    return "better" if other["pass_rate"] > one["pass_rate"] else "worse"


def _property(report: Mapping[str, Any], name: str) -> dict[str, Any] | None:
    found = report["properties"].get(name)
    return None if found is None else {"failed": found["failed"], "robustness": found["robustness"]}


def _measures(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    means = [{measure["name"]: measure["mean"] for measure in of["measures"]} for of in (one, other)]
    return {name: {"before": means[0].get(name), "after": means[1].get(name)} for name in {**means[0], **means[1]}}


def lines(found: Mapping[str, Any]) -> list[str]:
    """Lines that describe the result of `compare`."""
    text = [
        f"{when}: {one['name']}, {one['runs']} runs, {one['failed']} failed"
        for when in ("before", "after")
        for one in [found[when]]
    ]
    p_value = "" if found["p_value"] is None else f" (p = {found['p_value']:.2g})"
    text.append(f"{found['verdict']}{p_value}")
    for name, both in found["properties"].items():
        text.append(f"  {name}: {_format(both['before'])} -> {_format(both['after'])}")
    for name, both in found["measures"].items():
        text.append(f"  mean of {name}: {_number(both['before'])} -> {_number(both['after'])}")
    text += [f"gone: {name}: {cause}" for name, cause in found["gone"]]
    text += [f"new: {name}: {cause}" for name, cause in found["new"]]
    return text


def _format(one: Mapping[str, Any] | None) -> str:
    return "-" if one is None else f"failed in {one['failed']}, least robustness {_number(one['robustness'])}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"
