"""What drives each input, as the description of a world says it."""

from __future__ import annotations

from steptwin import World
from steptwin.simulation.world.wiring import connections, terminal_name

TEXT = """
    [[mic488]]
    name = "a"
    [[axis]]
    name = "x"
    drive = "a.M1"
    unit = "mm"
    pulses_per_unit = 10
    switch = [{ to = "a.IN1", below = 0.0 }, { to = "safe.coil", above = 80.0, join = "series", contact = "NC" }]
    [[button]]
    name = "stop"
    to = "safe.coil"
    contact = "NC"
    join = "series"
    [[relay]]
    name = "safe"
    [[wire]]
    from = "safe.no"
    to = "a.IN2"
    inverted = true
    delay = "5ms"
    [[source]]
    to = "a.AIN1"
    kind = "constant"
    value = 4.0
    [[transducer]]
    name = "tape"
    of = "x.position"
    to = "a.AIN2"
    points = [[0.0, 0.0], [100.0, 10.0]]
"""


def test_each_input_has_its_sources() -> None:
    parts = World.from_toml(TEXT).objects
    found = {(one.source, terminal_name(parts, one.target)): (one.inverted, one.delay, one.join) for one in connections(parts)}
    assert found == {
        ("x.switch1", "a.IN1"): (False, 0, None),
        ("x.switch2", "safe.coil"): (True, 0, "series"),
        ("stop", "safe.coil"): (True, 0, "series"),
        ("safe.no", "a.IN2"): (True, 5_000_000, None),
        ("source", "a.AIN1"): (False, 0, None),
        ("tape", "a.AIN2"): (False, 0, None),
    }


def test_a_world_without_wiring_has_no_connections() -> None:
    assert not list(connections(World.from_toml('[[mic488]]\nname = "a"\n').objects))
