"""Results of the Q450 published by Dantu 2023, for comparison.

The tables' "MAE" is the maximum absolute error.
"""

from __future__ import annotations

from artde_gym.kit import Reported

POSITION = ("x", "y", "z")
ATTITUDE = ("phi", "theta", "psi")


def _position(*values: float) -> dict[str, float]:
    return dict(zip(POSITION, values, strict=True))


def _attitude(*values: float) -> dict[str, float]:
    return dict(zip(ATTITUDE, values, strict=True))


_Q1 = {
    "atde": {
        "rmse_m": _position(0.07, 0.15, 0.13),
        "rmse_deg": _attitude(3.37, 2.28, 2.22),
        "max_abs_error_m": _position(0.09, 0.27, 0.27),
        "max_abs_error_deg": _attitude(15.32, 8.29, 6.01),
    },
    "asmc": {
        "rmse_m": _position(0.07, 0.13, 0.13),
        "rmse_deg": _attitude(2.04, 1.81, 2.46),
        "max_abs_error_m": _position(0.13, 0.25, 0.25),
        "max_abs_error_deg": _attitude(9.53, 6.46, 7.50),
    },
    "artde": {
        "rmse_m": _position(0.06, 0.10, 0.04),
        "rmse_deg": _attitude(2.12, 1.72, 2.50),
        "max_abs_error_m": _position(0.09, 0.22, 0.25),
        "max_abs_error_deg": _attitude(7.46, 6.25, 5.76),
    },
}
REPORTED = {"Q1": Reported("Table 3.1", _Q1)}
"""Published results by scenario."""
