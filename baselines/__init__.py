"""Learned baselines: a residual on a classical controller, its training and its saved policies.

`load(path)` gives a trained policy with Stable-Baselines3's `predict`; it needs neither torch nor Stable-Baselines3.
"""

from baselines.saved import load

__all__ = ["load"]
