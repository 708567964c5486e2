"""An operator panel for a feeder: its axis is homed and sent to named places.

Start it as ``python panel.py tcp://127.0.0.1:5020`` or with a serial port, and type ``home``, ``go load``, ``show``, ``quit``.
"""

from __future__ import annotations

import sys

from steptwin.drivers import Mic488, Reason
from steptwin.errors import LineFailure, Refusal

PLACES = {"load": 0.0, "cut": 120.0, "unload": 200.0}
"""In mm."""
HOMING = -10.0
"""In mm/s; negative: towards the switch KL."""


class Panel:
    """What the operator types goes in, what the display shows comes out."""

    def __init__(self, feeder: Mic488) -> None:
        self._feeder = feeder
        self._axis = feeder.axis(1)
        self._is_homed = False

    def do(self, command: str) -> str:
        try:
            match command.split():
                case ["home"]:
                    return self._home()
                case ["go", place]:
                    return self._go(place)
                case ["show"]:
                    return f"at {self._axis.position():.2f} mm"
                case _:
                    return f"home, go {' | '.join(PLACES)}, show, quit"
        except LineFailure:
            # What the axis does now nobody knows.
            self._is_homed = False
            return "NO CONNECTION. Check the cable, then home."
        except Refusal as refusal:
            self._is_homed = False
            return f"STOPPED: {refusal}"

    def _home(self) -> str:
        self._is_homed = False
        self._axis.enable()
        self._axis.home(HOMING)
        self._axis.wait()
        self._is_homed = True
        return "homed"

    def _go(self, place: str) -> str:
        if place not in PLACES:
            return f"no place {place}: {', '.join(PLACES)}"
        if not self._is_homed:
            return "home first"
        self._axis.move_to(PLACES[place])
        end = self._axis.wait(check=False)
        if end.reason is Reason.COMMUNICATION:
            raise LineFailure(end.detail)
        if not end.ok:
            self._is_homed = False
            return f"STOPPED: {end.reason.value}"
        return f"at {place}"


def main() -> None:
    with Mic488(sys.argv[1]) as feeder:
        panel = Panel(feeder)
        print("ready", flush=True)
        for line in sys.stdin:
            if line.strip() == "quit":
                break
            print(panel.do(line), flush=True)


if __name__ == "__main__":
    main()
