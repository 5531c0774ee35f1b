"""The strip of the support phase below the charts of the biped."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from artde_gym.palette import Style
from artde_gym.report.chart import LEFT, RIGHT, Axis, Chart
from artde_gym.report.run import Episode, Signals
from artde_gym.report.signals import over_time
from artde_gym.robots.ojas.report import SUPPORT, reference, strip
from artde_gym.robots.ojas.walking import walking_pattern

pytestmark = pytest.mark.once

TIME = np.linspace(0.0, 1.0, 101)


def episode(standing: np.ndarray) -> Episode:
    fields = {"contact": standing.astype(float), "time": TIME}
    return Episode(0, {"tde": Signals(fields, {"fell": False}), "artde": Signals({"time": TIME}, {"fell": False})})


def test_bands_are_the_times_on_each_foot_and_on_both() -> None:
    left, right = TIME < 0.6, (TIME >= 0.5) & (TIME < 0.9)  # both from 0.5 to 0.6 s, in the air from 0.9 s on
    found = strip(episode(np.stack([left, right], axis=-1)))
    spans = {band.text: band.spans for band in found.bands}
    np.testing.assert_allclose(spans["left foot"], [(0.0, 0.5)])
    np.testing.assert_allclose(spans["both feet"], [(0.5, 0.6)])
    np.testing.assert_allclose(spans["right foot"], [(0.6, 0.9)])
    assert spans.keys() == SUPPORT.keys()
    assert "tde" in found.caption
    assert not strip(Episode(0, {"artde": Signals({"time": TIME}, {})})).bands


def test_a_strip_keeps_within_the_axis_of_its_chart() -> None:
    chart = Chart("a", Axis("time (s)", 2.0, 4.0), Axis("b", 0.0, 1.0))
    chart.strip([(0.0, 1.0), (1.0, 3.0), (3.5, 9.0)], Style("#000000", "o"), "left foot")
    chart.strip([(5.0, 6.0)], Style("#000000", "o"), "outside")
    drawn = re.findall(r'class="strip"[^>]* d="([^"]*)"', chart.svg())
    width = chart.width - LEFT - RIGHT
    assert len(drawn) == 1
    numbers = np.array([[float(x) for x in pair] for pair in re.findall(r"M([\d.]+) [\d.]+H([\d.]+)", drawn[0])])
    np.testing.assert_allclose((numbers - LEFT) / width * 2.0 + 2.0, [(2.0, 3.0), (3.5, 4.0)], atol=0.01)


def test_charts_over_time_have_it() -> None:
    plain = episode(np.ones((101, 2), np.bool_))
    shown = dataclasses.replace(plain, strip=strip(plain))
    for one, count in ((plain, 0), (shown, 1)):
        assert over_time(one, "error", "error (deg)", [TIME]).svg().count('class="strip"') == count


def test_charts_of_the_pattern_have_the_planned_support() -> None:
    parts = "".join(reference({"duration": 10.0})['pattern {"duration": 10.0}'])
    load = walking_pattern(0.1, 1.0, 10.0, 0.001).load_left
    assert 0 < np.mean(load == 1.0) < 1
    assert parts.count('class="strip"') == 3 * parts.count("<svg role")
