"""Gains of Ojas, the biped."""

from __future__ import annotations

import dataclasses
from typing import Any

from controllers.drive import Preset, Ranges
from controllers.laws.artde import ArtdeGains
from controllers.laws.atde import AtdeGains
from controllers.laws.computed_torque import ComputedTorqueGains
from controllers.laws.switched import SwitchedArtdeGains, SwitchedAtdeGains, SwitchedTdeGains
from controllers.laws.tde import ConstantGains, TdeGains
from controllers.presets.ojas_support import M_BAR_LEFT, M_BAR_RIGHT

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
_ATDE = AtdeGains(_M_BAR, _K_P, _K_D, alpha=_ALPHA, gamma_0=_GAMMA, c_floor=_FLOOR, c_start=_FLOOR, eps=_EPS)

STIFF_ACTUATORS = "rotor"
"""Actuator model from whose limit the stiff preset follows."""
STIFF_M_BAR = 0.077
"""0.85 of the limit 0.0909 along the walk: valid still where all inertias are 15 % smaller than those of the model."""
_STIFF = (
    "ours: the thesis' gains with m_bar = 0.077, 0.85 of its limit along the walk (`artde-gym design`), so that it is "
    "valid where all inertias are 15 % smaller than modeled; at 1 ms, stiffness 770 Nm/rad in place of 420"
)

SUPPORT_ACTUATORS = "rotor"
"""Actuator model from which the support preset follows."""
SUPPORT_M_BAR = 0.08
"""On both feet and on none, 0.88 of the limit of 0.0909 without contact."""
_SWITCHED: dict[str, Any] = {
    "m_bar": SUPPORT_M_BAR,
    "m_bar_left": M_BAR_LEFT,
    "m_bar_right": M_BAR_RIGHT,
    "dwell": 0.02,
    "blend": 0.06,
}
_SUPPORT = (
    "ours: the thesis' gains with mean(A)^-1 of each leg's support, its eigenvalues at most 0.09, from spec and gait "
    "(`artde-gym design --law tde-switched`); cap, m_bar on both feet, dwell and blend from about 35 variants in S1-L4 "
    "and S2-L4"
)

OJAS: dict[tuple[str, str], Preset] = {
    ("tde", "thesis"): Preset(_TDE, _THESIS),
    ("atde", "thesis"): Preset(
        _ATDE,
        f"{_THESIS}; gamma_0, which it does not give, is 500 as for ARTDE",
    ),
    ("artde", "thesis"): Preset(_ARTDE, f"{_THESIS}; gamma, which it does not give, is 500"),
    ("artde", "robust"): Preset(
        dataclasses.replace(_ARTDE, growth="midpoint", clamp=True, leakage=0.1, cap=1.0),
        "ours: the thesis' gains with an unbiased growth test, a floor for each gain, leakage and a cap",
    ),
    ("tde+c", "thesis"): Preset(_CONSTANT, f"{_THESIS}; c is the mean of ARTDE's over S1"),
    ("computed-torque", "thesis"): Preset(ComputedTorqueGains(_K_P, _K_D), f"{_THESIS}, Kp and Kd"),
    **{
        (law, "stiff"): Preset(dataclasses.replace(gains, m_bar=STIFF_M_BAR), _STIFF)
        for law, gains in {
            "tde": _TDE,
            "atde": _ATDE,
            "artde": _ARTDE,
            "tde+c": _CONSTANT,
        }.items()
    },
    ("tde-switched", "support"): Preset(SwitchedTdeGains(**{**vars(_TDE), **_SWITCHED}), _SUPPORT),
    ("atde-switched", "support"): Preset(SwitchedAtdeGains(**{**vars(_ATDE), **_SWITCHED}), _SUPPORT),
    ("artde-switched", "support"): Preset(SwitchedArtdeGains(**{**vars(_ARTDE), **_SWITCHED}), _SUPPORT),
}
"""(law, preset) -> gains."""

_FEEDBACK: Ranges = {"k_p": (5.0, 200.0), "k_d": (3.0, 40.0)}
_DELAYED: Ranges = {"m_bar": (0.01, 0.08), **_FEEDBACK}
OJAS_RANGES: dict[str, Ranges] = {
    "tde": _DELAYED,
    "atde": {**_DELAYED, "alpha": (0.5, 20.0), "gamma_0": (10.0, 5000.0)},
    "artde": {**_DELAYED, "alpha": (0.5, 20.0), "gamma_0": (10.0, 5000.0), "gamma_1": (10.0, 5000.0)},
    "tde+c": {**_DELAYED, "alpha": (0.5, 20.0), "c": (0.01, 10.0)},
    "computed-torque": _FEEDBACK,
    "tde-switched": _FEEDBACK,
    "atde-switched": {**_FEEDBACK, "alpha": (0.5, 20.0), "gamma_0": (10.0, 5000.0)},
    "artde-switched": {**_FEEDBACK, "alpha": (0.5, 20.0), "gamma_0": (10.0, 5000.0), "gamma_1": (10.0, 5000.0)},
}
"""Law -> ranges: a decade or so about the thesis' gains."""
