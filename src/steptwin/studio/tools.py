"""Actions of the requests of `steptwin.studio.toolrequests` that need no controller."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping
from typing import Any

from steptwin.studio import toolrequests as ask
from steptwin.studio.calculations import Calculations, gear
from steptwin.studio.configurations import Configurations
from steptwin.wire.pcapng import capture


def tools(calculations: Calculations, configurations: Configurations) -> Mapping[object, Callable[[Any], object]]:
    """By class of request."""
    return {
        ask.ReadQuantities: lambda wanted: calculations.quantities(wanted.machine, wanted.axis),
        ask.Calculate: lambda wanted: calculations.calculate(wanted.machine, wanted.axis, wanted.given, wanted.find),
        ask.ConvertGear: lambda wanted: gear(wanted.motor_steps, wanted.microsteps, wanted.ratio, wanted.lead),
        ask.MakeCapture: lambda wanted: {"data": b64encode(b"".join(capture(wanted.frames))).decode("ascii")},
        ask.EditConfiguration: lambda wanted: configurations.edit(wanted.machine, wanted.text, wanted.changes),
    }
