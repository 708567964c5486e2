"""The directive ``control-commands``: a table of the requests of the control endpoint, from the table of commands itself."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import ExtensionMetadata

from steptwin.fields import Field
from steptwin.subject.commands import COMMANDS


class ControlCommands(SphinxDirective):
    def run(self) -> list[nodes.Node]:
        self.env.note_reread()  # the code may have changed where the page has not
        lines = ["| request | fields | effect | answer |", "|---|---|---|---|"]
        for row in COMMANDS.values():
            fields = "<br>".join(_field(field) for field in row.fields)
            lines.append(f"| `{row.name}` | {fields} | {_escaped(row.meaning)} | {_escaped(row.answer)} |")
        return self.parse_text_to_nodes("\n".join(lines))


def _field(field: Field) -> str:
    optional = "" if field.is_required else " (optional)"
    unit = f" [{field.unit}]" if field.unit else ""
    return f"`{field.name}`{optional}: {_escaped(field.meaning)}{unit}"


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


def setup(app: Sphinx) -> ExtensionMetadata:
    app.add_directive("control-commands", ControlCommands)
    return {"parallel_read_safe": True}
