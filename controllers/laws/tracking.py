"""Common parts of all tracking laws: the signals of one sample, the errors and the sliding variable."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

from controllers.laws.errors import GainError

Array: TypeAlias = NDArray[np.floating[Any]]
Gain: TypeAlias = "float | Sequence[float]"
"""One number for all joints or one a joint."""


class JointInput(NamedTuple):
    """One sample of n joints, each (..., n), in rad, rad/s, rad/s^2 and Nm (or m, ..., N).

    `tau_applied` is the generalized force that really acted since the sample before.
    """

    q: Array
    qd: Array
    q_ref: Array
    qd_ref: Array
    qdd_ref: Array
    tau_applied: Array


LawState: TypeAlias = "tuple[Any, ...]"
"""State of a law: a named tuple of arrays, or of such tuples."""


class Law(NamedTuple):
    """A law on `JointInput` by its functions.

    Attributes:
        start: (gains, signals, period) -> memory before the first sample.
        step: (gains, memory, signals, period, ...) -> force (..., n), memory for the next sample; some laws take
            further fields of the observation.
    """

    start: Callable[[Any, JointInput, float], LawState]
    step: Callable[..., tuple[Array, LawState]]


def errors(signals: JointInput) -> tuple[Array, Array]:
    """e = q_ref - q and ed = qd_ref - qd."""
    return signals.q_ref - signals.q, signals.qd_ref - signals.qd


def desired_acceleration(signals: JointInput, e: Array, ed: Array, k_p: Gain, k_d: Gain, xp: Any = np) -> Array:
    """u_0 = qdd_ref + Kd ed + Kp e (Dantu 2023, equation 2.5c)."""
    return signals.qdd_ref + times(k_d, ed, xp) + times(k_p, e, xp)


def sliding_variable(e: Array, ed: Array, k_p: Gain, k_d: Gain, xp: Any = np) -> Array:
    """s = B^T P xi with A^T P + P A = -I for diagonal gains: s = e / (2 Kp) + ed (1 + Kp) / (2 Kp Kd)."""
    p12, p22 = sliding_weights(k_p, k_d, xp)
    return times(p12, e, xp) + times(p22, ed, xp)


def sliding_weights(k_p: Gain, k_d: Gain, xp: Any = np) -> tuple[Any, Any]:
    """p12 and p22 of the Lyapunov solution P for Q = I, joint by joint."""
    p = k_p if isinstance(k_p, (int, float)) else xp.asarray(k_p)
    d = k_d if isinstance(k_d, (int, float)) else xp.asarray(k_d)
    return 1 / (2 * p), (1 + p) / (2 * p * d)


def smooth_sign(s: Array, eps: float, xp: Any = np) -> Array:
    """sig(s, eps) = s / sqrt(|s|^2 + eps) (Dantu 2023, equation 2.19), the whole vector by its one norm."""
    return s / xp.sqrt(inner(s, s, xp) + eps)[..., None]


def inner(v: Array, w: Array, xp: Any = np) -> Array:
    """v^T w over the last axis."""
    if v.shape[-1] == 3:  # faster by components, and the same in any memory order: vecdot rounds by strides
        (a, b, c), (x, y, z) = components(v), components(w)
        return a * x + b * y + c * z
    if xp is np and v.ndim == w.ndim == 1:
        return v.dot(w)  # the same bits in half the time
    return xp.vecdot(v, w)


def times_rows(factor: Array, v: Array) -> Array:
    """Multiply each vector of v (..., n) by its factor (...)."""
    return factor * v if v.ndim == 1 else factor[..., None] * v


def components(v: Array) -> tuple[Array, Array, Array]:
    """Return the components of an array (..., 3)."""
    return v[..., 0][()], v[..., 1][()], v[..., 2][()]  # numbers of one vector: ten times as fast as 0-d arrays


def signed_step(size: Array, up: NDArray[np.bool_]) -> Array:
    """`size` where `up`, else -`size`; exact, and for single numbers ten times as fast as `np.where`."""
    return 2.0 * (size * up) - size


def times(gain: Gain, v: Array, xp: Any = np) -> Array:
    """gain v, in the precision of v."""
    if type(gain) is float or isinstance(gain, (int, float)):
        return gain * v
    return xp.asarray(gain, dtype=v.dtype) * v


def check_positive(field: str, gain: Gain) -> None:
    """Raise GainError unless all numbers of `gain` are finite and above zero."""
    values: tuple[object, ...] = tuple(gain) if isinstance(gain, (list, tuple)) else (gain,)
    if not values or not all(is_finite(value) and value > 0 for value in values):
        raise GainError(field, gain, "a finite number > 0, or one a joint")


def check_positive_number(field: str, value: float) -> None:
    """Raise GainError unless `value` is one finite number above zero."""
    if not (is_finite(value) and value > 0):
        raise GainError(field, value, "a finite number > 0")


def check_non_negative(field: str, value: float) -> None:
    """Raise GainError unless `value` is a finite number >= 0."""
    if not (is_finite(value) and value >= 0):
        raise GainError(field, value, "a finite number >= 0")


def check_switch(field: str, value: object) -> None:
    """Raise GainError unless `value` is a truth value."""
    if not isinstance(value, bool):
        raise GainError(field, value, "true, false")


def is_finite(value: object) -> TypeGuard[float]:
    """Return True if `value` is a finite number, and no truth value."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def make_plain(gains: Any) -> None:
    """Turn NumPy's numbers and arrays in a frozen dataclass into Python's, which let float32 signals stay float32."""
    for field in dataclasses.fields(gains):
        value = getattr(gains, field.name)
        if isinstance(value, (np.generic, np.ndarray)):
            object.__setattr__(gains, field.name, value.tolist())
