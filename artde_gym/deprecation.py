"""Deprecated names, which keep working for one release with a `DeprecationWarning`.

The tables list modules and their contents, keyword arguments, disturbances and their parameters, and names in stored
files. Files are read without a warning: an earlier release wrote them, and users cannot edit them.
"""

from __future__ import annotations

import functools
import importlib
import importlib.abc
import importlib.machinery
import inspect
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, TypeVar, cast

from artde_gym.errors import DisturbanceError, OptionError

T = TypeVar("T", bound=Callable[..., Any])

MODULES: dict[str, str] = {
    "artde_gym.doctor.examination": "artde_gym.doctor.checks",
    "artde_gym.doctor.outcome": "artde_gym.doctor.check_result",
    "artde_gym.evaluation.batch": "artde_gym.evaluation.vector_rollout",
    "artde_gym.evaluation.claims": "artde_gym.studies.reproduce.claims",
    "artde_gym.evaluation.film": "artde_gym.video",
    "artde_gym.evaluation.frontier": "artde_gym.studies.frontier.search",
    "artde_gym.evaluation.palette": "artde_gym.palette",
    "artde_gym.evaluation.report": "artde_gym.report",
    "artde_gym.evaluation.reproduce": "artde_gym.studies.reproduce.reproduction",
    "artde_gym.evaluation.scenarios": "artde_gym.scenarios",
    "artde_gym.evaluation.sweep": "artde_gym.studies.sweep.execution",
    "artde_gym.evaluation.sweep_store": "artde_gym.studies.sweep.store",
    "artde_gym.evaluation.tune": "artde_gym.studies.tune.tuning",
    "artde_gym.robots.dynamics": "artde_gym.multibody.dynamics",
    "artde_gym.robots.spec": "artde_gym.multibody.spec",
    "artde_gym.tracking": "artde_gym.metrics_spec",
    "baselines.coupling": "baselines.action_adapter",
    "baselines.joint_coupling": "baselines.joint_adapter",
    "baselines.recipe": "baselines.residual_config",
    "controllers.biped": "controllers.joint_space",
    "controllers.checkup": "controllers.stability_check",
    "controllers.laws.validity": "controllers.laws.stability",
}
"""Old module -> new module."""

NAMES: dict[str, dict[str, str]] = {
    "artde_gym.disturbances": {"KINDS": "DISTURBANCES", "Kind": "DisturbanceSpec"},
    "artde_gym.disturbances.kinds": {"KINDS": "DISTURBANCES", "Kind": "DisturbanceSpec"},
    "artde_gym.doctor": {"Outcome": "CheckResult", "examine": "run_checks"},
    "artde_gym.doctor.check_result": {"Outcome": "CheckResult"},
    "artde_gym.doctor.checks": {"examine": "run_checks"},
    "artde_gym.errors": {"among": "suggest_names"},
    "artde_gym.evaluation.environments": {"tracking_of": "metrics_spec_of"},
    "artde_gym.evaluation.vector_rollout": {"run_batch": "run_vector"},
    "artde_gym.metrics_spec": {"Effort": "EffortSignal", "Tracked": "TrackedSignal", "Tracking": "MetricsSpec"},
    "artde_gym.palette": {"LOOKS": "STYLES", "Look": "Style", "looks": "styles"},
    "artde_gym.registration": {"search_space": "tuning_space"},
    "artde_gym.video.frames": {"Shot": "Frame", "shots": "render_frames"},
    "artde_gym.video.tiles": {"panels": "tile_frames"},
    "baselines.action_adapter": {"Coupling": "ActionAdapter"},
    "baselines.joint_adapter": {"JointCoupling": "JointAdapter", "JointMemory": "JointAdapterState"},
    "baselines.residual": {"ResidualMemory": "ResidualState"},
    "baselines.residual_config": {"Recipe": "ResidualConfig"},
    "controllers.encoders": {"EncoderMemory": "EncoderState"},
    "controllers.laws.artde": {"ArtdeMemory": "ArtdeState", "artde_start": "artde_init"},
    "controllers.laws.asmc": {"AsmcMemory": "AsmcState", "asmc_start": "asmc_init"},
    "controllers.laws.atde": {"AtdeMemory": "AtdeState", "atde_start": "atde_init"},
    "controllers.laws.cascade": {
        "CascadeMemory": "CascadeState",
        "Flight": "QuadrotorInput",
        "cascade_start": "cascade_init",
    },
    "controllers.laws.indi": {"IndiMemory": "IndiState", "indi_start": "indi_init"},
    "controllers.laws.pid": {"PidMemory": "PidState", "pid_start": "pid_init"},
    "controllers.laws.positional_pid": {
        "PositionalPidMemory": "PositionalPidState",
        "positional_pid_start": "positional_pid_init",
    },
    "controllers.laws.second_order": {"FilterMemory": "FilterState"},
    "controllers.laws.tde": {"TdeMemory": "TdeState", "tde_start": "tde_init"},
    "controllers.laws.tracking": {"Memory": "LawState", "Signals": "JointInput"},
    "controllers.laws.velocity_estimate": {"EstimateMemory": "EstimateState", "estimate_start": "estimate_init"},
    "controllers.model_based": {"search_space": "tuning_space"},
    "controllers.policies": {"Plant": "ControlInterface"},
    "controllers.robots": {"search_space": "tuning_space"},
    "controllers.stability_check": {"validity": "stability"},
}
"""Module -> old name in it -> new name."""

