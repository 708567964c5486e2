"""The editor server: `steptwin lsp` speaks the Language Server Protocol.

`steptwin.lsp.editorsession` is what a client sees, without input and output: open texts and questions about them, in characters
of the text. `steptwin.lsp.handlers` puts the protocol around it: a function for each message. Each language is an `Analysis` of a
text. Only `protocol`, `editorserver`, `handlers`, `server`, `stdio`, `messages` and `convert` know the types of the protocol.
"""

from __future__ import annotations

from steptwin.extras import missing


def serve_stdio() -> int:
    """Serve an editor on standard input and output until it goes; returns the exit code. Raises `Misuse` without pygls."""
    try:
        import pygls  # noqa: F401
    except ImportError as error:
        raise missing("the editor server", "lsp") from error
    from steptwin.lsp.stdio import serve_stdio as serve

    return serve()
