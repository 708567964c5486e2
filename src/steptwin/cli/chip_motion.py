"""move, home, seek, jog and stop for an M1486. Positions are in full steps.

From Python: `steptwin.drivers.m1486.M1486`. Ctrl-C, SIGTERM and a closed terminal end a motion with K, which makes the position
unknown unless it was a seek.
"""

from __future__ import annotations

import contextlib
import dataclasses
import re
import time
from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import typer

from steptwin.cli.chip import chip_at, opened_chip
from steptwin.cli.device import SuspensionDetector, complain, print_json, print_started
from steptwin.cli.keys import interruptible
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.drivers.address import DeviceAddress
    from steptwin.drivers.m1486 import M1486, ChipMoveEnd

LOST = "; the chip has counted the whole move, so its position is wrong: home the axis, or set POSITION"
"""After Kill in a move (M-16)."""
HOLD_RANGE_S = (0.2, 2.0)
LATE_S = 2.0
"""A jog ends if one of its moves takes this much longer than planned: it was suspended, or its line failed."""
_SOUGHT = re.compile(r"([+-])B?(\d{1,2})", re.IGNORECASE)


def axis_value(given: Sequence[str], form: str) -> str:
    """The text behind ``1=``: an M1486 has one axis. Raises `Misuse` for another axis."""
    text = " ".join(given)
    name, _, value = text.partition("=")
    if name.strip().upper().removeprefix("M") != "1":
        raise Misuse(f"{text!r}: an M1486 has one axis: expected 1={form}")
    return value


class SeekTarget(NamedTuple):
    """A line to seek, and the direction: 1 or -1."""

    direction: int
    line: int


def sought(given: Sequence[str]) -> SeekTarget:
    """``1=-B8``. Raises `Misuse`."""
    match = _SOUGHT.fullmatch(axis_value(given, "-B8").strip())
    if match is None:
        raise Misuse(f"{' '.join(given)!r}: expected the direction and the line of an M1486, such as 1=-B8 or 1=+B8")
    return SeekTarget(1 if match[1] == "+" else -1, int(match[2]))


def move(
    address: DeviceAddress,
    target: float,
    *,
    by: bool,
    velocity: float | None,
    wait: bool,
    timeout: float | None,
    json: bool,
    log_frames: bool,
) -> None:
    """Move to a position or by a distance. ``velocity`` sets V, full steps/s. Ends with exit code 1 when it does not arrive."""

    with _opened(address, log_frames=log_frames) as (chip, held_up), _stopping(chip, LOST):
        if velocity is not None:
            chip.configure(velocity=velocity)
        held_up.check()
        (chip.move_by if by else chip.move_to)(target)
        if wait:
            _report(_wait(chip, timeout), json=json)


def seek(
    address: DeviceAddress, wanted: SeekTarget, *, home: bool, wait: bool, timeout: float | None, json: bool, log_frames: bool
) -> None:
    """Move at start/stop speed until a line has its end level; ``home``: that is position 0 then."""
    if home and not wait:
        raise Misuse("--no-wait is not possible for an M1486: the command sets the position at the end of the seek")
    with _opened(address, log_frames=log_frames) as (chip, held_up), _stopping(chip):
        held_up.check()
        chip.seek(wanted.direction, wanted.line)
        if not wait:
            return
        end = _wait(chip, timeout)
        if home and end.ok:
            chip.set_position(0.0)
            end = dataclasses.replace(end, position=0.0)
        _report(end, json=json)


def jog(
    address: DeviceAddress,
    velocity: float,
    *,
    seconds: float | None,
    hold: float,
    pressed: Callable[[], bool],
    json: bool,
    log_frames: bool,
) -> None:
    """Short moves, one after the other, until a key is pressed or the time is over; each takes the hold time.

    If this process dies, the chip completes its present move and gets no further one. ``velocity`` sets V, full steps/s; the
    moves are whole full steps.
    """
    from steptwin.m1486.variants import Store

    if not HOLD_RANGE_S[0] <= hold <= HOLD_RANGE_S[1]:
        raise Misuse(f"--hold {hold:g}: permitted are {HOLD_RANGE_S[0]:g} to {HOLD_RANGE_S[1]:g} s")
    with _opened(address, log_frames=log_frames) as (chip, held_up):
        if not velocity:
            raise Misuse("1=0: a jog needs a velocity")
        if chip.variant.store is Store.EEPROM:
            raise Misuse(f"{chip.variant.title} writes every command into its EEPROM: 'steptwin move 1=STEPS --by' moves it once")
        chip.configure(velocity=abs(velocity))
        if seconds is None:
            complain(f"the motor moves at {velocity:g} {chip.unit}/s in steps of {hold:g} s; any key ends it")
        begun = time.monotonic()
        left = hold if seconds is None else min(hold, seconds)
        steps = round(velocity * left) or (1 if velocity > 0.0 else -1)
        with _stopping(chip, LOST):
            while steps:
                held_up.check()
                at = time.monotonic()
                chip.move_by(steps)
                end = chip.wait(check=False)
                now = time.monotonic()
                if not end.ok or pressed() or now - at > 2.0 * hold + LATE_S:
                    break
                left = hold if seconds is None else min(hold, max(0.0, seconds - (now - begun)))
                steps = round(velocity * left)
        _report(dataclasses.replace(end, after_s=time.monotonic() - begun), json=json)


def stop(address: DeviceAddress, *, program: bool, log_frames: bool) -> None:
    """Send K without any preceding query: a chip does not respond while it moves."""
    chip = chip_at(address, log_frames=log_frames)
    chip.open_line()
    try:
        (chip.stop_program if program else chip.stop)()
    finally:
        chip.close()


# ---------------------------------------------------------------------- what they have in common


@contextlib.contextmanager
def _opened(address: DeviceAddress, *, log_frames: bool) -> Generator[tuple[M1486, SuspensionDetector]]:
    held_up = SuspensionDetector()
    with opened_chip(address, log_frames=log_frames) as chip:
        held_up.check()
        yield chip, held_up


@contextlib.contextmanager
def _stopping(chip: M1486, note: str = "") -> Generator[None]:
    """Stop the motor on Ctrl-C and on signals that end the process; ``note`` is added to the message."""
    with interruptible():
        try:
            yield
        except KeyboardInterrupt:
            chip.stop()
            complain(f"stopped{note}")
            raise


def _wait(chip: M1486, timeout: float | None) -> ChipMoveEnd:
    """Wait for the end of the motion, and stop it at the timeout."""
    print_started(["M1"])
    end = chip.wait(timeout, check=False)
    if end.reason.name == "OVERDUE":
        chip.stop()
        complain("stopped: timeout")
    return end


def _report(end: ChipMoveEnd, *, json: bool) -> None:
    """Print how a motion ended. Exit code 1 if it did not end as intended."""
    if json:
        print_json({"ok": end.ok, "reason": end.reason.value, "position": end.position, "unit": end.unit, "after_s": end.after_s})
    else:
        typer.echo(str(end))
    if not end.ok:
        raise typer.Exit(1)
