"""The limit of open files, which is the limit of clients."""

from __future__ import annotations

import resource

import pytest

from steptwin.live import filelimit
from steptwin.live.filelimit import allow_many_files


def test_as_many_clients_as_the_system_permits(monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[tuple[int, int]] = [(1024, 4096)]
    monkeypatch.setattr(resource, "getrlimit", lambda which: limits[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda which, wanted: limits.append(wanted))
    assert (allow_many_files(), limits[1:]) == (4096, [(4096, 4096)])
    assert (allow_many_files(), len(limits)) == (4096, 2)
    limits.append((1024, resource.RLIM_INFINITY))
    assert (allow_many_files(), limits[-1]) == (65536, (65536, resource.RLIM_INFINITY))
    limits.append((resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    assert allow_many_files() == 65536


def test_a_system_that_grants_less_than_it_names(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(which: int, wanted: tuple[int, int]) -> None:
        raise ValueError("current limit exceeds maximum limit")

    monkeypatch.setattr(resource, "getrlimit", lambda which: (256, resource.RLIM_INFINITY))
    monkeypatch.setattr(resource, "setrlimit", refuse)
    assert allow_many_files() == 256


def test_a_system_without_such_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filelimit, "resource", None)
    assert allow_many_files() == 65536
