"""A link "Open in the studio" below each description that is a whole world, in the documentation beside the studio in a page.

`make site` builds with ``studio_links``; elsewhere there is no ``try/`` that the links could lead to.
"""

from __future__ import annotations

import base64
import json
import zlib

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

from steptwin import Misuse, World
from steptwin.simulation.describe.servicetables import SERVICES

RAW = -15
"""Of zlib: deflate without a header, as browsers unpack it."""


def link(description: str) -> str:
    """The fragment of a link, as studio-web/src/site/links.ts unpacks it."""
    change = zlib.compressobj(9, zlib.DEFLATED, RAW)
    given = json.dumps({"description": description, "programs": {}}, ensure_ascii=False)
    packed = change.compress(given.encode()) + change.flush()
    return "#world=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")


def is_whole(description: str) -> bool:
    """Whether a text describes a world without further files and services, with a controller."""
    try:
        world = World.from_toml(description)
    except Misuse:
        return False
    return bool(world.controllers) and not set(SERVICES) & set(world.spec.text.data)


def add_links(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    if not app.config.studio_links:
        return
    for block in list(doctree.findall(nodes.literal_block)):
        if block.get("language") == "toml" and is_whole(block.astext()):
            address = "../" * docname.count("/") + "try/" + link(block.astext())
            to = nodes.reference("", "Open in the studio", refuri=address, internal=False)
            block.parent.insert(block.parent.index(block) + 1, nodes.paragraph("", "", to))


def setup(app: Sphinx) -> ExtensionMetadata:
    app.add_config_value("studio_links", default=False, rebuild="html", types=[bool])
    app.connect("doctree-resolved", add_links)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
