"""Links "Open in the studio" below what is a whole world, in the documentation beside the studio in a page: descriptions,
programs, and examples that a command names. A program gets a controller around it that starts it when it is switched on.

`make site` builds with ``studio_links``; elsewhere there is no ``try/`` that the links could lead to.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from docutils import nodes
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

from steptwin import Misuse, World
from steptwin.inpage.linked import SUFFIXES
from steptwin.simulation.describe.servicetables import SERVICES

ROOT = Path(__file__).parents[2]
RAW = -15
"""Of zlib: deflate without a header, as browsers unpack it."""
AROUND = {
    "wbc": ("program.prg", '[[mic488]]\nname = "table"\nprogram = "program.prg"\n'),
    "m1486": ("program.m1486", '[[m1486]]\nname = "drum"\nprogram = "program.m1486"\n'),
}
"""Languages of programs: the file, and the world with it."""
EXAMPLE = re.compile(r"examples/\S+\.(?:toml|m1486)")


def link(description: str, programs: Mapping[str, str]) -> str:
    """The fragment of a link, as studio-web/src/site/links.ts unpacks it."""
    change = zlib.compressobj(9, zlib.DEFLATED, RAW)
    given = json.dumps({"description": description, "programs": dict(programs)}, ensure_ascii=False)
    packed = change.compress(given.encode()) + change.flush()
    return "#world=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")


def is_whole(description: str, programs: Mapping[str, str]) -> bool:
    """Whether a text describes a world without further files and services, with a controller."""
    try:
        world = World.from_toml(description, {name: text.encode() for name, text in programs.items()})
    except Misuse:
        return False
    return bool(world.controllers) and not set(SERVICES) & set(world.spec.text.data)


def worlds(language: str, text: str) -> Iterator[tuple[str, str, Mapping[str, str]]]:
    """Of a block: the words of a link, the description, and the programs that it names."""
    if language in ("sh", "console"):
        for path in dict.fromkeys(ROOT / found for found in EXAMPLE.findall(text)):
            content = path.read_text("utf-8")
            beside = {one.name: one for one in path.parent.iterdir() if one.suffix in SUFFIXES and f'"{one.name}"' in content}
            programs = {name: one.read_text("utf-8") for name, one in beside.items()}
            yield f"Open {path.name} in the studio", *around(path.suffix[1:], content, programs)
    elif language in (*AROUND, "toml"):
        yield "Open in the studio", *around(language, text, {})


def around(language: str, text: str, programs: Mapping[str, str]) -> tuple[str, Mapping[str, str]]:
    """A description with its programs: ``text`` itself, or the world around that."""
    if language == "toml":
        return text, programs
    name, description = AROUND[language]
    return description, {name: text}


def add_links(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    if not app.config.studio_links:
        return
    for block in list(doctree.findall(nodes.literal_block)):
        place = block.parent.index(block)
        for words, description, programs in worlds(block.get("language", ""), block.astext()):
            if is_whole(description, programs):
                place += 1
                address = "../" * docname.count("/") + "try/" + link(description, programs)
                to = nodes.reference("", words, refuri=address, internal=False)
                block.parent.insert(place, nodes.paragraph("", "", to))


def setup(app: Sphinx) -> ExtensionMetadata:
    app.add_config_value("studio_links", default=False, rebuild="html", types=[bool])
    for language in AROUND:
        app.add_lexer(language, TextLexer)
    app.connect("doctree-resolved", add_links)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
