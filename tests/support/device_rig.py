"""A world with a controller of each kind, and their drivers, in virtual time."""

from __future__ import annotations

from steptwin.drivers.m1486 import M1486
from steptwin.drivers.mic488.sync import Mic488
from steptwin.files.world import World
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, connected_chip, connected_driver

CELL = """
[world]
name = "cell"

[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"

[[line]]
name = "chips"
kind = "m1486"
tcp = "127.0.0.1:0"

[[mic488]]
name = "table"
line = "bus"

[mic488.M1]
unit = "mm"
gear = 100.0
acc = 100.0
dec = 100.0
vel = 40.0
in_kl = "IN1"
home_mode = "HOME1"

[[m1486]]
name = "drum"
line = "chips"
variant = "B"
address = 3

[[axis]]
name = "x"
drive = "table.M1"
travel = [-5.0, 105.0]
start = 10.0

[[axis.switch]]
below = 0.0
to = "table.IN1"
"""


class Rig:
    """A world in virtual time, and drivers on its lines."""

    def __init__(self) -> None:
        self.world = World.from_toml(CELL)
        self.live = LiveWorld(self.world)
        self.time = VirtualTime(self.live)
        bus = MemoryEndpoint(self.time, lambda: ClientPort(self.live, "bus", "tcp-1", "tcp"), "bus")
        config = self.world.mic488["table"].device.config
        self.mic: Mic488 = connected_driver(bus, self.time, 1, framed=True, firmware="1.70", config=config)
        chips = MemoryEndpoint(self.time, lambda: ClientPort(self.live, "chips", "raw-1", "raw"), "chips")
        self.chip: M1486 = connected_chip(chips, self.time, 3)
