"""Identities of controllers, by which a folder recognizes the policy of its episodes.

A pickle does not serve: that of one model differs between processes. The identity of a policy is the first of: its
declared `identity` (text); the hash of its parameters, if it has `get_parameters` as Stable-Baselines3's models do; the
hash of its attributes, if all of them are plain values (numbers, strings, arrays, functions, dataclasses, and lists and
mappings of them); or its class, together with its label.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import inspect
import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from artde_gym.errors import OptionError
from artde_gym.evaluation.provenance import SOURCES
from artde_gym.registration import ControllerSpec, resolved


class Identity(NamedTuple):
    """An identity and the method that determined it."""

    by: str
    value: str


def identity_of(item: Any) -> Identity:
    """Return the identity of a registered controller or a policy.

    Raises:
        OptionError: if its declared `identity` is not text.
    """
    if isinstance(item, ControllerSpec):
        kwargs = json.dumps(dict(item.kwargs), sort_keys=True, default=_registered)
        return Identity("entry point", f"{item.entry_point} {kwargs}")
    return content_of(item) or _of_attributes(item)


def content_of(policy: Any) -> Identity | None:
    """Return a policy's identity by its declaration or its learned parameters; None without either."""
    declared = getattr(policy, "identity", None)
    if declared is not None:
        if not isinstance(declared, str):
            raise OptionError("identity of a policy", declared, "text")
        return Identity("identity", f"{_class(policy)} {declared}")
    if callable(getattr(policy, "get_parameters", None)):
        parameters = policy.get_parameters()
        if isinstance(parameters, Mapping):  # training state does not affect what a policy does
            parameters = {name: value for name, value in parameters.items() if not str(name).endswith("optimizer")}
        try:
            return Identity("parameters", f"{_class(policy)} {digest(parameters)}")
        except TypeError:
            return None
    return None


def behind(name: str, env_id: str, item: Any, policy: Any) -> dict[str, str]:
    """Return hashes of a controller's learned weights, and of its code and its law's if that is the user's.

    Args:
        name: label of the controller.
        env_id: the environment that it drives.
        item: a registered controller, or the policy itself, whose weights are already its identity.
        policy: the policy built for the environment.
    """
    found: dict[str, str] = {}
    learned = content_of(policy) if isinstance(item, ControllerSpec) else None
    if learned is not None:
        found[f"weights of {name} in {env_id}"] = learned.value
    code: dict[str, Any] = {f"code of {name}": type(policy)}
    if isinstance(item, ControllerSpec):
        code[f"code that makes {name}"] = resolved(item.entry_point)
    for part in getattr(policy, "code", ()):  # of a law
        code[f"code of {name}: {part.__qualname__}"] = part
    for what, written in code.items():
        if written.__module__.split(".")[0] not in SOURCES:
            with contextlib.suppress(OSError, TypeError, SyntaxError):  # typed at a prompt, or changed since
                found[what] = hashlib.sha256(inspect.getsource(written).encode()).hexdigest()
    return found


def digest(value: Any) -> str:
    """Return the hash of a value of numbers, strings, arrays, functions, dataclasses, and lists and mappings of them.

    Raises:
        TypeError: if it contains anything else.
    """
    try:
        return hashlib.sha256(json.dumps(_plain(value)).encode()).hexdigest()
    except RecursionError as error:
        raise TypeError("a value that contains itself") from error


def _of_attributes(policy: Any) -> Identity:
    try:
        return Identity("attributes", f"{_class(policy)} {digest(vars(policy))}")
    except TypeError:  # also for an object without attributes
        return Identity("class and name", _class(policy))


def _class(policy: Any) -> str:
    return f"{type(policy).__module__}.{type(policy).__qualname__}"


def _registered(value: Any) -> Any:
    """Return a stable form of a fixed argument that JSON cannot store."""
    try:
        return digest(value)
    except TypeError:
        return _class(value)


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, Mapping):
        return {"mapping": sorted(([_plain(key), _plain(item)] for key, item in value.items()), key=str)}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (slice, type(...))):
        return repr(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [_class(value), {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}]
    tensor = getattr(value, "detach", None)  # of torch, which may not be installed
    if callable(tensor):
        value = np.asarray(tensor())
    if isinstance(value, np.ndarray) and value.dtype != object:
        return [value.dtype.str, value.shape, hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    return _named(value)


def _named(value: Any) -> str:
    """Return the name of a function or class in a module; for anything else, the identity of what it has learned."""
    name = getattr(value, "__qualname__", "<")
    if "<" not in name:
        return f"{value.__module__}.{name}"
    found = content_of(value)
    if found is None:
        raise TypeError(f"{_class(value)} has no identity")
    return found.value
