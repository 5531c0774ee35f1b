"""Results of Ojas published by Dantu 2023, for comparison.

The tables' "MAE" is the maximum absolute error. S1 lists for ARTDE's q3 a maximum (1.447) below the RMS value (1.455);
the number is kept as printed.
"""

from __future__ import annotations

from artde_gym.kit import Reported

JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")
"""Right leg: hip yaw, hip roll, hip pitch, knee, ankle pitch, ankle roll."""


def _joints(*values: float) -> dict[str, float]:
    return dict(zip(JOINTS, values, strict=True))


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
REPORTED = {
    "S1": Reported("Table 2.1", _S1),
    "S2": Reported("Table 2.2", _S2, {"tde": 26.0, "atde": 31.0}),
    "S3": Reported("Table 2.3", _S3),
}
"""Published results by scenario."""
