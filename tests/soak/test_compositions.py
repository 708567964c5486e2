"""Many worlds composed by chance: as `tests/simulation/test_random_compositions.py`."""

from __future__ import annotations

from compositions import as_it_is, composed, copies, generally, looked_on
from soak import scaled


def test_compositions_are_the_same_in_every_way() -> None:
    for seed in range(scaled(400)):
        composition = composed(seed)
        expected = as_it_is(composition)
        found = [generally(composition), looked_on(composition), *copies(composition)]
        assert found == [expected] * len(found), f"seed {seed}"
