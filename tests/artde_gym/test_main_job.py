"""The main job at full length: what the rest of the project stands on."""

from __future__ import annotations

from typing import Any

import pytest

from artde_gym.evaluation import evaluate


@pytest.mark.slow
def test_all_three_walk_and_artde_tracks_best() -> None:
    """S1 (1 ms, 58 s): no controller falls; ARTDE (as printed, gamma 500) has 30 % less RMSE than TDE on q3, q4, q5."""
    result = evaluate(["tde", "atde", "artde"], scenario="S1", episodes=1)
    assert not any(result.episodes["fell"])
    assert result.episodes["duration_s"].tolist() == pytest.approx([58.0] * 3)
    table: Any = result.compare("artde", "tde").loc["S1"]
    for joint in ("q3", "q4", "q5"):
        assert table.loc[f"rmse_deg_{joint}", "percent"] <= -30.0
    errors: Any = result.episodes.set_index("controller")["rmse_deg"]
    assert errors["tde"] > errors["atde"] > errors["artde"]
