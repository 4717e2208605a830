"""Order statistics are those of a sorted list, whatever the values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.ranks import at_ranks

RNG = np.random.default_rng(3)
LISTS = {
    "spread over all magnitudes": RNG.choice([-1.0, 1.0], 50_000) * 10.0 ** RNG.uniform(-300, 300, 50_000),
    "within one binade": RNG.uniform(1.0, 1.01, 50_000),
    "all equal": np.ones(50_000),
    "few different ones": RNG.integers(-3, 4, 50_000).astype(float),
    "infinities and zeros of both signs": np.concatenate([RNG.normal(size=20_000), [np.inf, -np.inf, 0.0, -0.0] * 9]),
    "denormal": RNG.uniform(0, 1e-310, 20_000),
}


@pytest.mark.parametrize("what", LISTS)
def test_the_value_at_a_rank_is_that_of_the_sorted_list(what):
    values = LISTS[what]
    ordered, n = np.sort(values), len(values)
    ranks = [0, 1, n // 2, n // 2 + 1, n * 95 // 100, n * 99 // 100, n - 2, n - 1]
    before = values.copy()
    assert at_ranks(values, ranks) == {rank: ordered[rank] for rank in ranks}
    assert values.tobytes() == before.tobytes()


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=40), st.data())
def test_short_lists_too(values, data):
    rank = data.draw(st.integers(0, len(values) - 1))
    assert at_ranks(np.array(values), (rank,))[rank] == sorted(values)[rank]