DISTURBANCES = {
    "actuator_loss": "actuator_effectiveness",
    "mass_error": "mass_scale",
    "torque_delay": "action_delay",
}
"""Old kind of a disturbance -> new name."""
PARAMETERS = {
    "action_delay": {"samples": "steps"},
    "payload": {"attach": "attach_time", "drop": "detach_time"},
    "wind": {"fan_place": "fan_position"},
}
"""Kind of a disturbance -> old parameter -> new name."""
FIELDS = {"traced": "record_episodes", "trace_hz": "record_hz"}
"""Old argument of `evaluate`, `frontier` and `tune`, also in their stored configurations -> new name."""
RESIDUAL = {"channel": "action_mode", "hold": "decision_period", "limit": "action_scale"}
"""Old field of a residual, also in stored policies -> new name."""
GROUPS = {"artde_gym.agents": "artde_gym.couplings"}
"""Group of entry points -> old name."""


def warn(old: str, new: str) -> None:
    """Warn of an old name; the warning points at the caller's caller."""
    warnings.warn(f"{old} is deprecated; use {new}", DeprecationWarning, stacklevel=3)


def moved(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a module's `__getattr__` (PEP 562) for names that have moved to another module.

    Args:
        module: module that had them.
        names: name -> module that has it now.
    """

    def look_up(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warn(f"{module}.{name}", f"{names[name]}.{name}")
        return getattr(importlib.import_module(names[name]), name)

    return look_up


def renamed_arguments(names: Mapping[str, str], values: Mapping[Any, Any] | None = None) -> Callable[[T], T]:
    """Decorate a function or a class so that it also takes old keyword arguments.

    Args:
        names: old argument -> new name.
        values: old value -> new value of these arguments.
    """

    def decorate(target: T) -> T:
        owner: Any = target  # a class, or a function
        function: Any = owner.__init__ if inspect.isclass(owner) else owner

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            for old in names.keys() & kwargs.keys():
                if names[old] in kwargs:
                    raise OptionError(f"argument {old!r}", kwargs[old], f"only {names[old]!r}, its new name")
                warn(f"argument {old!r} of {target.__name__}", repr(names[old]))
                value = kwargs.pop(old)
                kwargs[names[old]] = (values or {}).get(value, value) if isinstance(value, str) else value
            return function(*args, **kwargs)

        if not inspect.isclass(owner):
            return cast("T", call)
        owner.__init__ = call
        return target

    return decorate


takes_old_names = renamed_arguments({**FIELDS, "backend": "vectorized"}, {"single": False, "batch": True})
"""Decorator for functions that take the arguments of `evaluate`."""


def current_path(path: str) -> str:
    """Return a path "kind.parameter..." with current names; other paths are unchanged."""
    head, *rest = path.split(".")
    kind = DISTURBANCES.get(head, head)
    names = PARAMETERS.get(kind, {})
    return ".".join([kind, *(names.get(part, part) for part in rest)])


def current_column(column: str) -> str:
    """Return the current name of a column of an episode table."""
    head, dot, path = column.partition(".")
    return f"{head}.{current_path(path)}" if dot and head in ("disturbance", "disturbances") else column


def current_disturbances(given: Any, *, told: bool = False) -> Any:
    """Return disturbances with the current names of the grammar; anything but a mapping is returned unchanged.

    Args:
        given: disturbances from a user or a file.
        told: True to warn of old names.
    """
    if not isinstance(given, Mapping):
        return given
    found: dict[Any, Any] = {}
    for old, value in given.items():
        kind = DISTURBANCES.get(old, old) if isinstance(old, str) else old
        if kind != old and kind in given:
            raise DisturbanceError("disturbances", old, f"only {kind!r}, its new name")
        if told and kind != old:
            warn(f"disturbance {old!r}", repr(kind))
        entries = value if isinstance(value, list) else [value]
        named = [_current_entry(kind, entry, told) for entry in entries]
        found[kind] = named if isinstance(value, list) else named[0]
    return found


def _current_entry(kind: Any, entry: Any, told: bool) -> Any:
    names = PARAMETERS.get(kind, {}) if isinstance(kind, str) else {}
    if not (names and isinstance(entry, Mapping)) or names.keys().isdisjoint(entry):
        return entry
    for old in names.keys() & entry.keys():
        if names[old] in entry:
            raise DisturbanceError(kind, old, f"only {names[old]!r}, its new name")
        if told:
            warn(f"parameter {old!r} of the disturbance {kind!r}", repr(names[old]))
    return {names.get(key, key): value for key, value in entry.items()}


def current_residual(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a stored residual under their current names."""
    return {RESIDUAL.get(name, name): value for name, value in fields.items()}


def current_configuration(stored: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stored configuration of a results folder under current names."""
    found: dict[str, Any] = {}
    for field, value in stored.items():
        if field == "backend":
            found["vectorized"] = value == "batch"
        elif field == "recipe" and isinstance(value, Mapping):
            found["config"] = current_residual(value)
        elif field == "disturbances":
            found[field] = current_disturbances(value)
        elif isinstance(value, Mapping):
            found[FIELDS.get(field, field)] = current_configuration(value)
        elif isinstance(value, list):
            items = [current_configuration(item) if isinstance(item, Mapping) else item for item in value]
            found[FIELDS.get(field, field)] = items
        else:
            found[FIELDS.get(field, field)] = value
    return found


class _OldNames(importlib.abc.Loader):
    """A wrapper of `loader` that adds the old names of `NAMES` to a module."""

    def __init__(self, loader: importlib.abc.Loader) -> None:
        self._loader = loader

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)  # its source, for tracebacks and `inspect`

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._loader.exec_module(module)
        _answer_old_names(module)


def _answer_old_names(module: ModuleType) -> None:
    """Add the old names of `NAMES` to a module (PEP 562)."""
    names = NAMES[module.__name__]

    def look_up(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")
        warn(f"{module.__name__}.{name}", names[name])
        return getattr(module, names[name])

    module.__dict__["__getattr__"] = look_up


class _OldModules(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """An import hook for the old modules of `MODULES` and the old names of `NAMES`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname in MODULES:
            return importlib.machinery.ModuleSpec(fullname, self)
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target) if fullname in NAMES else None
        if spec is not None and spec.loader is not None:
            spec.loader = _OldNames(spec.loader)
        return spec

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        new = MODULES[module.__name__]
        warn(module.__name__, new)
        contents = vars(importlib.import_module(new))
        kept = {name: value for name, value in contents.items() if not name.startswith("__") or name == "__getattr__"}
        module.__dict__.update(kept)


def find_old_modules() -> None:
    """Make old modules and old names in modules importable; called once, by `import artde_gym`."""
    if not any(isinstance(finder, _OldModules) for finder in sys.meta_path):
        for name in NAMES.keys() & sys.modules.keys():
            _answer_old_names(sys.modules[name])
        sys.meta_path.insert(0, _OldModules())  # before the finder that would load the modules of `NAMES`
