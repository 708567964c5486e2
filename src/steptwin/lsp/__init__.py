"""The editor server: `steptwin lsp` speaks the Language Server Protocol.

`steptwin.lsp.session` is what a client sees, without input and output: open texts and questions about them, in characters of the
text. `steptwin.lsp.server` puts the protocol around it, and alone knows its types. Each language is an `Analysis` of a text.
"""

from __future__ import annotations

from steptwin.errors import SteptwinError


class NoPygls(SteptwinError):
    """The library that speaks the protocol is missing."""


def serve_stdio() -> None:
    """Serve an editor on standard input and output until it disconnects. Raises `NoPygls` with the command that installs it."""
    try:
        import pygls  # noqa: F401
    except ImportError as error:
        installs = "in a clone 'make extras' installs it, elsewhere 'pip install pygls'"
        raise NoPygls(f"the editor server needs pygls 2: {installs}") from error
    from steptwin.lsp.server import serve_stdio as serve

    serve()
