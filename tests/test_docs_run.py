"""Every command and snippet of README and documentation does what it is there for, in the order of its page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pages import PAGES, ROOT, RUN, Reader, blocks, only

from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.world.check import diagnose
from steptwin.wbc.check import check

WITH_CODE = [page for page in PAGES if any(block.is_done for block in blocks(page))]

NOT_RUN = {
    "README.md": [
        "it goes on until Ctrl-C",
        "it is the demo that the other blocks are run with",
        "runs this test",
    ],
    "docs/architecture.md": ["an excerpt"],
    "docs/bluesky.md": ["needs a twin whose program copies the input; tests/bluesky/test_runengine.py does it"],
    "docs/campaigns/fault-matrix.md": ["takes minutes; tests/campaign/test_faultmatrix.py does it"],
    "docs/campaigns/results.md": [
        "names of files are those of failures; tests/campaign/test_findings.py does it",
        "needs two campaigns; tests/campaign/report/test_report.py does it",
    ],
    "docs/control.md": ["needs a running twin that listens on TCP"],
    "docs/devices.md": ["seeks a line that nothing switches"],
    "docs/devices/sniff.md": ["needs a device, and goes on until Ctrl-C"],
    "docs/devices/verify.md": ["needs a device"],
    "docs/drivers/subject.md": ["needs a device"],
    "docs/gateways/epics.md": ["needs a client of EPICS; tests/gateways/epics does it"] * 2,
    "docs/gateways/modbus-security.md": ["needs a running twin; tests/live/test_tls.py does it"],
    "docs/gateways/mqtt.md": ["needs a broker; tests/gateways/mqtt does it"],
    "docs/serve.md": ["needs mbpoll; tests/peers/test_mbpoll_of_the_docs.py does it"],
    "docs/index.md": ["it goes on until Ctrl-C"],
    "docs/install.md": ["needs a package index", "needs a package index", "a clone is what these pages are run in"],
    "docs/space/palletizer.md": ["it goes on until Ctrl-C"],
    "docs/studio.md": ["it goes on until Ctrl-C"],
    "docs/studio/devices.md": ["needs devices"],
    "docs/studio/rest.md": ["needs a running studio; tests/studio/test_examples.py does it"] * 2,
    "docs/studio/site.md": ["it builds for half a minute"],
    "docs/studio/time.md": ["it goes on until Ctrl-C"],
    "docs/testing.md": ["needs devices"],
    "docs/tutorials/device.md": ["needs a device"],
    "docs/tutorials/machine.md": [
        "it goes on until Ctrl-C",
        "it fails, as it should; tests/test_tutorials.py does it",
        "needs the recording of the run before; tests/test_tutorials.py does it",
        "it fails, as it should; tests/test_tutorials.py does it",
    ],
    "docs/tutorials/panel.md": ["needs mbpoll; tests/peers/test_mbpoll_of_the_docs.py does it"] * 4,
    "docs/tutorials/panel.pl.md": ["needs mbpoll; tests/peers/test_mbpoll_of_the_docs.py does it"] * 4,
    "docs/why.md": ["it goes on until Ctrl-C"],
}
"""Blocks that are not run here, with the reason that stands before them in the source."""


@pytest.mark.parametrize("page", WITH_CODE)
def test_the_blocks_of_a_page_run(page: str, tmp_path: Path) -> None:
    wanted = [block for block in blocks(page) if block.is_done]
    assert wanted or page in NOT_RUN
    with Reader(tmp_path) as reader:
        reader.read(wanted)


def test_what_is_not_run_is_known() -> None:
    found = {page: [block.reason for block in blocks(page) if block.reason is not None] for page in PAGES}
    assert {page: reasons for page, reasons in found.items() if reasons} == NOT_RUN


def test_commands_are_in_blocks_that_are_run() -> None:
    """A block in another language would not be run, and nobody would notice."""
    known = {*RUN, "text", "csharp", "javascript", "wbc", "m1486"}  # tests/studio/test_examples.py and tests/inpage run these
    odd = [f"{b.page}:{b.line}: {b.language!r}" for page in PAGES for b in blocks(page) if b.language not in known]
    assert [place for place in odd if "'{" not in place] == []
    texts = [block for page in PAGES for block in blocks(page) if block.language == "text"]
    hidden = [b for b in texts if any(line.lstrip("$ ").startswith("steptwin ") for line in b.code.splitlines())]
    assert [f"{block.page}:{block.line}" for block in hidden] == []


def test_programs_on_pages_have_no_findings() -> None:
    programs = [block for page in PAGES for block in blocks(page) if block.language == "wbc"]
    assert len(programs) > 1
    assert [(block.page, found.message) for block in programs for found in check(block.code).diagnostics] == []


def test_worlds_on_pages_have_no_findings() -> None:
    """Those that are whole and name no files."""
    toml = [block for page in PAGES for block in blocks(page) if block.language == "toml" and block.reason is None]
    worlds = [block for block in toml if "[[mic488]]" in block.code and not re.search(r"^program = ", block.code, re.MULTILINE)]
    assert len(worlds) > 10
    assert [(one.page, found.message) for one in worlds for found in diagnose(one.page, one.code, no_files).findings] == []


def test_pages_name_the_command_that_prints_what_only_the_built_page_has() -> None:
    generated = [block for page in PAGES for block in blocks(page) if block.language.startswith("{steptwin}")]
    assert len(generated) > 3
    for block in generated:
        command = re.sub(r" --(format|firmware) \S+", "", block.language.replace("{steptwin}", "steptwin"))
        assert f"`{command}`" in (ROOT / block.page).read_text(), block.page


def test_the_excerpt_of_a_run_is_what_it_prints(tmp_path: Path) -> None:
    page = blocks("docs/wbc.md")
    typed = [line for block in page if block.language == "sh" for line in block.commands() if "run feeder.prg" in line]
    command = only(typed, "the command 'run feeder.prg' of docs/wbc.md")
    excerpt = only([block.code for block in page if block.language == "text"], "blocks with output in docs/wbc.md")
    with Reader(tmp_path) as reader:
        reader.command("cd examples/mic488")
        assert excerpt in reader.command(command)
