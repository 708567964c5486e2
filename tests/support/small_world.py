"""A world of three controllers, one with an axis and a button."""

from __future__ import annotations

from textwrap import dedent

from steptwin.files.world import World

SMALL = """
    [world]
    seed = 3
    [[mic488]]
    name = "a"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = 100.0
    dec = 100.0
    vel = 40.0
    in_kl = "IN1"
    home_mode = "HOME1"
    limit_mode = "KL"
    [[mic488]]
    name = "b"
    [[mic488]]
    name = "c"
    [[axis]]
    name = "x"
    drive = "a.M1"
    travel = [-1.0, 101.0]
    start = 50.0
    [[axis.switch]]
    below = 0.0
    to = "a.IN1"
    hysteresis = 0.2
    [[wire]]
    from = "a.OUT1"
    to = "b.IN3"
    delay = "20 ms"
    [[button]]
    name = "go"
    to = "b.IN4"
"""


def small(more: str = "") -> World:
    return World.from_toml(dedent(SMALL) + dedent(more))


def moved(world: World, position: float) -> World:
    axis = world.mic488["a"].axis[1]
    axis.enable()
    axis.move_to(position)
    return world
