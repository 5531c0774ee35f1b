"""Replays of the documentation: each environment has one, each is small, and its command is in the gallery."""

from __future__ import annotations

from pathlib import Path

import pytest
from documentation.replays import OF_ENVIRONMENTS, SHOWN

from artde_gym.evaluation.environments import ours

pytestmark = pytest.mark.once

DOCS = Path(__file__).parents[1] / "docs"
LARGEST = 100e3  # bytes, beside the viewer that all share


def test_every_environment_has_a_replay():
    assert sorted(OF_ENVIRONMENTS) == sorted(ours())
    assert set(OF_ENVIRONMENTS.values()) <= SHOWN.keys()


@pytest.mark.parametrize("name", SHOWN)
def test_a_replay_is_small_shares_the_viewer_and_can_be_made_again(name):
    page, gallery = DOCS / f"gallery/{name}.html", (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert page.stat().st_size < LARGEST
    assert '<script src="../assets/replay.js">' in page.read_text(encoding="utf-8")
    assert f"--viewer ../assets/replay.js --out gallery/{name}.html" in gallery
    assert f"<!-- replay: {name} -->" in gallery
