"""The directive ``steptwin``: a page shows what the program itself prints, so that it cannot disagree with it.

A page writes the arguments of one command::

    ```{steptwin} registers mic488 --firmware 1.70 --format md
    ```

The output is parsed as Markdown where the command was asked for ``--format md``, and shown as it is otherwise.
A command that fails fails the build.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import ExtensionMetadata

COLUMNS = 100


class CommandOutput(SphinxDirective):
    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()  # the code may have changed where the page has not
        command = shlex.split(self.arguments[0])
        printed = subprocess.run(
            [Path(sys.executable).with_name("steptwin"), *command],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "COLUMNS": str(COLUMNS), "NO_COLOR": "1", "TERM": "dumb"},
        )
        if printed.returncode != 0:
            raise self.error(f"steptwin {self.arguments[0]} ended with {printed.returncode}: {printed.stderr.strip()}")
        if "--format md" in self.arguments[0]:
            return self.parse_text_to_nodes(printed.stdout, allow_section_headings=True)
        shown = "\n".join([f"$ steptwin {self.arguments[0]}", *(line.rstrip() for line in printed.stdout.splitlines())])
        return [nodes.literal_block(shown, shown, language="console")]


def setup(app: Sphinx) -> ExtensionMetadata:
    app.add_directive("steptwin", CommandOutput)
    return {"parallel_read_safe": True}
