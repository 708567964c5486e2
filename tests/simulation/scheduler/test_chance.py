"""Chance: the stream is that of SplitMix64, the same everywhere."""

from __future__ import annotations

from hashlib import blake2b

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.simulation.scheduler.chance import Chance


def split_mix(state: int) -> int:
    """The published algorithm, with its state before the step."""
    z = (state + 0x9E3779B97F4A7C15) % 2**64
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) % 2**64
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) % 2**64
    return z ^ (z >> 31)


@given(seed=st.integers(0, 2**63), name=st.text("abcxyz-0123456789", max_size=8), count=st.integers(1, 20))
def test_a_stream_is_that_of_the_published_generator(seed: int, name: str, count: int) -> None:
    begin = int.from_bytes(blake2b(f"{seed}/{name}".encode(), digest_size=8).digest(), "big")
    expected = [split_mix((begin + n * 0x9E3779B97F4A7C15) % 2**64) for n in range(count)]
    chance = Chance(seed, name)
    assert [chance.draw() for _ in range(count)] == expected
    again = Chance(seed, name)
    assert [again.below(1000) for _ in range(count)] == [value * 1000 // 2**64 for value in expected]
    again = Chance(seed, name)
    assert again.some_bytes(count) == bytes(value * 256 // 2**64 for value in expected)
    again = Chance(seed, name)
    assert [again.happens(0.3) for _ in range(count)] == [value / 2**64 < 0.3 for value in expected]


def test_a_published_vector() -> None:
    """SplitMix64 from state 0 (Vigna, splitmix64.c)."""
    chance = Chance(0, "")
    chance.set_state((0,))
    assert chance.draw() == 0xE220A8397B1DCDAF


@pytest.mark.parametrize(("probability", "happens"), [(0.0, False), (1.0, True)])
def test_what_is_certain(probability: float, happens: bool) -> None:
    chance = Chance(1, "a")
    assert {chance.happens(probability) for _ in range(200)} == {happens}


def test_a_probability_is_the_share_of_53_bits() -> None:
    drawn = Chance(7, "x").draw() >> 11
    assert not Chance(7, "x").happens(drawn / 2**53)
    assert Chance(7, "x").happens((drawn + 1) / 2**53)
