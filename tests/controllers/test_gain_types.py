"""Every gain of every law is checked for its type when it is given."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from controllers.drive import DRIVES
from controllers.laws.errors import GainError
from controllers.laws.tde import TdeGains
from controllers.presets import LOOPS

GAINS: dict[type[Any], Any] = {}
for drive in DRIVES.values():
    for preset in drive.presets.values():
        loops = [getattr(preset.gains, loop) for loop in LOOPS if hasattr(preset.gains, loop)]
        GAINS |= {type(gains): gains for gains in (preset.gains, *loops)}
FIELDS = [
    (gains, field.name) for gains in GAINS.values() for field in dataclasses.fields(gains) if field.name not in LOOPS
]


@pytest.mark.parametrize(("gains", "field"), FIELDS, ids=[f"{type(gains).__name__}.{field}" for gains, field in FIELDS])
def test_a_value_of_another_type_is_refused(gains: Any, field: str) -> None:
    switch = isinstance(getattr(gains, field), bool)
    for value in ("false", "1.0", None, [], {}, [[]], 1j, 1 if switch else True, "" if switch else [True]):
        with pytest.raises(GainError, match=field):
            dataclasses.replace(gains, **{field: value})


def test_a_switch_may_be_of_numpy() -> None:
    (artde,) = (gains for kind, gains in GAINS.items() if kind.__name__ == "ArtdeGains")
    assert dataclasses.replace(artde, clamp=np.bool_(True)).clamp is True


@pytest.mark.parametrize("entry", ["1.0", True])
def test_a_matrix_holds_numbers(entry: Any) -> None:
    with pytest.raises(GainError, match="m_bar"):
        TdeGains([[entry, 0.0], [0.0, entry]], 1.0, 1.0)  # pyright: ignore[reportArgumentType]  # the point
