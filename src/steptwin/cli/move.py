"""``steptwin enable``, ``disable``, ``home``, ``seek``, ``move``, ``jog``, ``stop``: axes from the command line.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.device import (
    Axes,
    Device,
    Json,
    LogFrames,
    SuspensionDetector,
    axes_of,
    complain,
    find,
    kind_of,
    log_of,
    no_command,
    opened,
    other_kinds_named,
    print_json,
    print_started,
)
from steptwin.cli.keys import interruptible, keys
from steptwin.errors import Misuse, Refusal

if TYPE_CHECKING:
    from steptwin.drivers.kind import DeviceAddress, DeviceMotion, EndedMotion

Wait = Annotated[bool, typer.Option("--wait/--no-wait", help="Wait for the end, and stop at Ctrl-C.")]
Timeout = Annotated[float | None, typer.Option(help="Seconds to wait at most. Default: computed from the motion.")]
HOLD_RANGE_S = (0.2, 2.0)


def enable(axes: Axes = None, device: Device = None, log_frames: LogFrames = False) -> None:
    """Switch drives on."""
    _switch("enable", axes, device, log_frames=log_frames)


def disable(axes: Axes = None, device: Device = None, log_frames: LogFrames = False) -> None:
    """Switch drives off. Pulses end at once."""
    _switch("disable", axes, device, log_frames=log_frames)


def _switch(command: str, axes: Sequence[str] | None, device: str | None, *, log_frames: bool) -> None:
    address = find(device)
    kind = kind_of(address)
    if kind.enable is None:
        raise no_command(kind, command)
    wanted = axes_of(axes, kind)
    with opened(address, log_frames=log_frames) as driver:
        kind.enable(driver, wanted, command == "enable")


def stop(
    axes: Axes = None,
    device: Device = None,
    program: Annotated[
        bool, typer.Option("--program", help="End the program too, which switches drives and outputs of a MIC488 off.")
    ] = False,
    log_frames: LogFrames = False,
) -> None:
    """Stop axes at once, without ramp; an M1486 with its ramp, and its program. The program of a MIC488 may move them again: see
    --program."""
    address = find(device)
    kind = kind_of(address)
    with other_kinds_named(kind, address):
        warning = kind.stop(address, log_of(log_frames), axes_of(axes, kind), program)
    if warning is not None:
        complain(warning)


def move(
    targets: Annotated[list[str], typer.Argument(metavar="AXIS=POSITION", help="1=100 2=-12.5, in the configured units.")],
    device: Device = None,
    by: Annotated[bool, typer.Option("--by", help="The numbers are distances.")] = False,
    velocity: Annotated[float | None, typer.Option(help="Set VMAX first.")] = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Move axes; several begin in the same instant. Exit code 1 when one does not arrive.

    An M1486 has axis 1, and its unit is the full step.
    """
    from steptwin.drivers.kind import WantedMoves
    from steptwin.drivers.typed import tied

    address = find(device)
    kind = kind_of(address)
    motion = kind.move(WantedMoves(tied(targets, kind.axes), by, velocity))
    _do(address, motion, wait=wait, timeout=timeout, json=json, log_frames=log_frames)


def home(
    velocities: Annotated[
        list[str],
        typer.Argument(
            metavar="AXIS=VELOCITY", help="1=-20: towards KL; positive: towards KR. M1486: 1=-B8, direction and line."
        ),
    ],
    device: Device = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Home axes, at the velocities given. Exit code 1 when one does not arrive.

    An M1486 seeks the line at start/stop speed, and its position is 0 there.
    """
    address = find(device)
    kind = kind_of(address)
    if kind.home is None:
        raise no_command(kind, "home")
    _do(address, kind.home(velocities), wait=wait, timeout=timeout, json=json, log_frames=log_frames)


def seek(
    line: Annotated[str, typer.Argument(metavar="1=LINE", help="1=-B8: in negative direction to line B8; 1=+B8: positive.")],
    device: Device = None,
    wait: Wait = True,
    timeout: Timeout = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Move an M1486 at start/stop speed until a line has its end level. Exit code 1 when it does not arrive.

    That is low for B1 to B3, B8 to B11 and B16 to B19, else high. The number of the line is in the internal variable afterwards.
    """
    address = find(device)
    kind = kind_of(address)
    if kind.seek is None:
        raise no_command(kind, "seek")
    _do(address, kind.seek([line]), wait=wait, timeout=timeout, json=json, log_frames=log_frames)


def _do(
    address: DeviceAddress, motion: DeviceMotion[Any], *, wait: bool, timeout: float | None, json: bool, log_frames: bool
) -> None:
    """Begin a motion and wait for its end. What interrupts it stops the axes."""
    from steptwin.drivers.line import check_wait

    check_wait(timeout)
    kind = kind_of(address)
    if motion.must_wait and not wait:
        raise Misuse(f"--no-wait is not possible for {kind.title}: {motion.must_wait}")
    held_up = SuspensionDetector()
    with opened(address, observe=False, log_frames=log_frames) as driver, interruptible():
        begun: set[int] = set()
        try:
            motion.begin(driver, begun, held_up.check)
            if not wait:
                return
            print_started([f"M{axis}" for axis in motion.axes])
            ends = [motion.end(driver, end) if end.ok else end for end in kind.wait(driver, motion.axes, timeout)]
        except (Misuse, Refusal):
            if begun:
                kind.halt(driver, begun)
            raise
        except BaseException:
            kind.halt(driver, motion.axes)
            complain(f"stopped: {' '.join(f'M{axis}' for axis in motion.axes)}{motion.stop_note}")
            raise
        if any(end.is_overdue for end in ends):
            kind.halt(driver, motion.axes)
            complain(f"stopped: timeout{motion.stop_note}")
    if json:
        print_json([_data(end) for end in ends])
    else:
        typer.echo("\n".join(map(str, ends)))
    if not all(end.ok for end in ends):
        raise typer.Exit(1)


def _data(end: EndedMotion) -> dict[str, Any]:
    return {
        "axis": end.axis,
        "ok": end.ok,
        "reason": end.reason,
        "position": end.position,
        "unit": end.unit,
        "after_s": round(end.after_s, 3),
        **({"detail": end.detail} if end.detail else {}),
    }


def jog(
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
    from steptwin.drivers.typed import tied

    address = find(device)
    kind = kind_of(address)
    if kind.jog is None:
        raise no_command(kind, "jog")
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
        print_json(_data(end))
    else:
        typer.echo(str(end))
    if not end.ok:
        raise typer.Exit(1)
