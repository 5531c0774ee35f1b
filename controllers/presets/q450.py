"""Gains of the Q450, the quadrotor."""

from __future__ import annotations

from typing import Any

from controllers.laws.artde import ArtdeGains
from controllers.laws.asmc import AsmcGains
from controllers.laws.atde import AtdeGains
from controllers.laws.cascade import CascadeGains
from controllers.laws.indi import IndiGains
from controllers.laws.positional_pid import PositionalPidGains
from controllers.laws.rigid_attitude import RigidAttitudeGains
from controllers.laws.tde import ConstantGains, TdeGains
from controllers.presets.preset import Preset, Ranges

_THESIS = "Dantu 2023, section 3.5.1"
_M_BAR, _J_BAR, _K_P, _K_D = 1.0, 0.015, 10.0, 5.0
_ALPHA, _EPS, _FLOOR, _GAMMA = 4.0, 5e-5, 0.01, 1.0
_MASS, _INERTIA = 1.48, (0.0125, 0.0125, 0.0225)  # of the bare vehicle, for laws that know it


def _cascade(position: Any, attitude: Any, **options: Any) -> CascadeGains:
    """Both laws with what lies between them, the same for all."""
    return CascadeGains(
        position,
        attitude,
        command_rate=30.0,
        tilt_max_deg=45.0,
        lift_min=2.0,
        lift_max=24.0,  # at the largest tilt 34 N, all that four rotors give
        **options,
    )


def _both(law: Any, **rest: Any) -> CascadeGains:
    """The thesis' gains, which are the same in both loops but for the nominal inertia."""
    return _cascade(law(_M_BAR, _K_P, _K_D, **rest), law(_J_BAR, _K_P, _K_D, **rest))


_ADAPTIVE = {"alpha": _ALPHA, "eps": _EPS}
_ARTDE: dict[str, Any] = {
    **_ADAPTIVE,
    "gamma_0": _GAMMA,
    "gamma_1": _GAMMA,
    "beta_floor": _FLOOR,
    "beta_start": _FLOOR,
}
_CONSTANT = _cascade(
    ConstantGains(_M_BAR, _K_P, _K_D, **_ADAPTIVE, c=0.015), ConstantGains(_J_BAR, _K_P, _K_D, **_ADAPTIVE, c=0.055)
)

Q450: dict[tuple[str, str], Preset] = {
    ("tde", "thesis"): Preset(_both(TdeGains), _THESIS),
    ("atde", "thesis"): Preset(_both(AtdeGains, **_ADAPTIVE, gamma_0=_GAMMA, c_floor=_FLOOR, c_start=_FLOOR), _THESIS),
    ("artde", "thesis"): Preset(_both(ArtdeGains, **_ARTDE), _THESIS),
    ("artde", "robust"): Preset(
        _both(ArtdeGains, **_ARTDE, growth="midpoint", clamp=True, leakage=0.1, cap=1.0), "ours"
    ),
    ("pid", "tuned"): Preset(
        _cascade(
            PositionalPidGains(_MASS, 10.0, 5.0, 5.0, 20.0), PositionalPidGains(_INERTIA, 100.0, 20.0, 50.0, 20.0)
        ),
        "ours",
    ),
    ("geometric", "tuned"): Preset(
        _cascade(
            PositionalPidGains(_MASS, 10.0, 5.0, 5.0, 20.0),
            RigidAttitudeGains(100.0, 20.0, _INERTIA),
            command="reference",
        ),
        "ours",
    ),
    ("indi", "tuned"): Preset(
        _cascade(IndiGains(_MASS, 10.0, 5.0, 50.0, 0.55), IndiGains(_INERTIA, 60.0, 15.0, 50.0, 0.55)), "ours"
    ),
    ("asmc", "ours"): Preset(
        _cascade(
            AsmcGains(_MASS, 1.5, 1.5, 0.1, 1.0, 0.1, 0.01, 0.2, 0.0, 2.0, 9.81),
            AsmcGains(_INERTIA, 6.0, 6.0, 1.0, 1.0, 0.1, 0.04, 0.0, 0.0, 2.0, 0.0),
        ),
        "ours",
    ),
    ("tde+c", "thesis"): Preset(_CONSTANT, _THESIS),
    ("tde+kd", "thesis"): Preset(_CONSTANT, _THESIS),
}
"""(law, preset) -> gains."""

_FEEDBACK: Ranges = {"k_p_p": (2.0, 60.0), "k_d_p": (1.0, 15.0), "k_p_q": (4.0, 400.0), "k_d_q": (2.0, 50.0)}
_DELAYED: Ranges = {**_FEEDBACK, "m_bar_p": (0.5, 2.5), "m_bar_q": (0.005, 0.03)}
_ROBUST: Ranges = {"alpha_p": (0.5, 20.0), "alpha_q": (0.5, 20.0)}
_GROWTH: Ranges = {"gamma_0_p": (0.05, 50.0), "gamma_0_q": (0.05, 50.0)}
_INTEGRAL: Ranges = {"k_i_p": (0.5, 60.0), "k_i_q": (1.0, 1000.0)}
Q450_RANGES: dict[str, Ranges] = {
    "tde": _DELAYED,
    "atde": {**_DELAYED, **_ROBUST, **_GROWTH},
    "artde": {**_DELAYED, **_ROBUST, **_GROWTH, "gamma_1_p": (0.05, 50.0), "gamma_1_q": (0.05, 50.0)},
    "tde+c": {**_DELAYED, "c_p": (0.01, 10.0), "c_q": (0.01, 10.0)},
    "pid": {**_FEEDBACK, **_INTEGRAL},
    "geometric": {**_FEEDBACK, "k_i_p": _INTEGRAL["k_i_p"]},
    "indi": {**_FEEDBACK, "m_bar_p": (0.5, 2.5), "filter_rate_p": (10.0, 200.0), "filter_rate_q": (10.0, 200.0)},
    "asmc": {
        **{f"slope_{loop}": (0.3, 20.0) for loop in "pq"},
        **{f"k_s_{loop}": (0.3, 20.0) for loop in "pq"},
        **{f"c_floor_{loop}": (0.01, 10.0) for loop in "pq"},
        **{f"gamma_c_{loop}": (0.01, 50.0) for loop in "pq"},
        **{f"eps_{loop}": (1e-4, 1.0) for loop in "pq"},
        "gamma_r_p": (0.01, 5.0),
    },
}
"""Law -> ranges: a decade or so about gains that fly; the same for what two laws have in common."""
