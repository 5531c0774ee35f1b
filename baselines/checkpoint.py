"""Checkpoints of a training: everything that the rest of it depends on, written at once, read without executing.

A checkpoint is a folder whose number counts intervals. All random numbers of an interval come from the training's seed
and that number, and every interval begins with fresh episodes: so parameters, optimizer and normalizer (for SAC also
the replay buffer) are the whole state, and a training that was killed and continued equals one that was not.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from artde_gym.arguments import wrap_read_errors
from artde_gym.extras import needs
from baselines.errors import TrainingError

with needs("rl"):
    import torch

KEPT = 2


class Checkpoints:
    """Checkpoints of one run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def save(self, model: Any, normalizer: Any, state: dict[str, Any]) -> None:
        """Write the state after interval `state["interval"]`; it appears whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        part = self.folder / "part"
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        parameters = model.get_parameters()
        if hasattr(model, "log_ent_coef"):
            parameters["log_ent_coef"] = model.log_ent_coef.detach()  # no parameter of SAC's policy
        torch.save(parameters, part / "parameters.pt")
        statistics = {"observation": normalizer.obs_rms, "return": normalizer.ret_rms}
        arrays = {f"{name}_{key}": getattr(values, key) for name, values in statistics.items() for key in _STATISTICS}
        np.savez(part / "normaliser.npz", **arrays)
        if hasattr(model, "replay_buffer"):
            buffer = model.replay_buffer
            filled = buffer.buffer_size if buffer.full else buffer.pos
            np.savez(
                part / "replay.npz",
                pos=buffer.pos,
                full=buffer.full,
                **{name: getattr(buffer, name)[:filled] for name in _BUFFER},
            )
        (part / "state.json").write_text(json.dumps({**state, "updates": model._n_updates}, indent=1))
        final = self.folder / f"{state['interval']:06d}"
        shutil.rmtree(final, ignore_errors=True)
        os.replace(part, final)
        for old in self._numbered()[:-KEPT]:
            shutil.rmtree(old)

    def restore(self, model: Any, normalizer: Any) -> dict[str, Any] | None:
        """Put the newest checkpoint into a model and its normalizer; returns its state, or None without one."""
        numbered = self._numbered()
        if not numbered:
            return None
        folder = numbered[-1]
        allowed = "a folder that `train` wrote; without it, the one before is used"
        with wrap_read_errors("checkpoint", folder, allowed, TrainingError):
            return self._restore(folder, model, normalizer)

    def _restore(self, folder: Path, model: Any, normalizer: Any) -> dict[str, Any]:
        parameters = torch.load(folder / "parameters.pt", weights_only=True)
        if "log_ent_coef" in parameters:
            model.log_ent_coef.data.copy_(parameters.pop("log_ent_coef"))
        model.set_parameters(parameters, device="cpu")
        # NumPy leaves a damaged file open, if it was given its path
        with (folder / "normaliser.npz").open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            for name, values in {"observation": normalizer.obs_rms, "return": normalizer.ret_rms}.items():
                for key in _STATISTICS:
                    stored = arrays[f"{name}_{key}"]
                    setattr(values, key, stored if stored.ndim else stored.item())
        if hasattr(model, "replay_buffer"):
            with (folder / "replay.npz").open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                buffer = model.replay_buffer
                buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])
                for name in _BUFFER:
                    getattr(buffer, name)[: len(arrays[name])] = arrays[name]
        state = json.loads((folder / "state.json").read_text())
        model.num_timesteps = state["steps"]
        model._n_updates = state["updates"]  # Stable-Baselines3 has no other way in
        return state

    def _numbered(self) -> list[Path]:
        return sorted(folder for folder in self.folder.glob("[0-9]*") if folder.is_dir())


_STATISTICS = ("mean", "var", "count")
_BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
