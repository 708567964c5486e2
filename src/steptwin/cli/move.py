"""``steptwin enable``, ``disable``, ``home``, ``seek``, ``move``, ``jog``, ``stop``: axes from the command line.

From Python: `steptwin.drivers.Mic488` and its axes.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import chip_motion
from steptwin.cli.device import (
    Axes,
    Device,
    Json,
    LogFrames,
    SuspensionDetector,
    axes_of,
    complain,
    find,
    number_of,
    opened,
    print_json,
    print_started,
    tied,
)
from steptwin.cli.keys import interruptible, keys
from steptwin.errors import Misuse, Refusal

if TYPE_CHECKING:
    from steptwin.drivers import Mic488, MoveEnd
    from steptwin.drivers.address import DeviceAddress

Wait = Annotated[bool, typer.Option("--wait/--no-wait", help="Wait for the end, and stop at Ctrl-C.")]
Timeout = Annotated[float | None, typer.Option(help="Seconds to wait at most. Default: computed from the motion.")]


def enable(axes: Axes = None, device: Device = None, log_frames: LogFrames = False) -> None:
    """Switch drives on."""
    with opened(find(device), log_frames=log_frames) as mic:
        mic.enable(*axes_of(axes))


def disable(axes: Axes = None, device: Device = None, log_frames: LogFrames = False) -> None:
    """Switch drives off. Pulses end at once."""
    with opened(find(device), log_frames=log_frames) as mic:
        mic.disable(*axes_of(axes))


def stop(
    axes: Axes = None,
    device: Device = None,
    program: Annotated[
        bool, typer.Option("--program", help="End the program too, which switches drives and outputs off.")
    ] = False,
    log_frames: LogFrames = False,
) -> None:
    """Stop axes at once, without ramp; an M1486 with its ramp. A program that runs may move them again: see --program."""
    address = find(device)
    if address.kind == "m1486":
        chip_motion.stop(address, program=program, log_frames=log_frames)
        return
    with opened(find(device), log_frames=log_frames) as mic:
        mic.stop(*axes_of(axes))
        if program:
            mic.program.stop()
        elif mic.program.state() == 1:
            complain("the program in the controller runs on and may move the axes again: --program ends it")


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
    from steptwin.drivers.line import check_wait

    address = find(device)
    if address.kind == "m1486":
        check_wait(timeout)
        target = number_of(chip_motion.axis_value(targets, "NUMBER"), " ".join(targets))
        chip_motion.move(address, target, by=by, velocity=velocity, wait=wait, timeout=timeout, json=json, log_frames=log_frames)
        return
    values = tied(targets)

    held_up = SuspensionDetector()

    def begin(mic: Mic488, begun: set[int]) -> None:
        held_up.check()
        if velocity is not None:
            for axis in values:
                mic.axis(axis).set_ramp(velocity=velocity)
        held_up.check()
        if len(values) > 1:
            (mic.move_together_by if by else mic.move_together)(values)
        else:
            ((axis, value),) = values.items()
            (mic.axis(axis).move_by if by else mic.axis(axis).move_to)(value)
        begun.update(values)

    _do(address, values, begin, wait=wait, timeout=timeout, json=json, log_frames=log_frames)


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
    from steptwin.drivers.line import check_wait

    address = find(device)
    if address.kind == "m1486":
        check_wait(timeout)
        wanted = chip_motion.sought(velocities)
        chip_motion.seek(address, wanted, home=True, wait=wait, timeout=timeout, json=json, log_frames=log_frames)
        return
    values = tied(velocities)

    held_up = SuspensionDetector()

    def begin(mic: Mic488, begun: set[int]) -> None:
        for axis, velocity in values.items():
            held_up.check()
            mic.axis(axis).home(velocity)
            begun.add(axis)

    _do(address, values, begin, wait=wait, timeout=timeout, json=json, log_frames=log_frames)


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
    from steptwin.drivers.line import check_wait

    check_wait(timeout)
    address = find(device)
    if address.kind != "m1486":
        raise Misuse("seek is a command of the M1486; a MIC488 has home")
    wanted = chip_motion.sought([line])
    chip_motion.seek(address, wanted, home=False, wait=wait, timeout=timeout, json=json, log_frames=log_frames)


def _do(
    address: DeviceAddress,
    values: Mapping[int, float],
    begin: Callable[[Mic488, set[int]], None],
    *,
    wait: bool,
    timeout: float | None,
    json: bool,
    log_frames: bool,
) -> None:
    from steptwin.drivers.line import check_wait

    check_wait(timeout)
    with opened(address, observe=False, log_frames=log_frames) as mic, interruptible():
        begun: set[int] = set()
        try:
            begin(mic, begun)
            if not wait:
                return
            print_started([f"M{axis}" for axis in values])
            ends = mic.wait(*values, timeout_s=timeout, check=False)
        except (Misuse, Refusal):
            if begun:
                mic.stop(*begun)
            raise
        except BaseException:
            mic.stop(*values)
            complain(f"stopped: {' '.join(f'M{axis}' for axis in values)}")
            raise
        if any(end.reason.name == "OVERDUE" for end in ends.values()):
            mic.stop(*values)
            complain("stopped: timeout")
    if json:
        print_json([_data(end) for end in ends.values()])
    else:
        typer.echo("\n".join(map(str, ends.values())))
    if not all(end.ok for end in ends.values()):
        raise typer.Exit(1)


def _data(end: MoveEnd) -> dict[str, Any]:
    return {
        "axis": end.axis,
        "ok": end.ok,
        "reason": end.reason.value,
        "position": end.position_u,
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

    An M1486 makes one short move after the other, at the velocity given (full steps/s), which V keeps. E types, which write every
    command into their EEPROM, are not jogged.
    """
    ((axis, speed),) = tied([velocity]).items()
    if seconds is None and not sys.stdin.isatty():
        raise Misuse("no terminal, so no key can end the jog: give --seconds")
    if seconds is not None and not seconds > 0.0:
        raise Misuse(f"--seconds {seconds:g}: permitted are more than 0")
    address = find(device)
    if address.kind == "m1486":
        with keys() as pressed:
            chip_motion.jog(address, speed, seconds=seconds, hold=hold, pressed=pressed, json=json, log_frames=log_frames)
        return
    held_up = SuspensionDetector()
    with opened(address, observe=False, log_frames=log_frames) as mic, interruptible(), keys() as pressed:
        held_up.check()
        held = mic.axis(axis).jog(speed, hold_s=hold)
        try:
            with held:
                if seconds is None:
                    complain(f"M{axis} runs at {speed:g} {mic.axis(axis).unit}/s; any key stops it")
                end_at = None if seconds is None else time.monotonic() + seconds
                while not pressed() and (end_at is None or time.monotonic() < end_at) and held.hold():
                    pass
        except KeyboardInterrupt:
            complain("released")
        end = held.end
        rest = mic.axis(axis).wait(check=False)
    result = rest if end is None else dataclasses.replace(end, position_u=rest.position_u)
    if json:
        print_json(_data(result))
    else:
        typer.echo(str(result))
    if not result.ok:
        raise typer.Exit(1)
