"""``steptwin lsp``: the editor server.

From Python: `steptwin.lsp.editorsession`, with `steptwin.services` for the tables of gateways and histories.
"""

from __future__ import annotations

import typer


def command() -> None:
    """Serve an editor on standard input and output (Language Server Protocol): programs, tables, configurations, worlds."""
    import steptwin.services  # noqa: F401  their tables are checked, too
    from steptwin.lsp import serve_stdio

    raise typer.Exit(serve_stdio())
