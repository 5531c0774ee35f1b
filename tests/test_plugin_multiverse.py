"""The robot from outside goes through a multiverse: one environment after the other, with claims of its own."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from test_plugin import install, run

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")
pytest.importorskip("yaml", reason="pyyaml is not installed (extra sweep)")

DESIGN = {
    "scenario": "L1",
    "env_kwargs": {"duration": 0.4},
    "controllers": ["tde", "artde"],
    "worlds": 3,
    "factors": {
        "payload": {"path": "disturbances.payload.mass", "uniform": [0.1, 2.0], "source": "what it may carry"},
        "period": {"path": "env_kwargs.control_period", "choice": [0.002, 0.004], "source": "common rates"},
    },
}
CLAIM = """
from artde_gym.studies import register_world_claims
from artde_gym.studies.multiverse.claims import smaller
register_world_claims("two-link-arm", [smaller("artde", "tde"), smaller("tde", "pid")])
"""


def test_the_arm_goes_through_a_multiverse(tmp_path: Path) -> None:
    (tmp_path / "design.yaml").write_text(json.dumps(DESIGN))
    words = ["multiverse", "--design", "design.yaml", "--out", "run", "--workers", "1", "--report"]
    said = run(tmp_path, install(tmp_path), CLAIM, [words])
    assert "RMS error of artde below that of tde" in said
    assert "pid" not in said  # of a claim whose controllers do not run
    rows = pd.read_parquet(tmp_path / "run/episodes")
    assert sorted(zip(rows["world"], rows["controller"], strict=True)) == [
        (world, name) for world in range(3) for name in ("artde", "tde")
    ]
    assert len(set(rows["factor.payload"])) == 3
    assert "what it may carry" in (tmp_path / "run/report.html").read_text()
