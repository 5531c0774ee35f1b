"""What Dantu 2023 reports, number by number, to be printed beside ours.

The tables' "MAE" is the maximum absolute error. S1 lists for ARTDE's q3 a maximum (1.447) below the RMS value (1.455);
the number is kept as printed.
"""

from __future__ import annotations

JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")
"""Right leg: hip yaw, hip roll, hip pitch, knee, ankle pitch, ankle roll."""
POSITION = ("x", "y", "z")
ATTITUDE = ("phi", "theta", "psi")

TABLES: dict[str, str] = {"S1": "Table 2.1", "S2": "Table 2.2", "S3": "Table 2.3", "Q1": "Table 3.1"}


def _joints(*values: float) -> dict[str, float]:
    return dict(zip(JOINTS, values, strict=True))


def _position(*values: float) -> dict[str, float]:
    return dict(zip(POSITION, values, strict=True))


def _attitude(*values: float) -> dict[str, float]:
    return dict(zip(ATTITUDE, values, strict=True))


_S1 = {
    "tde": {
        "rmse_deg": _joints(0.108, 0.653, 2.231, 3.264, 3.254, 1.147),
        "max_abs_error_deg": _joints(0.173, 1.841, 2.456, 8.7415, 8.660, 5.976),
        "rms_torque_nm": _joints(2.864, 3.964, 5.965, 5.901, 7.764, 3.133),
    },
    "atde": {
        "rmse_deg": _joints(0.035, 0.551, 1.847, 2.671, 2.741, 1.023),
        "max_abs_error_deg": _joints(0.225, 0.945, 1.889, 7.483, 6.601, 6.190),
        "rms_torque_nm": _joints(3.076, 4.176, 6.003, 5.783, 7.861, 3.479),
    },
    "artde": {
        "rmse_deg": _joints(0.024, 0.436, 1.455, 2.072, 2.190, 0.741),
        "max_abs_error_deg": _joints(0.075, 0.746, 1.447, 5.407, 4.656, 2.415),
        "rms_torque_nm": _joints(2.826, 4.022, 5.883, 5.532, 7.832, 3.148),
    },
}
_S2 = {
    "artde": {
        "rmse_deg": _joints(0.026, 0.436, 1.466, 2.120, 2.205, 0.777),
        "max_abs_error_deg": _joints(0.063, 0.747, 3.140, 5.407, 5.944, 2.795),
        "rms_torque_nm": _joints(2.826, 4.006, 5.882, 5.657, 7.974, 3.253),
    },
}
_S3 = {
    "artde": {
        "rmse_deg_phase1": _joints(0.025, 0.436, 1.460, 2.118, 2.184, 0.763),
        "rmse_deg_phase2": _joints(0.026, 0.441, 1.456, 2.320, 2.243, 0.862),
        "rmse_deg_phase3": _joints(0.025, 0.497, 1.462, 2.108, 2.182, 0.770),
        "max_abs_error_deg_phase1": _joints(0.065, 0.745, 3.142, 5.361, 5.980, 2.008),
        "max_abs_error_deg_phase2": _joints(0.062, 4.118, 4.008, 7.864, 5.801, 3.061),
        "max_abs_error_deg_phase3": _joints(0.063, 6.723, 3.802, 5.853, 5.701, 2.893),
        "rms_torque_nm_phase1": _joints(2.824, 3.924, 5.863, 5.351, 7.78, 4.253),
        "rms_torque_nm_phase2": _joints(2.912, 4.004, 5.912, 5.801, 7.981, 3.837),
        "rms_torque_nm_phase3": _joints(2.802, 4.964, 5.904, 5.368, 7.763, 3.568),
    },
}
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
VALUES: dict[str, dict[str, dict[str, dict[str, float]]]] = {"S1": _S1, "S2": _S2, "S3": _S3, "Q1": _Q1}
"""scenario -> controller -> metric -> axis -> value."""

TIME_TO_FALL: dict[str, dict[str, float]] = {"S2": {"tde": 26.0, "atde": 31.0}}
"""scenario -> controller -> s."""


def value(scenario: str | None, controller: str, metric: str, axis: str) -> float | None:
    """The thesis' number, or None where it has none."""
    return VALUES.get(scenario or "", {}).get(controller, {}).get(metric, {}).get(axis)


def ending(scenario: str | None, controller: str) -> str:
    """How an episode ended in the thesis, "" if there was none."""
    time = TIME_TO_FALL.get(scenario or "", {}).get(controller)
    if time is not None:
        return f"falls at {time:g}"
    return "no fall" if controller in VALUES.get(scenario or "", {}) else ""
