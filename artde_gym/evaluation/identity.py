"""Identities of controllers: by what a folder knows that it goes on with the policy of its episodes.

A pickle is none: that of one model differs from process to process. In this order, the identity of a policy is what it
declares as `identity` (text); the hash of its parameters, if it has `get_parameters` as Stable-Baselines3's models; the
hash of its attributes, if all of them are plain values (numbers, words, arrays, functions, dataclasses, and lists and
mappings of such); or its class alone, beside the name under which it is listed.
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
    """An identity, and by what it was found."""

    by: str
    value: str


def identity_of(item: Any) -> Identity:
    """The identity of a registered controller or a policy.

    Raises:
        OptionError: if it declares an `identity` that is no text.
    """
    if isinstance(item, ControllerSpec):
        kwargs = json.dumps(dict(item.kwargs), sort_keys=True, default=_registered)
        return Identity("entry point", f"{item.entry_point} {kwargs}")
    return content_of(item) or _of_attributes(item)


def content_of(policy: Any) -> Identity | None:
    """The identity that a policy has by what it has learned: a declared one, or its parameters; None without."""
    declared = getattr(policy, "identity", None)
    if declared is not None:
        if not isinstance(declared, str):
            raise OptionError("identity of a policy", declared, "text")
        return Identity("identity", f"{_class(policy)} {declared}")
    if callable(getattr(policy, "get_parameters", None)):
        parameters = policy.get_parameters()
        if isinstance(parameters, Mapping):  # how its training would go on is no part of what a policy does
            parameters = {name: value for name, value in parameters.items() if not str(name).endswith("optimizer")}
        try:
            return Identity("parameters", f"{_class(policy)} {digest(parameters)}")
        except TypeError:
            return None
    return None


def behind(name: str, env_id: str, item: Any, policy: Any) -> dict[str, str]:
    """Hashes of what a controller's name does not tell: what it has learned, and its code if that is the user's.

    Args:
        name: under which it is listed.
        env_id: of the environment that it drives.
        item: a registered controller, or the policy itself, whose weights are its identity already.
        policy: built for the environment.
    """
    found: dict[str, str] = {}
    learned = content_of(policy) if isinstance(item, ControllerSpec) else None
    if learned is not None:
        found[f"weights of {name} in {env_id}"] = learned.value
    code: dict[str, Any] = {f"code of {name}": type(policy)}
    if isinstance(item, ControllerSpec):
        code[f"code that makes {name}"] = resolved(item.entry_point)
    for what, written in code.items():
        if written.__module__.split(".")[0] not in SOURCES:
            with contextlib.suppress(OSError, TypeError, SyntaxError):  # typed at a prompt, or changed since
                found[what] = hashlib.sha256(inspect.getsource(written).encode()).hexdigest()
    return found


def digest(value: Any) -> str:
    """Hash of a value made of numbers, words, arrays, functions, dataclasses, and lists and mappings of such.

    Raises:
        TypeError: if it holds anything else.
    """
    try:
        return hashlib.sha256(json.dumps(_plain(value)).encode()).hexdigest()
    except RecursionError as error:
        raise TypeError("a value that holds itself") from error


def _of_attributes(policy: Any) -> Identity:
    try:
        return Identity("attributes", f"{_class(policy)} {digest(vars(policy))}")
    except TypeError:  # also of an object without any
        return Identity("class and name", _class(policy))


def _class(policy: Any) -> str:
    return f"{type(policy).__module__}.{type(policy).__qualname__}"


def _registered(value: Any) -> Any:
    """A fixed argument that JSON cannot write."""
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
    tensor = getattr(value, "detach", None)  # of torch, which need not be installed
    if callable(tensor):
        value = np.asarray(tensor())
    if isinstance(value, np.ndarray) and value.dtype != object:
        return [value.dtype.str, value.shape, hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    return _named(value)


def _named(value: Any) -> str:
    """A function or class of a module by its name, anything else by what it has learned."""
    name = getattr(value, "__qualname__", "<")
    if "<" not in name:
        return f"{value.__module__}.{name}"
    found = content_of(value)
    if found is None:
        raise TypeError(f"{_class(value)} has no identity")
    return found.value
