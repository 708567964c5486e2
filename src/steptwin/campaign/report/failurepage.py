"""The page of a failure: its script in words, the machine where it failed, why, and the timeline."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from html import escape

from steptwin.campaign.case import EXPECTATIONS, WAITS, CaseResult
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.properties.ready import written_out
from steptwin.campaign.properties.text import parse_property
from steptwin.campaign.properties.tree import Atom, nodes
from steptwin.campaign.report.html import page
from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.scene.picture import View, picture
from steptwin.files.world import World

MOST_ANSWERS = 8
_NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+")
"""A signal in the text of what a script expected."""
_STYLE = """
pre { overflow-x: auto; }
iframe { width: 100%; height: 34rem; border: 1px solid var(--line); }
figure svg { max-width: 100%; height: auto; }
"""


def failure_page(
    world: World, description: CampaignDescription, result: CaseResult, *, title: str, what: str, script: list[str], timeline: str
) -> str:
    """``world`` stands at the end of the case; ``what``: the mistake; ``timeline``: the file, relative to that of the page."""
    lines = "".join(f"<li>{escape(one)}</li>\n" for one in script)
    body = f'<p class="bad">{escape(what)}</p>\n<h2>What is done</h2>\n<ul>\n{lines}</ul>\n'
    with suppress(Misuse):  # nothing has a place in space, or the library is not there
        body += f"<h2>The machine at {world.now / SECOND:.9g} s</h2>\n<figure>{picture(world, View.ISO)}</figure>\n"
    answers = list(_answers(world, description, result))
    if answers:
        body += f"<h2>Why</h2>\n<pre>{escape(chr(10).join(answers))}</pre>\n"
    body += f'<h2>Timeline</h2>\n<iframe src="{escape(timeline, quote=True)}" title="Timeline"></iframe>\n'
    return page(title, body, _STYLE)


def _answers(world: World, description: CampaignDescription, result: CaseResult) -> Iterator[str]:
    """Why the signals of what failed first have their values, and what programs wait for: answers with a cause."""
    names = [*_signals(world, description, result), *(name for name, programs in world.programs.items() if programs.texts)]
    past = world.past
    shown = 0
    for name in names:
        try:
            answer = past.ask(name)
        except Misuse:
            continue
        if answer.links and shown < MOST_ANSWERS:
            shown += 1
            yield answer.text() + "\n"


def _signals(world: World, description: CampaignDescription, result: CaseResult) -> list[str]:
    failed = {one.name for one in result.verdicts if not one.holds}
    texts = [one.text for one in description.properties if one.name in failed]
    atoms = [node for text in texts for node in nodes(parse_property(written_out(text, world))) if isinstance(node, Atom)]
    sides = [side for atom in atoms for side in (atom.comparison.left, atom.comparison.right)]
    names = [name for side in sides for name in side.names()]
    for verdict in result.verdicts:
        if not verdict.holds and verdict.name in (EXPECTATIONS, WAITS):
            names += _NAME.findall(verdict.why)
    return list(dict.fromkeys(names))
