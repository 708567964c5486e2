"""The editor server: `steptwin lsp` speaks the Language Server Protocol.

`steptwin.lsp.session` is what a client sees, without input and output: open texts and questions about them, in characters of the
text. `steptwin.lsp.server` puts the protocol around it, and alone knows its types. Each language is an `Analysis` of a text.
"""

from __future__ import annotations

from steptwin.extras import missing


def serve_stdio() -> None:
    """Serve an editor on standard input and output until it disconnects. Raises `Misuse` without pygls."""
    try:
        import pygls  # noqa: F401
    except ImportError as error:
        raise missing("the editor server", ["pygls"]) from error
    from steptwin.lsp.server import serve_stdio as serve

    serve()
