"""The first Ctrl-C is remembered, the second is as ever."""

from __future__ import annotations

import signal
import threading

import pytest

from steptwin.live.interrupts import FirstInterrupt


def test_the_first_interrupt_is_remembered_and_the_second_ends() -> None:
    usual = signal.getsignal(signal.SIGINT)
    with FirstInterrupt() as interrupt:
        assert not interrupt.came
        signal.raise_signal(signal.SIGINT)
        assert interrupt.came
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is usual


def test_without_any_all_is_as_before() -> None:
    usual = signal.getsignal(signal.SIGINT)
    with FirstInterrupt():
        assert signal.getsignal(signal.SIGINT) is not usual
    assert signal.getsignal(signal.SIGINT) is usual


def test_other_threads_have_no_interrupts() -> None:
    seen = []

    def work() -> None:
        with FirstInterrupt() as interrupt:
            seen.append(interrupt.came)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [False]
