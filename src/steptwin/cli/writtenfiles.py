"""Options that name a file to write (`written`)."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import typer


def written(*names: str, **more: Any) -> Any:
    """An option as of `typer.Option`. Where its file is the standard output (``/dev/stdout``), nothing else of the command goes
    there: what it prints goes to the standard error."""
    return typer.Option(*names, callback=keep_apart, **more)


def keep_apart(ctx: typer.Context, value: Any) -> Any:
    """The callback of these options."""
    from steptwin.files.writing import is_standard_output

    files: Iterable[Any] = value if isinstance(value, list) else () if value is None else (value,)
    if any(is_standard_output(Path(file)) for file in files):
        ctx.with_resource(redirect_stdout(sys.stderr))
    return value
