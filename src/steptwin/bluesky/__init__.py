"""Controllers as devices of Bluesky, by ophyd-async, on the drivers (docs/bluesky.md).

with init_devices():
    table = Mic488Controller(AsyncMic488("tcp://127.0.0.1:5020"), points=["M1_STATUS", "IN3"])
RE(scan([table.readings], table.m1, 0.0, 20.0, 5))
"""

from __future__ import annotations

from steptwin.extras import missing

try:
    from steptwin.bluesky.analoginputs import AnalogInput, AnalogReadings
    from steptwin.bluesky.controllers import M1486Controller, Mic488Controller
    from steptwin.bluesky.labelledprograms import LabelledProgram
    from steptwin.bluesky.motors import FlyingMotor, MovingMotor
    from steptwin.bluesky.programs import RunnableProgram
    from steptwin.bluesky.readings import PointReadings
except ModuleNotFoundError as error:
    if (error.name or "").startswith("steptwin"):
        raise
    raise missing("steptwin.bluesky", "bluesky") from error

__all__ = [
    "AnalogInput",
    "AnalogReadings",
    "FlyingMotor",
    "LabelledProgram",
    "M1486Controller",
    "Mic488Controller",
    "MovingMotor",
    "PointReadings",
    "RunnableProgram",
]
