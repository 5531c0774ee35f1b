"""Saved policies: a folder with `policy.json`, what it is, and `weights.npz`, plain arrays. Nothing is executed.

`policy.json` names the format's version, the recipe of the residual, fields and hash of what the agent sees and does,
the network's shape, and the hash of the weights; all of it is checked on loading.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

import artde_gym
from artde_gym.arguments import check_bool, check_file_name, check_number, wrap_read_errors
from artde_gym.deprecation import current_residual
from artde_gym.layout import Layout
from baselines.errors import PolicyFileError
from baselines.network import Network
from baselines.residual_config import LONGEST, ResidualConfig

VERSION = 1
DESCRIPTION, WEIGHTS = "policy.json", "weights.npz"
T = TypeVar("T")


class Saved(NamedTuple):
    """A policy as it lies in a folder."""

    name: str
    config: ResidualConfig
    network: Network
    features: str
    actions: tuple[str, ...]
    control_period: float
    nominal: str
    about: dict[str, Any]


def layout_hash(layout: Layout) -> str:
    """Of names, sizes and units of all fields, in order."""
    text = json.dumps([[field.name, field.size, field.unit] for field in layout.fields])
    return hashlib.sha256(text.encode()).hexdigest()


def save(folder: Path, saved: Saved) -> None:
    """Write a policy; each of the two files is replaced at once, the description last."""
    from artde_gym.evaluation.store import write_atomically  # not needed, nor waited for, where policies only act

    network = saved.network
    arrays = {"mean": network.mean, "variance": network.variance}
    for i, (weight, bias) in enumerate(network.layers):
        arrays |= {f"weight_{i}": weight, f"bias_{i}": bias}
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # pyright: ignore[reportArgumentType]  # its stub mixes up arrays and flags
    description = {
        "version": VERSION,
        "artde_gym": artde_gym.__version__,
        "name": saved.name,
        "recipe": {**dataclasses.asdict(saved.config), "gains": dict(saved.config.gains)},
        "control_period": saved.control_period,
        "nominal_robot": saved.nominal,
        "features_sha256": saved.features,
        "actions": list(saved.actions),
        "network": {
            "sizes": [len(network.mean), *(len(bias) for _, bias in network.layers)],
            "activation": "tanh",
            "squashed": network.squashed,
        },
        "weights_sha256": hashlib.sha256(buffer.getvalue()).hexdigest(),
        "about": saved.about,
    }
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(description, indent=2) + "\n"
    write_atomically(folder / WEIGHTS, lambda file: file.write(buffer.getvalue()))
    write_atomically(folder / DESCRIPTION, lambda file: file.write(text.encode()))


def read(folder: Path) -> Saved:
    """Read a policy.

    Raises:
        PolicyFileError: if it is missing, damaged, of another version, or not of this form.
    """
    with wrap_read_errors("policy", folder, f"a folder with {DESCRIPTION} and {WEIGHTS}", PolicyFileError):
        description = json.loads((folder / DESCRIPTION).read_text(encoding="utf-8"))
        content = (folder / WEIGHTS).read_bytes()
    if not isinstance(description, Mapping):
        raise PolicyFileError("description", str(folder / DESCRIPTION), "a JSON object")
    version = description.get("version")
    if not (type(version) is int and version == VERSION):
        raise PolicyFileError(f"version of {folder / DESCRIPTION}", version, f"{VERSION}, which this release reads")
    if hashlib.sha256(content).hexdigest() != description.get("weights_sha256"):
        problem = f"do not belong to {DESCRIPTION}"
        raise PolicyFileError("weights", str(folder / WEIGHTS), "copy both files again", problem)
    with wrap_read_errors("policy", folder, "what `baselines` writes", PolicyFileError):
        return _saved(description, content)


def _saved(description: Mapping[str, Any], content: bytes) -> Saved:
    """Build a policy from its two files, every field checked."""
    shape = _of("network", description["network"], dict)
    if shape["activation"] != "tanh":
        raise PolicyFileError("network: activation", shape["activation"], "'tanh'")
    return Saved(
        check_file_name("name", description["name"]),
        ResidualConfig(**current_residual(_of("recipe", description["recipe"], dict))),
        _network(content, _sizes(shape["sizes"]), check_bool("network: squashed", shape["squashed"])),
        _of("features_sha256", description["features_sha256"], str),
        tuple(_of("actions", name, str) for name in _of("actions", description["actions"], list)),
        check_number(
            "control_period", description["control_period"], 1e-6, LONGEST, f"a number from 1e-6 to {LONGEST:g} (s)"
        ),
        _of("nominal_robot", description["nominal_robot"], str),
        _of("about", description["about"], dict),
    )


def _of(field: str, value: Any, kind: type[T]) -> T:
    """Return the value if it is of that type.

    Raises:
        PolicyFileError: if it is not.
    """
    if not isinstance(value, kind):
        raise PolicyFileError(field, value, f"a JSON {'object' if kind is dict else kind.__name__}")
    return value


def _sizes(value: Any) -> list[int]:
    good = isinstance(value, list) and len(value) >= 2 and all(type(size) is int and size >= 1 for size in value)
    if not good:
        raise PolicyFileError(
            "network: sizes", value, "whole numbers >= 1, at least of what goes in and of what comes out"
        )
    return value


def _network(content: bytes, sizes: list[int], squashed: bool) -> Network:
    def checked(name: str, shape: tuple[int, ...]) -> Any:
        array = arrays[name]
        if array.dtype != np.float32 or array.shape != shape or not np.isfinite(array).all():
            raise PolicyFileError(f"array {name!r}", f"{array.dtype} {array.shape}", f"finite float32 {shape}")
        return array

    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        layers = tuple(
            (checked(f"weight_{i}", (before, after)), checked(f"bias_{i}", (after,)))
            for i, (before, after) in enumerate(itertools.pairwise(sizes))
        )
        return Network(checked("mean", (sizes[0],)), checked("variance", (sizes[0],)), layers, squashed)
