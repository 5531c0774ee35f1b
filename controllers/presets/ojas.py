"""Gains of every law for every robot, each with its source."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from artde_gym.errors import UnknownNameError, among
from controllers.laws.artde import ArtdeGains
from controllers.laws.atde import AtdeGains
from controllers.laws.computed_torque import ComputedTorqueGains
from controllers.laws.errors import GainError
from controllers.laws.tde import ConstantGains, TdeGains


@dataclasses.dataclass(frozen=True)
class Preset:
    """Gains (a frozen dataclass of `controllers.laws`) and where they come from."""

    gains: Any
    source: str


_THESIS = "Dantu 2023, section 2.5.2"
_M_BAR, _K_P, _K_D = 0.042, 25.0, 10.0
_ALPHA, _EPS, _FLOOR = 4.0, 5e-5, 0.01
_GAMMA = 500.0  # the thesis names no value; 200 and 500 were tried in the design, before any evaluation

_TDE = TdeGains(_M_BAR, _K_P, _K_D)
_ARTDE = ArtdeGains(
    _M_BAR,
    _K_P,
    _K_D,
    alpha=_ALPHA,
    gamma_0=_GAMMA,
    gamma_1=_GAMMA,
    beta_floor=_FLOOR,
    beta_start=_FLOOR,
    eps=_EPS,
)
_CONSTANT = ConstantGains(_M_BAR, _K_P, _K_D, alpha=_ALPHA, c=0.44, eps=_EPS)

PRESETS: dict[tuple[str, str, str], Preset] = {
    ("ojas", "tde", "thesis"): Preset(_TDE, _THESIS),
    ("ojas", "atde", "thesis"): Preset(
        AtdeGains(_M_BAR, _K_P, _K_D, alpha=_ALPHA, gamma_0=_GAMMA, c_floor=_FLOOR, c_start=_FLOOR, eps=_EPS),
        f"{_THESIS}; gamma_0, which it does not give, is 500 as for ARTDE",
    ),
    ("ojas", "artde", "thesis"): Preset(_ARTDE, f"{_THESIS}; gamma, which it does not give, is 500"),
    ("ojas", "artde", "robust"): Preset(
        dataclasses.replace(_ARTDE, growth="midpoint", clamp=True, leakage=0.1, cap=1.0),
        "ours: the thesis' gains with an unbiased growth test, a floor for each gain, leakage and a cap",
    ),
    ("ojas", "pid", "thesis"): Preset(_TDE, f"{_THESIS}, turned into the PID gains m_bar Kd/L, m_bar Kp/L, m_bar/L"),
    ("ojas", "tde+c", "thesis"): Preset(_CONSTANT, f"{_THESIS}; c is the mean of ARTDE's over S1"),
    ("ojas", "tde+kd", "thesis"): Preset(_CONSTANT, "the slope of tde+c at s = 0 as extra stiffness and damping"),
    ("ojas", "computed-torque", "thesis"): Preset(ComputedTorqueGains(_K_P, _K_D), f"{_THESIS}, Kp and Kd"),
}
"""(robot, law, preset) -> gains."""


def preset_gains(robot: str, law: str, preset: str, joints: int, overrides: dict[str, Any]) -> Any:
    """Gains of `law` for `robot` with so many `joints`, some of them replaced.

    Raises:
        UnknownNameError: if there is no such preset.
        GainError: for a gain that the law does not have, or a value that it does not allow.
    """
    key = (robot, law, preset)
    if key not in PRESETS:
        known = [name for known_robot, known_law, name in PRESETS if (known_robot, known_law) == (robot, law)]
        raise UnknownNameError(
            f"preset of {law!r} for {robot!r}", preset, ", ".join(map(repr, known)) or "no robot yet"
        )
    gains = PRESETS[key].gains
    names = [field.name for field in dataclasses.fields(gains)]
    for name in overrides:
        if name not in names:
            raise GainError(f"of {law!r}", name, among(name, names))
    gains = dataclasses.replace(gains, **overrides)
    for name in names:
        value = getattr(gains, name)
        if np.ndim(value) > 0 and np.shape(value)[0] != joints:
            raise GainError(name, value, f"one number, or one for each of the {joints} joints")
    return gains
