"""The report of a campaign as one HTML file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from steptwin.campaign.findings import FoundFailure
from steptwin.campaign.report.html import link, page, table
from steptwin.campaign.report.sobolindices import SobolIndex
from steptwin.campaign.report.statistics import Histogram, Influence
from steptwin.campaign.reproduce import summary
from steptwin.campaign.summary import CampaignSummary, percent

WIDTH, HEIGHT = 340, 130
_OF = {"robustness": "the least robustness", "passed": "whether a run passes"}
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot have, even escaped."""
_STYLE = "rect { fill: var(--note); } .bad { color: var(--bad); } .good { color: var(--good); }"


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignReport:
    summary: CampaignSummary
    found: Sequence[FoundFailure]
    influences: Sequence[Influence] | None
    """None without the libraries for them."""
    indices: Sequence[SobolIndex] = ()
    """Sobol indices of the design that gives them."""
    histograms: Sequence[Histogram]
    search: str

    def to_json(self, folder: Path) -> dict[str, Any]:
        """As JSON; paths are relative to ``folder``."""
        return {
            **self.summary.to_json(),
            "search": self.search,
            "causes": [one.to_json(folder) for one in self.found],
            "influences": [one._asdict() for one in self.influences or ()],
            "sobol_indices": [one._asdict() for one in self.indices],
            "measures": [one._asdict() for one in self.histograms],
        }

    def junit(self) -> bytes:
        """A test case for each property, with the causes of its failures."""
        by_property: dict[str, list[FoundFailure]] = {name: [] for name in self.summary.properties}
        for one in self.found:
            by_property.setdefault(one.failure.property, []).append(one)
        if not by_property:
            by_property["runs"] = []
        texts = {name: self._failures(name, found) for name, found in by_property.items()}
        failed = sum(map(bool, texts.values()))
        suite = ET.Element("testsuite", name=self.summary.name, tests=str(len(by_property)), failures=str(failed), errors="0")
        for name, why in texts.items():
            case = ET.SubElement(suite, "testcase", classname=self.summary.name, name=name)
            if why:
                ET.SubElement(case, "failure", message=why[0]).text = "\n".join(why)
        return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", ET.tostring(suite, encoding="unicode", xml_declaration=True)).encode()

    def _failures(self, name: str, found: Sequence[FoundFailure]) -> list[str]:
        """Why a property failed; a run has the cause of what failed first in it."""
        one = self.summary.properties.get(name)
        if one is not None and one.failed and not found:
            return [f"{one.failed} of {self.summary.runs} runs, in each of which another property failed before"]
        return [f"{len(cause.numbers)} of {self.summary.runs} runs: {cause_text(cause)}" for cause in found]

    def html(self, folder: Path) -> str:
        one = self.summary
        low, high = one.interval
        rate = "no runs" if one.pass_rate is None else f"{percent(one.pass_rate)} pass"
        chosen = "" if self.search == "random" else f"; no probability: cases were chosen by a search, {self.search}"
        body = (
            f'<p class="big {"bad" if one.failed else "good"}">{rate}</p>\n'
            f"<p>{one.runs} runs, {one.failed} failed. The share that passes is between {low:.2%} and {high:.2%} "
            f"(Wilson, 95 %{chosen}). Seed {one.seed}, digest <code>{one.digest}</code>.</p>\n"
            f"<h2>Properties</h2>\n{self._properties()}"
        )
        if self.found:
            body += f"<h2>Failures by cause</h2>\n{self._causes(folder)}"
        if self.indices:
            body += f"<h2>What matters most</h2>\n{self._indices()}"
        elif self.influences is None:
            body += "<h2>What matters most</h2>\n<p>This needs scipy, which is not here.</p>\n"
        elif self.influences:
            body += f"<h2>What matters most</h2>\n{self._influences(self.influences)}"
        if self.histograms:
            body += f"<h2>Measures</h2>\n{''.join(_figure(one) for one in self.histograms)}\n"
        return page(f"Campaign {one.name}", body, _STYLE)

    def _properties(self) -> str:
        rows = [
            (
                escape(name),
                str(one.failed),
                "" if abs(one.robustness) == float("inf") else f"{one.robustness:.4g}",
                "" if one.case is None else str(one.case),
            )
            for name, one in self.summary.properties.items()
        ]
        return (
            table(("property", "failed", "least robustness", "in case"), rows, (1, 2, 3)) if rows else "<p>There are none.</p>\n"
        )

    def _causes(self, folder: Path) -> str:
        rows: list[tuple[str, ...]] = []
        for one in self.found:
            files = {} if one.files is None else one.files.to_json(folder)
            links = ", ".join(link(Path(path).as_posix(), name) for name, path in files.items())
            what = escape(summary(one.result))
            rows.append((escape(one.failure.property), str(len(one.numbers)), what, escape(_simplest(one)), links))
        return table(("property", "runs", "what", "simplest case", ""), rows, (1,))

    def _influences(self, found: Sequence[Influence]) -> str:
        rows = [(escape(one.name), f"{one.correlation:+.3f}", f"{one.p_value:.2g}") for one in found]
        of = _OF[found[0].of]
        return f"<p>Spearman's rank correlation with {of}.</p>\n" + table(("value", "correlation", "p"), rows, (1, 2))

    def _indices(self) -> str:
        rows = [
            (
                escape(one.name),
                f"{one.total:.3f}",
                f"{one.total_low:.3f} to {one.total_high:.3f}",
                f"{one.first:.3f}",
                f"{one.first_low:.3f} to {one.first_high:.3f}",
            )
            for one in self.indices
        ]
        text = (
            f"<p>Sobol indices of {_OF[self.indices[0].of]}: the share of its variance that a value makes by itself (first), and "
            "with all it does together with others (total).</p>\n"
        )
        return text + table(("value", "total", "95 %", "first", "95 %"), rows, (1, 2, 3, 4))


def cause_text(one: FoundFailure) -> str:
    """A cause in a line."""
    return f"{summary(one.result)}. {_simplest(one)}"


def _simplest(one: FoundFailure) -> str:
    if one.shrunk is None or one.where is None:
        return f"case {one.numbers[0]}"
    if not one.shrunk.repeats:
        return f"case {one.numbers[0]} did not fail again"
    return one.where + ("" if one.shrunk.is_complete else " (the budget ended before it was the simplest)")


def _figure(one: Histogram) -> str:
    most, span = max(one.counts), (one.edges[-1] - one.edges[0]) or 1.0
    bars = ""
    for count, left, right in zip(one.counts, one.edges, one.edges[1:], strict=False):
        x, width = (left - one.edges[0]) / span * WIDTH, max((right - left) / span * WIDTH - 1, 1)
        height = count / most * (HEIGHT - 24)
        y = HEIGHT - 18 - height
        bars += f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"><title>{count}</title></rect>'
    unit = f" {escape(one.unit)}" if one.unit else ""
    caption = f"{escape(one.name)}: {one.count} runs, {one.least:.6g} to {one.most:.6g}{unit}, mean {one.mean:.6g}{unit}"
    return (
        f'<figure><svg width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="{escape(one.name, quote=True)}">{bars}'
        f'<text x="0" y="{HEIGHT - 4}">{one.edges[0]:.6g}</text>'
        f'<text x="{WIDTH}" y="{HEIGHT - 4}" text-anchor="end">{one.edges[-1]:.6g}</text></svg>'
        f"<figcaption>{caption}</figcaption></figure>"
    )
