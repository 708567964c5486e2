"""Common parts of the commands that move axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.device import (
    SuspensionDetector,
    axes_of,
    complain,
    find,
    kind_of,
    opened,
    print_json,
    print_started,
)
from steptwin.cli.keys import interruptible
from steptwin.errors import Misuse, Refusal

if TYPE_CHECKING:
    from steptwin.drivers.kind import DeviceAddress, DeviceMotion, EndedMotion

Wait = Annotated[bool, typer.Option("--wait/--no-wait", help="Wait for the end, and stop at Ctrl-C.")]
Timeout = Annotated[float | None, typer.Option(help="Seconds to wait at most. Default: computed from the motion.")]


def switch_drives(command: str, axes: Sequence[str] | None, device: str | None, *, log_frames: bool) -> None:
    """Switch drives on, by the command ``enable``, or off, by ``disable``."""
    from steptwin.drivers.kind import DriverKind

    address = find(device)
    kind = kind_of(address)
    if not kind.offers(DriverKind.enable):
        raise kind.lacks(command)
    wanted = axes_of(axes, kind)
    with opened(address, log_frames=log_frames) as driver:
        kind.enable(driver, wanted, command == "enable")


def carry_out(
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
        print_json([motion_data(end) for end in ends])
    else:
        typer.echo("\n".join(map(str, ends)))
    if not all(end.ok for end in ends):
        raise typer.Exit(1)


def motion_data(end: EndedMotion) -> dict[str, Any]:
    """For JSON."""
    return {
        "axis": end.axis,
        "ok": end.ok,
        "reason": end.reason,
        "position": end.position,
        "unit": end.unit,
        "after_s": round(end.after_s, 3),
        **({"detail": end.detail} if end.detail else {}),
    }
