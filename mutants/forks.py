"""A plugin of pytest that collects the tests once and tries each mutation in a fork of that process.

A fork exchanges the code of the functions that are already there, so this is for mutations inside of functions. Requests and
answers are lines of two pipes, see `Ask`.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from types import CodeType, FunctionType
from typing import TypedDict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mutants.trial import ANSWERS, FAILED, PASSED, REQUESTS, UNFIT

POLL_S = 0.005


class Ask(TypedDict):
    """The answer is PASSED, FAILED or UNFIT: the mutation needs a process of its own."""

    path: str
    before: str
    after: str
    """The source without and with the mutation."""
    limits: dict[str, float]
    """Node ids in order, each with the seconds the test may take."""
    limit_s: float
    """For all of them."""


class Unfit(Exception):
    """A function cannot be given the code of the mutation."""


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool:
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    _prepare_hypothesis()
    items = {item.nodeid: item for item in session.items}
    functions = _functions()
    gc.freeze()
    with os.fdopen(int(os.environ[REQUESTS])) as requests, os.fdopen(int(os.environ[ANSWERS]), "w") as answers:
        print(PASSED, file=answers, flush=True)
        for line in requests:
            print(_answer(items, functions, json.loads(line)), file=answers, flush=True)
    return True


@given(st.integers())
def _prepare_hypothesis(_: int) -> None:
    """Hypothesis reads all sources before its first example; no need to do that in each fork."""


def _functions() -> dict[str, list[FunctionType]]:
    """By source file."""
    found: dict[str, list[FunctionType]] = defaultdict(list)
    for function in gc.get_objects():
        if isinstance(function, FunctionType):
            found[function.__code__.co_filename].append(function)
    return found


def _answer(items: dict[str, pytest.Item], functions: dict[str, list[FunctionType]], ask: Ask) -> int:
    process = os.fork()
    if process == 0:
        answer = FAILED
        try:
            answer = _fork(items, functions, ask)
        finally:
            os._exit(answer)
    end = time.monotonic() + ask["limit_s"]
    try:
        while time.monotonic() < end:
            ended, status = os.waitpid(process, os.WNOHANG)
            if ended:
                code = os.waitstatus_to_exitcode(status)
                return code if code in (PASSED, UNFIT) else FAILED
            time.sleep(POLL_S)
        return FAILED
    finally:
        _end(process)


def _end(group: int) -> None:
    """The fork and what its tests have started."""
    try:
        os.killpg(group, signal.SIGKILL)
        os.waitpid(group, 0)
    except (ProcessLookupError, ChildProcessError):
        pass


def _fork(items: dict[str, pytest.Item], functions: dict[str, list[FunctionType]], ask: Ask) -> int:
    os.setsid()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        exchange(functions[ask["path"]], ask["path"], ask["before"], ask["after"])
    except Unfit:
        return UNFIT
    return PASSED if _pass([items[test] for test in ask["limits"]], ask["limits"]) else FAILED


def _pass(chosen: list[pytest.Item], limits: dict[str, float]) -> bool:
    for item, following in zip(chosen, [*chosen[1:], None], strict=True):
        item.add_marker(pytest.mark.timeout(limits[item.nodeid]), append=False)
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        if item.session.testsfailed:
            return False
    return True


def exchange(functions: list[FunctionType], path: str, before: str, after: str) -> None:
    """Give the functions of a module the code that they have in its changed source."""
    old, new = (dict(_codes(compile(source, path, "exec", dont_inherit=True))) for source in (before, after))
    places = {code: place for place, code in old.items()}
    exchanged = False
    for function in functions:
        code = function.__code__
        place = places.get(code)
        if place is None or place not in new or new[place].co_freevars != code.co_freevars:
            raise Unfit(function.__qualname__)
        exchanged = exchanged or new[place] != code
        function.__code__ = new[place]
    if not exchanged:
        raise Unfit(path)


def _codes(code: CodeType, above: tuple[tuple[str, int], ...] = ()) -> Iterator[tuple[tuple[tuple[str, int], ...], CodeType]]:
    """Every code below, with its place: the names of those around it, each with its number among those of the same name."""
    numbers: dict[str, int] = defaultdict(int)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            place = (*above, (constant.co_name, numbers[constant.co_name]))
            numbers[constant.co_name] += 1
            yield place, constant
            yield from _codes(constant, place)
