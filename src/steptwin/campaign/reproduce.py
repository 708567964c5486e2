"""A case as files with which it can be seen again: a recording that ``steptwin replay`` runs, a timeline, and a test for
pytest that fails until the program is mended."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from pprint import pformat
from textwrap import fill
from typing import Any

from steptwin.campaign.case import Case, CaseResult, VariedValue
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.reading import load_campaign
from steptwin.campaign.report.failurepage import failure_page
from steptwin.campaign.runner import CaseRunner, read_step
from steptwin.controller import SECOND
from steptwin.durations import duration_text
from steptwin.errors import Misuse, SteptwinError
from steptwin.files import recording as recordings
from steptwin.files.export import axis_views, write_trace
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.textfiles import write_bytes
from steptwin.simulation.script.steps import Press
from steptwin.why.sentences import describe_input

WIDTH = 120
LONGEST_NAME = 60


@dataclass(frozen=True, slots=True)
class Reproduction:
    """The files of a case. Without a recording the world refused the case; without a test the campaign has no file."""

    page: Path | None
    session: Path | None
    timeline: Path | None
    test: Path | None

    def to_json(self, folder: Path) -> dict[str, str]:
        """Their paths, relative to a folder."""
        found = {"page": self.page, "session": self.session, "timeline": self.timeline, "test": self.test}
        return {name: os.path.relpath(path, folder) for name, path in found.items() if path is not None}


def reproduce(
    runner: CaseRunner, case: Case, result: CaseResult, folder: Path, name: str, campaign: Path | None = None
) -> Reproduction:
    """Write ``NAME.html`` (page), ``NAME.json`` (recording), ``NAME.timeline.html`` and ``test_NAME.py`` into a folder. Raises
    `Misuse` where that is impossible."""
    folder.mkdir(parents=True, exist_ok=True)
    page = recording = timeline = test = None
    try:
        world = runner.begin(case, keep=True)
    except Misuse:
        world = None
    if world is not None:
        recorder = SceneRecorder()
        recorder.follow(world)
        try:
            world.run_to(case.end_ns, runner.description.until)
        except SteptwinError:
            pass  # it is the failure: the recording ends there
        else:
            page, recording, timeline = (folder / f"{name}.{suffix}" for suffix in ("html", "json", "timeline.html"))
            recordings.save(recordings.recording_of(world), recording)
            views, scene = axis_views(world), recorder.recorded()
            write_trace(world.trace, timeline, views=views, scene=scene, title=name, ended=world.now)
            text = failure_page(
                world,
                runner.description,
                result,
                title=name,
                what=summary(result),
                script=parts_of(case, runner.description),
                timeline=timeline.name,
            )
            write_bytes(page, text.encode())
    if campaign is not None:
        beside = os.path.relpath(campaign, folder)
        test = folder / f"test_{identifier(name)}.py"
        write_bytes(test, text_of_test(case, result, name, beside, where(case, runner.description)).encode())
    return Reproduction(page, recording, timeline, test)


def identifier(text: str) -> str:
    """A name for files and functions of Python."""
    return re.sub(r"\W+", "_", text).strip("_").lower()[:LONGEST_NAME] or "case"


def text_of_test(case: Case, result: CaseResult, name: str, campaign: str, at: str) -> str:
    """The text of a test that fails with this case. ``at``: what is particular to it, in words."""
    title = fill(f"{summary(result)}. At {at}.", WIDTH).replace("\\", "\\\\").replace('"""', "'''")
    return (
        f'"""{title}"""\n\nfrom pathlib import Path\n\nfrom steptwin.campaign.reproduce import check_case\n\n'
        f"CAMPAIGN = Path(__file__).parent / {Path(campaign).as_posix()!r}\n"
        f"CASE = {pformat(case.to_json(), width=WIDTH, sort_dicts=False)}\n"
        f"PROPERTIES = {pformat([one.name for one in result.verdicts if not one.holds], width=WIDTH)}\n\n\n"
        f"def test_{identifier(name)}() -> None:\n    check_case(CAMPAIGN, CASE, PROPERTIES)\n"
    )


def summary(result: CaseResult) -> str:
    """The mistake, in a line; empty if there is none."""
    if result.error is not None:
        return result.error.strip().partition("\n")[0]
    return "; ".join(f"{one.name}: {one.why}" if one.why else one.name for one in result.verdicts if not one.holds)


def where(case: Case, description: CampaignDescription) -> str:
    """Values, faults and steps that are particular to one case of a campaign, in a line."""
    return "; ".join(parts_of(case, description))


def parts_of(case: Case, description: CampaignDescription) -> list[str]:
    """The values of a case, those that it varies as times with units; then what is done, in the order of time, in words."""
    parts = [f"{name} = {_value_text(value, is_time=name in description.times)}" for name, value in case.values.items()]
    done = [(one.at_ns, f"fault {one.fault}") for one in case.faults]
    done += [(one.at_ns, _step_text(one.step)) for one in case.steps]
    parts += [f"{at / SECOND:.9g} s: {text}" for at, text in sorted(done, key=itemgetter(0))]
    return [*parts, f"end {case.end_ns / SECOND:.9g} s"]


def _step_text(text: str) -> str:
    """A step in words; as it is written where there are none for it."""
    step = read_step(text)
    words = describe_input(step)
    if words == type(step).__name__:
        return text
    return f"{words} for {duration_text(step.duration)}" if isinstance(step, Press) and step.duration is not None else str(words)


def _value_text(value: VariedValue, *, is_time: bool) -> str:
    return duration_text(round(float(value) * SECOND)) if is_time else str(value)


def check_case(campaign: Path | str, case: Mapping[str, Any], properties: Collection[str] | None = None) -> None:
    """Run a case of a campaign; raises `AssertionError` if a property fails or it does not run to its end.

    ``properties``: only these; others may need more time than a case has that was made as short as it fails.
    """
    result = CaseRunner(load_campaign(campaign)).run(Case.from_json(case))
    if properties is not None:
        result = replace(result, verdicts=tuple(one for one in result.verdicts if one.name in properties))
    if result.failed:
        raise AssertionError(summary(result))
