"""The control flow of a program as a picture (SVG), in the order of its text.

Blocks stand below each other as in a listing, so that the picture reads like the program. What does not go on at the next block
goes along a lane beside them: forwards on the right, backwards on the left, short ways inside of long ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import NamedTuple

from steptwin.diagnostics import visible
from steptwin.explain.model import Explanation, FlowBlock, FlowWay
from steptwin.explain.text import duration_text

_LINE, _CHARACTER, _PADDING, _GAP, _LANE, _MARGIN = 17, 7.3, 9, 30, 13, 16
"""Pixels: height of a line, width of a character, inside of blocks, between them, between lanes, around everything."""
_LONGEST = 60
"""Characters of a statement; of a longer one the beginning."""
_STYLE = (
    "text{font:12px ui-monospace,Menlo,Consolas,monospace;fill:#1b1f24}.name{font-weight:bold}.grey{fill:#68727d}"
    ".when{fill:#0b57a4}.title{font-weight:bold;font-size:13px}rect{fill:#fff;stroke:#8b95a1}.entry{stroke:#0b7a4b;stroke-width:2}"
    ".interrupt{stroke:#b3541e;stroke-width:2}path{fill:none;stroke:#46515d}.call{stroke-dasharray:5 3}.back{stroke:#0b57a4}"
)


def picture(programs: Sequence[Explanation]) -> str:
    """One column for each program: the chips of a chain."""
    columns: list[str] = []
    width, height = 0.0, 0.0
    for explained in programs:
        column = _Column(explained)
        columns.append(f'<g transform="translate({width:g} 0)">{"".join(column.drawn())}</g>')
        width, height = width + column.width, max(height, column.height)
    size = f'width="{width:g}" height="{height:g}" viewBox="0 0 {width:g} {height:g}"'
    arrow = (
        '<defs><marker id="arrow" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" style="fill:#46515d;stroke:none"/></marker></defs>'
    )
    background = f'<rect width="{width:g}" height="{height:g}" style="stroke:none"/>'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img"><style>{_STYLE}</style>{arrow}{background}'
    return head + "\n".join(columns) + "</svg>\n"


class _Box(NamedTuple):
    top: float
    height: float

    @property
    def bottom(self) -> float:
        return self.top + self.height


class _Rail(NamedTuple):
    """A way along a lane, from one height to another."""

    way: FlowWay
    begin: float
    end: float


class _Column:
    def __init__(self, explained: Explanation) -> None:
        self._explained = explained
        self._title = f"{explained.source.name}: {explained.title}"
        self._texts = [list(self._rows(block)) for block in explained.blocks]
        self._box_width = 2 * _PADDING + _CHARACTER * max((len(row) for rows in self._texts for row, _ in rows), default=10)
        self._boxes = self._placed()
        forward, backward = self._rails()
        self._forward, self._backward = _lanes(forward), _lanes(backward)
        self._left = _MARGIN + self._side_width(self._backward)
        right = self._side_width(self._forward)
        self.width = max(self._left + self._box_width + right + _MARGIN, _CHARACTER * 1.1 * len(self._title) + 2 * _MARGIN)
        self.height = self._boxes[-1].bottom + _MARGIN if self._boxes else 4 * _MARGIN

    def _rows(self, block: FlowBlock) -> Iterator[tuple[str, str]]:
        """Lines of text of a block, each with its class."""
        when = self._explained.interrupts_at if block.is_entry and block.first > 0 else ""
        if block.names:
            yield f"{', '.join(block.names)}:{when and f'  {when}'}", "name"
        times = {
            piece.last: f"{duration_text(piece.duration)}{' + wait' if piece.wait else ''}"
            for piece in block.pieces
            if piece.duration or piece.wait
        }
        statements = self._explained.statements[block.first : block.last + 1]
        for number, (line, text) in enumerate(statements, block.first):
            if text.rstrip(" :") in block.names:
                continue  # an interrupt label
            shown = text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
            yield visible(f"{line:>4}  {shown}"), ""
            if number in times:
                yield f"      {times[number]}", "grey"

    def _placed(self) -> list[_Box]:
        """Boxes of the blocks, and last that of the end if something leads there."""
        boxes: list[_Box] = []
        top = _MARGIN + 2.0 * _LINE
        for rows, block in zip(self._texts, self._explained.blocks, strict=True):
            most = max(_LINE * len(rows), 12 * (len(block.ways) + 1))
            boxes.append(_Box(top, most + _PADDING))
            top = boxes[-1].bottom + _GAP
        if any(way.target is None for block in self._explained.blocks for way in block.ways):
            boxes.append(_Box(top, _LINE + _PADDING))
        return boxes

    def _target(self, way: FlowWay) -> int:
        return len(self._explained.blocks) if way.target is None else way.target

    def _rails(self) -> tuple[list[_Rail], list[_Rail]]:
        forward: list[_Rail] = []
        backward: list[_Rail] = []
        for index, block in enumerate(self._explained.blocks):
            for way in block.ways:
                target = self._target(way)
                if target == index + 1 and not way.is_call:
                    continue
                side = forward if target > index else backward
                leaving = sum(rail.begin > self._boxes[index].top and rail.begin < self._boxes[index].bottom for rail in side)
                begin = self._boxes[index].bottom - 8 - 11 * leaving
                side.append(_Rail(way, begin, self._boxes[target].top + 8))
        return forward, backward

    @staticmethod
    def _side_width(lanes: Sequence[tuple[_Rail, int]]) -> float:
        if not lanes:
            return 2 * _PADDING
        return _label_width(lanes) + _LANE * (2 + max(lane for _, lane in lanes))

    # ------------------------------------------------------------------ drawing

    def drawn(self) -> Iterator[str]:
        yield _text(_MARGIN, _MARGIN + _LINE, self._title, "title")
        right = self._left + self._box_width
        yield from self._drawn_rails(self._forward, right, 1)
        yield from self._drawn_rails(self._backward, self._left, -1)
        for index, block in enumerate(self._explained.blocks):
            yield from self._drawn_block(index, block)
        if len(self._boxes) > len(self._explained.blocks):
            box = self._boxes[-1]
            yield f'<rect x="{self._left:g}" y="{box.top:g}" width="60" height="{box.height:g}" rx="12"/>'
            yield _text(self._left + 16, box.top + _LINE, "end", "name")

    def _drawn_block(self, index: int, block: FlowBlock) -> Iterator[str]:
        box, x = self._boxes[index], self._left
        kind = ' class="interrupt"' if block.is_entry and block.first else ' class="entry"' if block.is_entry else ""
        yield f'<rect{kind} x="{x:g}" y="{box.top:g}" width="{self._box_width:g}" height="{box.height:g}" rx="4"/>'
        for row, (text, style) in enumerate(self._texts[index]):
            yield _text(x + _PADDING, box.top + _LINE * (row + 1), text, style)
        for way in block.ways:
            if self._target(way) == index + 1 and not way.is_call:
                middle = x + 30
                style = ' class="call"' if way.is_back else ""
                end = self._boxes[index + 1].top
                yield f'<path{style} marker-end="url(#arrow)" d="M{middle:g} {box.bottom:g}V{end:g}"/>'
                yield _text(middle + 8, box.bottom + _LINE + 2, "comes back" if way.is_back else way.when, "when")

    def _drawn_rails(self, lanes: Sequence[tuple[_Rail, int]], edge: float, side: int) -> Iterator[str]:
        """Ways on one side: 1 right, -1 left."""
        label = _label_width(lanes)
        for (way, begin, end), lane in lanes:
            x = edge + side * (label + _LANE * (lane + 1))
            style = "call" if way.is_call else "back" if side < 0 else ""
            yield f'<path class="{style}" marker-end="url(#arrow)" d="M{edge:g} {begin:g}H{x:g}V{end:g}H{edge:g}"/>'
            if way.when:
                anchor = "" if side > 0 else ' text-anchor="end"'
                yield _text(edge + side * 5, begin - 3, way.when, "when", anchor)


def _label_width(lanes: Sequence[tuple[_Rail, int]]) -> float:
    return _CHARACTER * max((len(rail.way.when) for rail, _ in lanes), default=0) + 8


def _lanes(rails: Iterable[_Rail]) -> list[tuple[_Rail, int]]:
    """A lane for each, from the inside: short ones first, none over another of its lane."""
    taken: list[list[_Rail]] = []
    found: list[tuple[_Rail, int]] = []
    for rail in sorted(rails, key=lambda rail: abs(rail.end - rail.begin)):
        low, high = sorted((rail.begin, rail.end))
        spans = ([sorted((other.begin, other.end)) for other in lane] for lane in taken)
        lane = next((n for n, lane in enumerate(spans) if all(high < begin or end < low for begin, end in lane)), None)
        if lane is None:
            lane = len(taken)
            taken.append([])
        taken[lane].append(rail)
        found.append((rail, lane))
    return found


def _text(x: float, y: float, text: str, style: str, more: str = "") -> str:
    kind = f' class="{style}"' if style else ""
    return f'<text{kind}{more} x="{x:g}" y="{y:g}" xml:space="preserve">{escape(visible(text))}</text>'
