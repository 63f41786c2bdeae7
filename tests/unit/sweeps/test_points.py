"""Points of sweeps: order, ends, distributions, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.errors import UsageError
from nsspice.sweeps import LogUniform, Normal, Tolerance, Uniform, corners, grid, paired, samples


def test_the_last_name_of_a_grid_runs_fastest() -> None:
    points = grid({"a": [1, 2], "b": [10, 20, 30]})
    assert points.values.tolist() == [[1, 10], [1, 20], [1, 30], [2, 10], [2, 20], [2, 30]]
    assert points.axes is not None
    assert [axis.tolist() for axis in points.axes] == [[1, 2], [10, 20, 30]]


def test_names_are_lower_case() -> None:
    assert grid({"Vin": 3.0}).names == ("vin",)


@pytest.mark.parametrize("how", ["latin", "sobol"])
def test_samples_fill_the_range_evenly(how) -> None:
    points = samples({"a": Uniform(-1.0, 1.0), "b": LogUniform(1.0, 1e4)}, 64, how=how, seed=5)
    for column in (points.values[:, 0], np.log10(points.values[:, 1]) / 2.0 - 1.0):
        # one in each of 64 slices: what both kinds promise in every dimension
        assert sorted(np.floor((column + 1.0) * 32.0).astype(int)) == list(range(64))


def test_a_normal_distribution_has_its_moments() -> None:
    column = samples({"a": Normal(5.0, 0.1)}, 4096, how="sobol").values[:, 0]
    assert column.mean() == pytest.approx(5.0, abs=1e-4)
    # the quantile transformation of 4096 even points misses the tails beyond 3.5 deviations
    assert column.std() == pytest.approx(0.1, rel=5e-3)


def test_the_seed_decides() -> None:
    laws = {"a": Uniform(0.0, 1.0)}
    first, again, other = (samples(laws, 8, seed=s).values.tolist() for s in (1, 1, 2))
    assert first == again != other


def test_corners_of_many_names_move_one_at_a_time() -> None:
    laws = {f"p{k}": Tolerance(0.1) for k in range(9)}
    points = corners(laws, lambda name: 1.0)
    assert len(points) == 18
    assert all(np.count_nonzero(row != 1.0) == 1 for row in points.values)


@pytest.mark.parametrize(
    "make",
    [
        lambda: grid({}),
        lambda: grid({"a": []}),
        lambda: grid({"a": [1, float("nan")]}),
        lambda: grid({"a": "12"}),
        lambda: grid({"a": [1], "A": [2]}),
        lambda: grid({f"a{k}": range(100) for k in range(4)}),
        lambda: paired({"a": [1, 2], "b": [1]}),
        lambda: samples({"a": Uniform(0, 1)}, 0),
        lambda: samples({"a": LogUniform(0, 1)}, 3),
        lambda: samples({"a": Tolerance(0.1)}, 3),
        lambda: samples({"a": [1, 2]}, 3),
        lambda: samples({"a": Uniform(0, 1)}, 3, how="dice"),
    ],
)
def test_refused(make) -> None:
    with pytest.raises(UsageError):
        make()
