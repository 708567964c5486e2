"""The terminal monitor: a MIC488's registers, axes and frames, live. `steptwin monitor` behind its options.

`values` polls a device or follows a twin, `session` has them and acts, independent of terminals; `app` shows the results.
"""

from __future__ import annotations

import sys

from steptwin.errors import Misuse
from steptwin.extras import missing


def monitor(device: str | None, hz: float) -> None:
    """Run the monitor until the user ends it. Raises `Misuse`."""
    try:
        import textual  # noqa: F401
    except ImportError as error:
        raise missing("the monitor", ["textual"]) from error
    from steptwin.monitor.app import Monitor
    from steptwin.monitor.session import session_at

    session = session_at(device, hz)
    if not all(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr)):
        raise Misuse("the monitor needs a terminal to draw on and keys to be pressed; 'steptwin watch' prints lines")
    Monitor(session).run()
