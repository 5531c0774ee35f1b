"""The array library that a law's input belongs to: NumPy, JAX, PyTorch, or another one of the Array API.

A law asks for it once a call and hands it on as `xp`; no library but NumPy is imported here. The functions that laws
use mean the same in all of them, but for those that `TorchNamespace` adapts.
"""

from __future__ import annotations

import functools
import sys
from typing import Any

import numpy as np

_NDARRAY = np.ndarray


def namespace(array: Any) -> Any:
    """Return the functions of an array's library; NumPy for all that is no array."""
    if type(array) is _NDARRAY:  # first, and as quick as can be: laws run at 1 kHz
        return np
    return _other_namespace(array)


def _other_namespace(array: Any) -> Any:
    if isinstance(array, (np.ndarray, np.generic)):
        return np
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(array, torch.Tensor):
        return _torch_namespace(array.device)
    return array.__array_namespace__() if hasattr(array, "__array_namespace__") else np


def root(square: Any, xp: Any) -> Any:
    """Compute a square root whose derivative at zero is zero, so that gradients exist for an error of exactly zero."""
    if xp is np:
        return np.sqrt(square)
    zero = square == 0
    return xp.where(zero, 0.0, xp.sqrt(xp.where(zero, 1.0, square)))


class TorchNamespace:
    """PyTorch for tensors on one device, with NumPy's signatures where its own differ."""

    def __init__(self, device: Any) -> None:
        self._torch = sys.modules["torch"]
        self._device = device

    def __getattr__(self, name: str) -> Any:
        return getattr(self._torch, name)

    def asarray(self, value: Any, dtype: Any = None) -> Any:
        """Return a tensor; of numbers, in double precision unless told otherwise, as NumPy does."""
        if isinstance(value, self._torch.Tensor):
            return value if dtype is None else value.to(dtype)
        return self._torch.asarray(value, dtype=dtype or self._torch.float64, device=self._device)

    def full(self, shape: Any, value: Any, dtype: Any) -> Any:
        """Return a tensor of one value, which may be a tensor itself."""
        return self._torch.zeros(shape, dtype=dtype, device=self._device) + value

    def maximum(self, a: Any, b: Any) -> Any:
        """Return the larger of a tensor and a tensor or number."""
        return self._torch.clamp(a, min=b)

    def minimum(self, a: Any, b: Any) -> Any:
        """Return the smaller of a tensor and a tensor or number."""
        return self._torch.clamp(a, max=b)

    def vecdot(self, a: Any, b: Any) -> Any:
        """Return the products over the last axis."""
        return self._torch.linalg.vecdot(a, b)


@functools.lru_cache(maxsize=16)
def _torch_namespace(device: Any) -> TorchNamespace:
    return TorchNamespace(device)
