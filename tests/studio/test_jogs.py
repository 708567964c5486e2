"""Jogs of viewers."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.studio_rig import Studio, Tab


def jogging(studio: Studio, tab: Tab, velocity: float = 40.0, **where: object) -> dict[str, Any]:
    tab.ok("enable", controller="table", axis=1)
    studio.run(100)
    return tab.ok("jog", **{"controller": "table", "axis": 1, **where}, velocity=velocity)


def test_a_jog_goes_on_while_it_is_renewed_and_stands_in_time_afterwards() -> None:
    studio = Studio()
    tab = studio.open()
    lease = jogging(studio, tab)
    assert 160 <= lease["lasts_ms"] <= 250
    for _ in range(40):
        studio.run(80)
        assert tab.ok("renew", lease=lease["lease"]) == lease
    assert studio.value("table.M1.velocity") == 40.0
    studio.run(300)
    assert studio.value("table.M1.velocity") == 0.0
    tab.read()
    assert tab.newest("leases") == []
    assert tab.error("renew", lease=lease["lease"])[0] == "refusal"


@pytest.mark.parametrize("ends", ["close", "stop", "stop_all", "let_go", "taken over", "release_control", "stop of another"])
def test_what_ends_a_jog(ends: str) -> None:
    studio = Studio()
    tab, other = studio.open(), studio.open()
    lease = jogging(studio, tab)
    studio.run(80)
    other.read()
    assert other.newest("leases") == [{"lease": 1, "viewer": 1, "controller": "table", "axis": 1, "velocity": 40.0}]
    match ends:
        case "close":
            tab.close()
        case "stop":
            tab.ok("stop", controller="table", axis=1)
        case "stop_all" | "release_control":
            tab.ok(ends)
        case "let_go":
            tab.ok("let_go", lease=lease["lease"])
        case "taken over":
            other.ok("take_control", over=True)
        case "stop of another":
            other.ok("stop", controller="table")
    other.read()
    assert other.newest("leases") == []
    studio.run(300)
    assert studio.value("table.M1.velocity") == 0.0
    assert studio.value("table.M1_VMAX") == 40.0
    if ends != "close":
        assert tab.error("renew", lease=lease["lease"])[0] == "refusal"
        tab.ok("let_go", lease=lease["lease"])  # what has ended may be let go


def test_a_lease_is_its_viewers_alone() -> None:
    studio = Studio()
    tab, other = studio.open(), studio.open()
    lease = jogging(studio, tab)["lease"]
    assert other.error("renew", lease=lease)[0] == "refusal"
    assert other.error("let_go", lease=lease) == ("refusal", "lease 1 has ended, or is another viewer's")
    assert tab.ok("renew", lease=lease)["lease"] == lease


def test_a_second_jog_of_an_axis_replaces_the_first() -> None:
    studio = Studio()
    tab = studio.open()
    first = jogging(studio, tab, 10.0)
    studio.run(80)
    second = tab.ok("jog", controller="table", axis=1, velocity=-30.0)
    assert tab.error("renew", lease=first["lease"])[0] == "refusal"
    for _ in range(10):
        studio.run(80)
        tab.ok("renew", lease=second["lease"])
    assert studio.value("table.M1.velocity") == -30.0
    tab.ok("let_go", lease=second["lease"])
    studio.run(300)
    assert studio.value("table.M1_VMAX") == 40.0


@pytest.mark.parametrize("speed", [0.1, 1.0, 2.0, 5.0])
def test_a_lease_lasts_less_where_time_goes_fast(speed: float) -> None:
    studio = Studio()
    studio.speed = speed
    tab = studio.open()
    lease = jogging(studio, tab)
    for _ in range(60):
        studio.run(lease["lasts_ms"] / 3)
        tab.ok("renew", lease=lease["lease"])
    studio.run(300 / speed + 50)
    assert studio.value("table.M1.velocity") == 0.0


def test_where_time_goes_too_fast_a_jog_is_refused() -> None:
    studio = Studio()
    tab = studio.open()
    studio.speed = 10.0
    assert tab.error("jog", controller="table", axis=1, velocity=5)[1].startswith("time goes too fast for a jog (10 times)")


def test_a_chip_is_jogged_too() -> None:
    studio = Studio()
    tab = studio.open()
    lease = tab.ok("jog", controller="drum", axis=1, velocity=64 * 640)
    for _ in range(10):
        studio.run(50)
        tab.ok("renew", lease=lease["lease"])
    tab.close()
    studio.run(300)
    assert studio.value("drum.velocity") == 0.0
    assert studio.value("drum.position") > 64 * 100
