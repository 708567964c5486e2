"""``steptwin dap``: the debug adapter.

From Python: `steptwin.debug.debugger.Debugger`.
"""

from __future__ import annotations

from contextlib import suppress


def command() -> None:
    """Serve an editor on standard input and output (Debug Adapter Protocol): breakpoints, steps, also backwards in time."""
    from steptwin.cli.keys import interruptible
    from steptwin.dap.stdio import serve_stdio

    with interruptible(), suppress(KeyboardInterrupt):
        serve_stdio()
