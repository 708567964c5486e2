"""Commands of the shell in the process of the tests: the same `main`, without a new interpreter for each."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Mapping
from typing import NamedTuple
from unittest.mock import patch

from steptwin.cli import main


class Done(NamedTuple):
    returncode: int
    stdout: str
    stderr: str


def typed(*arguments: str, env: Mapping[str, str], script: str = "") -> Done:
    """What ``steptwin`` does with these arguments, with ``script`` in its standard input."""
    out, err = io.StringIO(), io.StringIO()
    with (
        patch.dict("os.environ", env, clear=True),
        patch.object(sys, "argv", ["steptwin", *arguments]),
        patch.object(sys, "stdin", io.StringIO(script)),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
            code: object = 0
        except SystemExit as ended:
            code = ended.code
    return Done(code if isinstance(code, int) else 0 if code is None else 1, out.getvalue(), err.getvalue())
