"""Noise, wind and ground effect against their formulas and statistics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.noise import draw_keys, normal_noise, uniform_noise
from artde_gym.disturbances.wind import GRID, Wind

pytestmark = pytest.mark.once

KEYS = draw_keys(np.random.default_rng(0), 3)
INDEX = np.arange(200_000, dtype=np.uint64)


def realised_wind(**parameters: Any) -> dict[str, Any]:
    disturbances = Disturbances.parse({"wind": parameters}, ("body",), (), "q450")
    return disturbances.sample(np.random.default_rng(0))["wind"]


def blow(places: np.ndarray, key: int = 0, **parameters: Any) -> np.ndarray:
    """Velocity of the air at a place for each grid point."""
    wind = Wind(realised_wind(**parameters), KEYS[key])
    return np.array([wind.next(tuple(place)) for place in places])


def correlation(values: np.ndarray, lag: int) -> float:
    return float(np.corrcoef(values[:-lag], values[lag:])[0, 1])


# --------------------------------------------------------------------------------------------------------------- noise


def test_uniform_noise_is_uniform_and_white() -> None:
    noise = uniform_noise(KEYS[:1], INDEX)
    assert noise.shape == (4, len(INDEX))
    for values in noise:
        assert stats.kstest(values, stats.uniform(-math.sqrt(3), 2 * math.sqrt(3)).cdf).pvalue > 0.001
        assert abs(values.mean()) < 4 / math.sqrt(len(INDEX))
        assert values.var() == pytest.approx(1.0, abs=0.01)
        assert all(abs(correlation(values, lag)) < 0.01 for lag in (1, 2, 7))
    assert np.abs(np.corrcoef(noise) - np.eye(4)).max() < 0.01


def test_normal_noise_is_normal_and_white() -> None:
    noise = normal_noise(KEYS[:1], INDEX[:50_000], 5)
    assert noise.shape == (5, 50_000)
    for values in noise:
        assert stats.kstest(values, "norm").pvalue > 0.001
        assert all(abs(correlation(values, lag)) < 0.02 for lag in (1, 5))
    assert np.abs(np.corrcoef(noise) - np.eye(5)).max() < 0.02


@pytest.mark.parametrize("noise", [uniform_noise, lambda keys, index: normal_noise(keys, index, 4)])
def test_streams_do_not_depend_on_each_other(noise: Any) -> None:
    together = noise(KEYS, INDEX[:1000, None])
    for i in range(len(KEYS)):
        alone = noise(KEYS[i : i + 1], INDEX[:1000])
        assert together[:, :, i].tobytes() == alone.tobytes()
        assert noise(KEYS[i : i + 1], INDEX[500:600]).tobytes() == alone[:, 500:600].tobytes()
    flat = together.reshape(4 * 1000, len(KEYS))
    assert np.abs(np.corrcoef(flat.T) - np.eye(len(KEYS))).max() < 0.06


def test_splitmix_gives_the_published_numbers() -> None:
    """Outputs for seed 1234567, as every implementation lists them; four 16-bit numbers each, lowest first."""
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    got = uniform_noise(np.array([1234567], dtype=np.uint64), np.arange(3, dtype=np.uint64))
    integers = np.round(got / math.sqrt(12.0 / (2.0**32 - 1.0)) - 0.5).astype(np.int64) % 2**16
    assert [sum(int(part) << 16 * i for i, part in enumerate(row)) for row in integers.T] == published


# ---------------------------------------------------------------------------------------------------------------- wind


def test_wind_begins_calm_and_has_the_statistics_of_its_processes() -> None:
    time = 0.25
    far = np.full((200_000, 3), 9.0)
    air = blow(far, ambient=0.7, ambient_time=time, fan_speed=0.0)
    assert np.array_equal(air[0], np.zeros(3))
    air = air[2000:]
    effective = len(air) * GRID / (2 * time)  # independent samples in it
    for values in air.T:
        assert abs(values.mean()) < 4 * 0.7 / math.sqrt(effective)
        assert values.std() == pytest.approx(0.7, rel=4 / math.sqrt(2 * effective))
        for lag in (1, 10, 50):
            assert correlation(values, lag) == pytest.approx(math.exp(-lag * GRID / time), abs=0.03)
        assert abs(stats.kurtosis(values)) < 0.15  # normal, though its noise is uniform
        assert abs(stats.skew(values)) < 0.15
    assert np.abs(np.corrcoef(air.T) - np.eye(3)).max() < 0.1


def test_jet_is_gaussian_across_and_constant_along_its_axis() -> None:
    direction = np.array([1.0, 2.0, -0.5])
    axis = direction / np.linalg.norm(direction)
    across = np.cross(axis, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(axis, [0.0, 0.0, 1.0]))
    jet: dict[str, Any] = {
        "ambient": 0.0,
        "turbulence": 0.0,
        "fan_speed": 3.0,
        "fan_position": [0.1, 0.2, 0.3],
        "fan_direction": direction.tolist(),
        "fan_radius": 0.4,
    }
    for along in (-2.0, 0.0, 5.0):
        for radius in (0.0, 0.3, 1.0):
            (air,) = blow(np.array([[0.1, 0.2, 0.3] + along * axis + radius * across]), **jet)
            np.testing.assert_allclose(air, 3.0 * math.exp(-(radius**2) / 0.32) * axis, rtol=1e-12, atol=1e-15)


def test_turbulence_is_a_share_of_the_local_speed_along_the_jet() -> None:
    places = np.tile([1.1, 0.0, 0.7], (100_000, 1))  # 0.2 m beside the axis
    air = blow(places, ambient=0.0, fan_speed=4.0, turbulence=0.25, turbulence_time=0.1)[1000:]
    mean = 4.0 * math.exp(-(0.2**2) / (2 * 0.3**2))
    assert np.array_equal(air[:, [0, 2]], np.zeros((len(air), 2)))
    assert air[:, 1].mean() == pytest.approx(mean, rel=0.02)
    assert air[:, 1].std() == pytest.approx(0.25 * mean, rel=0.03)
    assert correlation(air[:, 1], 20) == pytest.approx(math.exp(-1.0), abs=0.03)


def test_scale_multiplies_all_of_it() -> None:
    places = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    everything: dict[str, Any] = {"steady": [0.3, -0.2, 0.1], "ambient": 0.4}
    once, twice = blow(places, **everything), blow(places, scale=2.0, **everything)
    np.testing.assert_allclose(twice, 2 * once, rtol=0, atol=1e-12)
    other = blow(places, key=1, **everything)
    assert np.abs(other - once)[100:].mean() > 0.1


# ------------------------------------------------------------------------------------------------------- ground effect


def test_ground_effect_is_the_published_formula() -> None:
    radius = 0.127
    for height in (0.0635, 0.1, 0.3, 0.6, 2.0):
        formula = 1 / (1 - (radius / (4 * height)) ** 2)
        assert thrust_gain(height, radius, 1.0, max) == pytest.approx(formula, rel=1e-14)
        assert thrust_gain(height, radius, 3.0, max) - 1 == pytest.approx(3 * (formula - 1), rel=1e-12)
        assert thrust_gain(height, radius, 0.0, max) == 1.0
    lowest = thrust_gain(radius / 2, radius, 1.0, max)
    assert lowest == pytest.approx(4 / 3)
    assert thrust_gain(-1.0, radius, 1.0, max) == lowest  # below the range of the formula
    heights = np.array([-1.0, 0.1, 0.6])
    expected = [thrust_gain(height, radius, 1.0, max) for height in heights.tolist()]
    assert thrust_gain(heights, radius, np.ones(3), np.maximum).tolist() == expected
