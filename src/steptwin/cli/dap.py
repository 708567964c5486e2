"""``steptwin dap``: the debug adapter.

From Python: `steptwin.debug.debugger.Debugger`.
"""

from __future__ import annotations


def dap() -> None:
    """Serve an editor on standard input and output (Debug Adapter Protocol): breakpoints, steps, also backwards in time."""
    from steptwin.dap.stdio import serve_stdio

    serve_stdio()
