"""Units of gains, for listings."""

from __future__ import annotations

_UNITS = {
    "m_bar": "{inertia}",
    "m_bar_left": "{inertia}",
    "m_bar_right": "{inertia}",
    "dwell": "s",
    "blend": "s",
    "inertia": "kg m^2",
    "k_p": "1/s^2",
    "k_d": "1/s",
    "k_i": "1/s^3",
    "load_mass": "kg",
    "vehicle_mass": "kg",
    "load_k_p": "1/s^2",
    "load_k_d": "1/s",
    "load_k_i": "1/s^3",
    "k_s": "1/s",
    "integral_limit": "{length}/s^2",
    "alpha": "1",
    "c": "{length}/s^2",
    "c_start": "{length}/s^2",
    "c_floor": "{length}/s^2",
    "slope": "1/s",
    "leakage": "1/s",
    "leakage_c": "1/s",
    "leakage_r": "1/s",
    "r_max": "1",
    "gravity": "m/s^2",
    "filter_rate": "rad/s",
    "filter_damping": "1",
    "command_rate": "rad/s",
    "tilt_max_deg": "deg",
    "lift_min": "N",
    "lift_max": "N",
}
_TURNING = {"inertia": "kg m^2", "length": "rad"}
_MOVING = {"inertia": "kg", "length": "m"}


def unit_of(gain: str) -> str:
    """Return the unit of a gain by its override's name; "" for a word, and where Q = I mixes units (SI throughout)."""
    name, coordinate = gain, _TURNING
    if gain.endswith(("_p", "_q")) and gain not in _UNITS:
        name, coordinate = gain[:-2], _MOVING if gain.endswith("_p") else _TURNING
    return _UNITS.get(name, "").format(**coordinate)
