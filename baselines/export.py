"""From a network of Stable-Baselines3 to one on NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from artde_gym.extras import needs
from baselines.network import Network

with needs("rl"):
    from torch import nn


def exported(model: Any, normalizer: Any) -> Network:
    """Export the deterministic actor of a PPO or SAC model with its normalizer."""
    policy = model.policy
    squashed = hasattr(policy, "actor")
    modules = [*policy.actor.latent_pi, policy.actor.mu] if squashed else []
    if not squashed:
        modules = [*policy.mlp_extractor.policy_net, policy.action_net]
    layers = tuple(
        (
            np.ascontiguousarray(module.weight.detach().numpy().T.astype(np.float32)),
            module.bias.detach().numpy().astype(np.float32),
        )
        for module in modules
        if isinstance(module, nn.Linear)
    )
    statistics = normalizer.obs_rms
    return Network(statistics.mean.astype(np.float32), statistics.var.astype(np.float32), layers, squashed)
