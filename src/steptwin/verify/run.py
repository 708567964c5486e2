"""Checks over a real line, in a thread that waits."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.tcp import Channel
from steptwin.errors import LineFailure
from steptwin.verify.check import CheckNeed, CheckResult, CheckSteps, NotRestored
from steptwin.verify.kind import ReadyChecks
from steptwin.verify.kinds import checked_kind
from steptwin.verify.report import Report
from steptwin.verify.running import Progress, T, check_all, complete

PAUSE_S = 0.01
"""Between two requests: a MIC488 serves 100 a second (manual 2)."""
R = TypeVar("R")


def verify(
    address: DeviceAddress,
    now: str,
    version: str,
    *,
    write: bool = False,
    move: tuple[int, float] | None = None,
    progress: Progress = lambda id_, number, count: None,
    is_cancelled: Callable[[], bool] = lambda: False,
) -> Report:
    """Check a controller.

    ``now`` (ISO 8601) and ``version`` (of steptwin) are for the report; ``move``: an axis of a MIC488 and how far it may move.

    Raises `Misuse`, `Refusal`, `LineFailure`.
    """
    kind = checked_kind(address.kind)
    permitted = frozenset({CheckNeed.READ, *((CheckNeed.WRITE,) if write else ()), *((CheckNeed.MOVE,) if move else ())})
    ready = kind.prepare(address, permitted, move)
    results = _over(ready, permitted, progress, is_cancelled)
    names = ", ".join(need.name.lower() for need in sorted(permitted))
    device = {**ready.about(), "at": address.place}
    return Report(device, version, now, names, complete(results, kind.unchecked), len(results) == len(ready.checks))


# ---------------------------------------------------------------------- the line


def _over(
    ready: ReadyChecks[T], permitted: frozenset[CheckNeed], progress: Progress, is_cancelled: Callable[[], bool]
) -> list[CheckResult]:
    """The results; not all of them if it was cancelled."""
    talk = ready.talk
    channel = ready.endpoint.open()
    try:
        return carry_out(channel, check_all(talk, ready.checks, permitted, progress=progress, is_cancelled=is_cancelled))
    except NotRestored:
        raise
    except LineFailure as failure:
        if not talk.probes.unrestored:
            raise
        raise NotRestored(f"{failure}; not put back: {'; '.join(talk.probes.unrestored.values())}") from failure
    except KeyboardInterrupt:
        if not talk.probes.unrestored:
            raise
        raise NotRestored(f"interrupted; not put back: {'; '.join(talk.probes.unrestored.values())}") from None
    finally:
        channel.close()


def carry_out(channel: Channel, steps: CheckSteps[R]) -> R:
    """Carry out the steps, and return their result."""
    try:
        send = next(steps)
        while True:
            if not send.at_once:
                _drain(channel)
            received = b""
            if send.data:
                channel.write(send.data)
            end = time.monotonic() + send.wait_s
            while (left_s := end - time.monotonic()) > 0.0 and not (received and send.is_whole(received)):
                received += channel.read(left_s)
            send = steps.send(received)
    except StopIteration as done:
        return done.value


def _drain(channel: Channel) -> None:
    """Wait the pause between two requests, and drop what comes late."""
    end = time.monotonic() + PAUSE_S
    while (left_s := end - time.monotonic()) > 0.0:
        channel.read(left_s)
