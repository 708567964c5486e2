"""``steptwin jog``: an axis, as long as it is held.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

import sys
import time
from typing import Annotated

import typer

from steptwin.cli.device import (
    Device,
    Json,
    LogFrames,
    SuspensionDetector,
    complain,
    find,
    kind_of,
    opened,
    print_json,
)
from steptwin.cli.keys import interruptible, keys
from steptwin.cli.motions import motion_data
from steptwin.errors import Misuse

HOLD_RANGE_S = (0.2, 2.0)


def command(
    velocity: Annotated[str, typer.Argument(metavar="AXIS=VELOCITY", help="1=5, in the configured unit per second.")],
    device: Device = None,
    seconds: Annotated[float | None, typer.Option(help="End after so long. Needed where there is no terminal.")] = None,
    hold: Annotated[float, typer.Option(help="Seconds the axis runs on when this command is killed, 0.2 to 2.")] = 0.4,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Jog an axis until a key is pressed. It is a dead-man's switch: if this command dies, the axis stops by itself.

    An M1486 makes one short move after the other, of 0.15 s at the velocity given (full steps/s), whatever --hold is. E types,
    which write every command into their EEPROM, are not jogged, nor is anything on a line below 1200 bit/s.
    """
    from steptwin.drivers.kind import DriverKind
    from steptwin.drivers.typed import tied

    address = find(device)
    kind = kind_of(address)
    if not kind.offers(DriverKind.jog):
        raise kind.lacks("jog")
    given = tied([velocity], kind.axes)
    if seconds is None and not sys.stdin.isatty():
        raise Misuse("no terminal, so no key can end the jog: give --seconds")
    if seconds is not None and not seconds > 0.0:
        raise Misuse(f"--seconds {seconds:g}: permitted are more than 0")
    if not HOLD_RANGE_S[0] <= hold <= HOLD_RANGE_S[1]:
        raise Misuse(f"--hold {hold:g}: permitted are {HOLD_RANGE_S[0]:g} to {HOLD_RANGE_S[1]:g} s")
    ((axis, speed),) = given.items()
    held_up = SuspensionDetector()
    with opened(address, observe=False, log_frames=log_frames) as driver, interruptible(), keys() as pressed:
        held_up.check()
        jog = kind.jog(driver, axis, speed, hold)
        begun = time.monotonic()
        end_at = None if seconds is None else begun + seconds - jog.ahead_s
        try:
            with jog:
                if seconds is None:
                    complain(f"M{axis} runs at {speed:g} {jog.unit}/s; any key stops it")
                while not pressed() and (end_at is None or time.monotonic() < end_at) and jog.hold():
                    pass
        except KeyboardInterrupt:
            complain("released")
        end = jog.ended()._replace(after_s=time.monotonic() - begun)
    if json:
        print_json(motion_data(end))
    else:
        typer.echo(str(end))
    if not end.ok:
        raise typer.Exit(1)
