"""Arguments of the training algorithms, as far as plain values can give them, and what each may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from artde_gym.errors import OptionError, suggest_names

ALGORITHMS = ("ppo", "sac", "cma-es")
MANY = 2**31 - 1


class Option(NamedTuple):
    """A test of a value, and the values that pass it in words."""

    good: Callable[[Any], bool]
    allowed: str


def check_options(algo: str, given: Any) -> None:
    """Check arguments of an algorithm.

    Raises:
        OptionError: for an unknown name, or a value that is not allowed.
    """
    if not isinstance(given, Mapping):
        raise OptionError("options", given, "a mapping of names to values")
    known = OPTIONS[algo]
    for name, value in given.items():
        if name not in known:
            raise OptionError(
                f"option of {algo}", name, suggest_names(name, known) if known else "none: it takes no options"
            )
        if not known[name].good(value):
            raise OptionError(f"options: {name}", value, known[name].allowed)


def _whole(low: int) -> Option:
    return Option(lambda value: type(value) is int and low <= value <= MANY, f"a whole number from {low} to {MANY}")


def _positive(high: float) -> Option:
    return Option(lambda value: _real(value) and 0.0 < value <= high, f"a number above 0, up to {high:g}")


def _or(option: Option, value: Any) -> Option:
    """The same, or one value besides."""
    text = "None" if value is None else repr(value)
    return Option(lambda given: given == value or option.good(given), f"{option.allowed}, or {text}")


def _real(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _is_architecture(value: Any) -> bool:
    if isinstance(value, Mapping):
        return value.keys() == {"pi", "vf"} and all(
            isinstance(one, list) and _is_architecture(one) for one in value.values()
        )
    return isinstance(value, list) and all(type(size) is int and 1 <= size <= 4096 for size in value)


_SHARE = Option(lambda value: _real(value) and 0.0 <= value <= 1.0, "a number from 0 to 1")
_WEIGHT = Option(lambda value: _real(value) and value >= 0.0, "a finite number >= 0")
_SWITCH = Option(lambda value: isinstance(value, bool), "True, False")
_BOTH = {"learning_rate": _positive(1.0), "gamma": _SHARE}
OPTIONS: dict[str, dict[str, Option]] = {
    "ppo": {
        **_BOTH,
        "n_steps": _whole(1),
        "batch_size": _whole(2),
        "n_epochs": _whole(1),
        "gae_lambda": _SHARE,
        "clip_range": _positive(1e3),
        "clip_range_vf": _or(_positive(1e9), None),
        "normalize_advantage": _SWITCH,
        "ent_coef": _WEIGHT,
        "vf_coef": _WEIGHT,
        "max_grad_norm": _positive(1e9),
        "target_kl": _or(_positive(1e9), None),
        "use_sde": _SWITCH,
        "sde_sample_freq": _or(_whole(1), -1),
        "log_std_init": Option(lambda value: _real(value) and abs(value) <= 20.0, "a number from -20 to 20"),
        "net_arch": Option(_is_architecture, "a list of layers' sizes, or a mapping with one each for pi and vf"),
    },
    "sac": {
        **_BOTH,
        "buffer_size": _whole(1),
        "learning_starts": _whole(0),
        "batch_size": _whole(1),
        "tau": _positive(1.0),
        "train_freq": _whole(1),
        "gradient_steps": _or(_whole(1), -1),
        "ent_coef": _or(_WEIGHT, "auto"),
        "target_update_interval": _whole(1),
        "target_entropy": _or(Option(_real, "a finite number"), "auto"),
    },
    "cma-es": {},
}
"""Algorithm -> option -> its values."""
