"""When time-delay estimation converges.

The TDE error obeys sigma_k = (1 - M^-1 m_bar) sigma_k-1 + ..., which decays where every eigenvalue of M(q)^-1 m_bar
lies between 0 and 2. Source: Dantu 2023, equation 2.14 (there as the sufficient norm condition); Hsia and Gao 1990.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.laws.errors import GainError
from controllers.laws.tde import Inertia, as_matrix
from controllers.laws.tracking import check_positive_number

BLOCKED = 1e-6
"""Eigenvalues up to this size are zero but for rounding."""


def tde_eigenvalues(inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.floating[Any]]:
    """Eigenvalues of M^-1 m_bar, (..., n), in rising order.

    Args:
        inertia: joint-space inertia M (..., n, n) (kg m^2), symmetric and positive definite; for a floating base its
            Schur complement over the base, `artde_gym.multibody.dynamics.joint_space_inertia`.
        m_bar: the nominal inertia of the law: a number, one a joint, or a positive definite matrix.

    Raises:
        GainError: for an m_bar that does not fit the inertia.
    """
    # with m_bar = R R^T the symmetric R^T M^-1 R has the same eigenvalues, and they come out real
    root = np.linalg.cholesky(as_matrix(m_bar, inertia.shape[-1]))
    return np.linalg.eigvalsh(root.T @ np.linalg.solve(np.asarray(inertia, dtype=np.float64), root))


def support_eigenvalues(inverse_inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.floating[Any]]:
    """Eigenvalues of A m_bar, (..., n), in rising order, for joints of a robot that stands on something.

    A direction in which contacts allow no acceleration has the eigenvalue zero.

    Args:
        inverse_inertia: A (..., n, n) (1/(kg m^2)), symmetric: the acceleration of the joints by a force on them, the
            joint block of the constrained inverse inertia (`artde_gym.multibody.dynamics.constrained_inverse_inertia`).
        m_bar: see `tde_eigenvalues`.

    Raises:
        GainError: for an m_bar that does not fit the inertia.
    """
    root = np.linalg.cholesky(as_matrix(m_bar, inverse_inertia.shape[-1]))
    return np.linalg.eigvalsh(root.T @ np.asarray(inverse_inertia, dtype=np.float64) @ root)


def support_is_valid(inverse_inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.bool_]:
    """Return True if all eigenvalues of joints that stand on something are below 2, and none is negative, (...).

    Directions that contacts block need no estimate: zero, up to rounding, is valid there.
    """
    eigenvalues = support_eigenvalues(inverse_inertia, m_bar)
    return np.all((eigenvalues > -BLOCKED) & (eigenvalues < 2), axis=-1)


def largest_support_m_bar(inverse_inertia: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Compute the number m_bar below which all eigenvalues of A m_bar are below 2, (...)."""
    return 2.0 / np.linalg.eigvalsh(np.asarray(inverse_inertia, dtype=np.float64))[..., -1]


def support_m_bar(inverse_inertia: NDArray[np.floating[Any]], cap: float) -> NDArray[np.floating[Any]]:
    """Derive a constant nominal inertia (n, n) for a phase of support: mean(A)^-1, its eigenvalues at most `cap`.

    The cap keeps it valid in any other phase in which `largest_support_m_bar` is above it.

    Args:
        inverse_inertia: A (k, n, n) along the phase, of full rank in the mean.
        cap: largest eigenvalue (kg m^2).

    Raises:
        GainError: for a cap that is not above zero, or a phase with directions that no force accelerates.
    """
    check_positive_number("cap", cap)
    mean = np.asarray(inverse_inertia, dtype=np.float64).mean(axis=0)
    values, vectors = np.linalg.eigh(mean)
    if values[0] <= BLOCKED:
        raise GainError("inverse inertia", float(values[0]), "of full rank, as on one foot")
    matrix = (vectors * np.minimum(1.0 / values, cap)) @ vectors.T
    return 0.5 * (matrix + matrix.T)


def tde_is_valid(inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.bool_]:
    """Return True if all eigenvalues lie inside (0, 2), (...)."""
    eigenvalues = tde_eigenvalues(inertia, m_bar)
    return np.all((eigenvalues > 0) & (eigenvalues < 2), axis=-1)


def largest_m_bar(inertia: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Compute the number m_bar below which all eigenvalues lie inside (0, 2), (...): twice the smallest of M's."""
    return 2.0 * np.linalg.eigvalsh(np.asarray(inertia, dtype=np.float64))[..., 0]


def largest_joint_m_bar(inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.floating[Any]]:
    """Compute the m_bar of each joint below which all eigenvalues lie inside (0, 2), the others' as given, (..., n).

    For a diagonal m_bar the condition is that 2 m_bar^-1 - M^-1 be positive definite. With A = M^-1 and S that matrix
    without joint i, the Schur complement gives m_i < 2 / (A_ii + A_io S^-1 A_oi). It is zero where the other joints
    alone leave the range, and NaN for an m_bar with products of inertia, which is not one number a joint.

    Raises:
        GainError: for an m_bar that does not fit the inertia.
    """
    tde_eigenvalues(inertia, m_bar)  # refuses what does not fit
    n = inertia.shape[-1]
    nominal = np.asarray(m_bar, dtype=np.float64)
    if nominal.ndim == 2:
        if np.any(nominal != np.diag(np.diagonal(nominal))):
            return np.full(inertia.shape[:-1], np.nan)
        nominal = np.diagonal(nominal)
    inverse = np.linalg.inv(np.asarray(inertia, dtype=np.float64))
    diagonal = np.diag(2.0 / np.broadcast_to(nominal, n))
    return np.stack([_largest_of_joint(inverse, diagonal - inverse, i) for i in range(n)], axis=-1)


def _largest_of_joint(inverse: NDArray[Any], gap: NDArray[Any], joint: int) -> NDArray[np.floating[Any]]:
    """One joint's bound (...), from M^-1 and 2 m_bar^-1 - M^-1 (..., n, n)."""
    others = [i for i in range(inverse.shape[-1]) if i != joint]
    rest = gap[..., others, :][..., others]
    coupling = inverse[..., others, joint]
    allowed = np.linalg.eigvalsh(rest)[..., 0] > 0 if others else np.ones(inverse.shape[:-2], np.bool_)
    safe = np.where(allowed[..., None, None], rest, np.eye(len(others)))
    taken = np.sum(coupling * np.linalg.solve(safe, coupling[..., None])[..., 0], axis=-1)
    return np.where(allowed, 2.0 / (inverse[..., joint, joint] + taken), 0.0)
