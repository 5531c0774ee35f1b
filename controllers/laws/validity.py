"""When time-delay estimation converges.

The TDE error obeys sigma_k = (1 - M^-1 m_bar) sigma_k-1 + ..., which decays where every eigenvalue of M(q)^-1 m_bar
lies between 0 and 2. Source: Dantu 2023, equation 2.14 (there as the sufficient norm condition); Hsia and Gao 1990.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.laws.errors import GainError
from controllers.laws.tde import Inertia


def tde_eigenvalues(inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.floating[Any]]:
    """Eigenvalues of M^-1 m_bar, (..., n), in rising order.

    Args:
        inertia: joint-space inertia M (..., n, n) (kg m^2), symmetric and positive definite; for a floating base its
            Schur complement over the base, `artde_gym.multibody.dynamics.joint_space_inertia`.
        m_bar: the nominal inertia of the law: a number, one a joint, or a positive definite matrix.

    Raises:
        GainError: for an m_bar that does not fit the inertia.
    """
    n = inertia.shape[-1]
    nominal = np.asarray(m_bar, dtype=np.float64)
    if nominal.ndim < 2:
        if nominal.size not in (1, n):
            raise GainError("m_bar", m_bar, f"one number, {n} numbers, or a matrix {n} x {n}")
        nominal = np.diag(np.broadcast_to(nominal, n))
    if nominal.shape != (n, n):
        raise GainError("m_bar", m_bar, f"one number, {n} numbers, or a matrix {n} x {n}")
    # with m_bar = R R^T the symmetric R^T M^-1 R has the same eigenvalues, and they come out real
    root = np.linalg.cholesky(nominal)
    return np.linalg.eigvalsh(root.T @ np.linalg.solve(np.asarray(inertia, dtype=np.float64), root))


def tde_is_valid(inertia: NDArray[np.floating[Any]], m_bar: Inertia) -> NDArray[np.bool_]:
    """Whether all eigenvalues lie inside (0, 2), (...)."""
    eigenvalues = tde_eigenvalues(inertia, m_bar)
    return np.all((eigenvalues > 0) & (eigenvalues < 2), axis=-1)
