"""The cells of a sweep: the content of `sweep.yaml`, validated and expanded.

    scenario: S2                      # fixed: env, scenario, controller, gains, disturbances, env_kwargs, seed
    env_kwargs: {duration: 6.0}
    episodes: 20                      # per cell; episode i has the seed that `evaluate` gives it
    grid:                             # every combination of these values ...
      controller: [tde, artde]
      env_kwargs.control_period: [0.001, 0.004]
    sample:                           # ... with each of these random draws
      draws: 50
      vary:
        gains.artde.gamma_0: {log_uniform: [50, 5000]}
        disturbances.payload.mass: {uniform: [0.5, 2.0]}

A path is one of the fixed names, or one value inside: `gains.<controller>.<gain>`, `env_kwargs.<argument>`,
`disturbances.<kind>`, `disturbances.<kind>.<parameter>`, or `disturbances.<kind>.<parameter>.<i>` of a vector. Equal
cells count once, however they are written (`1` and `1.0`, a payload of `1` and of `{mass: 1}`, an argument at its
default): gains of a controller that a cell does not run change nothing in it. Draw i depends only on the seed, i and
the path: more draws, or more paths, leave it unchanged, and every combination of the grid meets the same draws.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import math
import sys
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from artde_gym.arguments import check_bool
from artde_gym.deprecation import current_column, current_disturbances, warn
from artde_gym.disturbances import DISTURBANCES
from artde_gym.disturbances.kinds import parameters_of
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation import canonical
from artde_gym.evaluation.cells import Cell, cells_of
from artde_gym.evaluation.environments import robot_of
from artde_gym.evaluation.identity import identity_of
from artde_gym.extras import needs
from artde_gym.registration import ControllerSpec, registered_controllers
from artde_gym.scenarios import scenario as find_scenario
from artde_gym.studies.frontier.axis import placed

SETTINGS: dict[str, Any] = {
    "env": None,
    "scenario": None,
    "controller": None,
    "gains": {},
    "disturbances": None,
    "env_kwargs": {},
    "seed": 0,
}
"""Settings of a cell with their defaults, as `evaluate` takes them, for one controller."""
KEYS = (*SETTINGS, "episodes", "vectorized", "grid", "sample")
INSIDE = ("gains.<controller>.<gain>", "disturbances.<kind>.<parameter>", "env_kwargs.<argument>")
DISTRIBUTIONS = ("uniform", "log_uniform", "integers", "normal", "choice")
MOST_CELLS = 100_000
MOST_EPISODES = 2_000_000
LARGEST = 1 << 20  # bytes of a file
DEEPEST = 20  # levels of nesting in it


@dataclasses.dataclass(frozen=True)
class SweepCell:
    """One cell of a sweep.

    Attributes:
        cell: environment, arguments, disturbances.
        controller: name of the controller.
        spec: the registered controller of this name.
        gains: gains that override its preset's.
        seed: base seed, as `evaluate` takes it.
        id: hash of everything that determines its episodes.
    """

    cell: Cell
    controller: str
    spec: ControllerSpec
    gains: dict[str, Any]
    seed: int
    id: str

    @property
    def columns(self) -> dict[str, Any]:
        """Return this cell's settings as columns of a table, without those that are not given."""
        kwargs = dict(self.cell.kwargs)
        disturbances = kwargs.pop("disturbances", None)
        columns = {f"gains.{name}": _plain(value) for name, value in self.gains.items()}
        columns |= {f"env_kwargs.{name}": _plain(value) for name, value in kwargs.items()}
        columns["disturbances"] = None if disturbances is None else json.dumps(disturbances, sort_keys=True)
        return {name: value for name, value in columns.items() if value is not None}


@dataclasses.dataclass(frozen=True)
class Design:
    """A whole sweep: `episodes` of every cell. `text` is the content of its file, as JSON."""

    points: tuple[SweepCell, ...]
    episodes: int
    vectorized: bool
    text: str


def read(path: str | Path) -> dict[str, Any]:
    """Read a sweep file as plain values of YAML 1.2; nothing in it is ever executed.

    Raises:
        OptionError: if it is not readable, or not a YAML mapping of plain values.
    """
    with needs("sweep"):
        import yaml

        from artde_gym.studies.sweep.yaml12 import Loader

    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise OptionError("sweep file", str(path), f"at most {LARGEST} bytes")
        found = yaml.load(data.decode("utf-8"), Loader)
    except (OSError, ValueError, TypeError, OverflowError, RecursionError, yaml.YAMLError) as error:
        if isinstance(error, OptionError):
            raise
        raise OptionError("sweep file", str(path), f"a readable YAML file ({' '.join(str(error).split())})") from error
    if not isinstance(found, dict):
        raise OptionError("sweep file", str(path), f"a mapping with the keys {', '.join(KEYS)}")
    return found


def design(given: Mapping[str, Any]) -> Design:
    """Return the cells of a sweep from the content of its file.

    Raises:
        OptionError, UnknownNameError: for an unknown key, a wrong type, an unknown name, or too many cells or episodes.
            Environments and controllers are not asked here.
    """
    check_plain("sweep", given)
    given = _current(given)
    for key in given:
        if key not in KEYS:
            raise OptionError("key of the sweep", key, suggest_names(key, KEYS))
    episodes, vectorized = given.get("episodes", 1), given.get("vectorized", False)
    if not (_is_whole(episodes) and 1 <= episodes <= MOST_EPISODES):
        raise OptionError("episodes", episodes, f"a whole number from 1 to {MOST_EPISODES}")
    check_bool("vectorized", vectorized)
    fixed = {**SETTINGS, **{name: value for name, value in given.items() if name in SETTINGS}}
    for name, value in fixed.items():
        check_setting(name, value)
    grid = {_current_path(path): values for path, values in _grid(given.get("grid", {})).items()}
    draws = _draws(given.get("sample"), fixed["seed"])  # by the paths as written, so that old files draw the same
    draws = [{_current_path(path): value for path, value in draw.items()} for draw in draws]
    for path, values in grid.items():
        if path in draws[0]:
            raise OptionError("path", path, "keep one of them", "is in the grid and in the sample")
        for value in values:
            _check_at(path, value)
    for draw in draws:
        for path, value in draw.items():
            _check_at(path, value)
    count = math.prod(map(len, grid.values())) * len(draws)
    if count > MOST_CELLS:
        raise OptionError("sweep", f"{count} cells", f"at most {MOST_CELLS}")
    names = {fixed["controller"], *grid.get("controller", ()), *(draw.get("controller") for draw in draws)}
    points: dict[str, SweepCell] = {}
    for values in itertools.product(*grid.values()):
        for draw in draws:
            point = point_of(settings_of(fixed, {**dict(zip(grid, values, strict=True)), **draw}), vectorized, names)
            points.setdefault(point.id, point)
    if len(points) * episodes > MOST_EPISODES:
        raise OptionError("sweep", f"{len(points) * episodes} episodes", f"at most {MOST_EPISODES}")
    return Design(tuple(points.values()), episodes, vectorized, json.dumps(given))


def _current(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a sweep file with current names."""
    found = dict(given)
    if "backend" in found:
        warn("key 'backend' of a sweep", "'vectorized: true'")
        known = {"single": False, "batch": True}
        backend = found.pop("backend")
        if not (isinstance(backend, str) and backend in known):
            raise OptionError("backend", backend, "'single', 'batch'; or rather vectorized: true")
        found["vectorized"] = known[backend]
    if isinstance(found.get("disturbances"), Mapping):
        found["disturbances"] = current_disturbances(found["disturbances"], told=True)
    return found


def _current_path(path: str) -> str:
    """Return a path with current names."""
    now = current_column(path)
    if now != path:
        warn(f"path {path!r} of a sweep", repr(now))
    return now


def _grid(given: Any) -> dict[str, list[Any]]:
    if not isinstance(given, Mapping):
        raise OptionError("grid", given, "a mapping of paths to lists of values")
    for path, values in given.items():
        check_path(path)
        if not (isinstance(values, list) and values):
            raise OptionError(f"grid: {path}", values, "a list with at least one value")
    return dict(given)


def _draws(given: Any, seed: int) -> list[dict[str, Any]]:
    """Return each draw's values by path; one empty draw without a sample."""
    if given is None:
        return [{}]
    if not (isinstance(given, Mapping) and given.keys() == {"draws", "vary"} and isinstance(given["vary"], Mapping)):
        raise OptionError("sample", given, "a mapping with `draws` and `vary`, a mapping of paths to distributions")
    draws, vary = given["draws"], given["vary"]
    if not (_is_whole(draws) and 1 <= draws <= MOST_CELLS):
        raise OptionError("sample: draws", draws, f"a whole number from 1 to {MOST_CELLS}")
    for path, distribution in vary.items():
        check_path(path)
        check_distribution(f"sample: {path}", distribution)
    return [{path: _draw(path, distribution, seed, i) for path, distribution in vary.items()} for i in range(draws)]


def check_distribution(field: str, given: Any) -> None:
    """Refuse what is no distribution of `DISTRIBUTIONS`."""
    if not (isinstance(given, Mapping) and len(given) == 1 and next(iter(given)) in DISTRIBUTIONS):
        raise OptionError(field, given, f"a mapping of one of {', '.join(DISTRIBUTIONS)} to a list")
    ((kind, arguments),) = given.items()
    field = f"{field}.{kind}"
    if kind == "choice":
        if not (isinstance(arguments, list) and arguments):
            raise OptionError(field, arguments, "a list with at least one value")
        return
    good = _is_whole if kind == "integers" else is_number
    if not (isinstance(arguments, list) and len(arguments) == 2 and all(map(good, arguments))):
        raise OptionError(field, arguments, f"two {'whole ' * (kind == 'integers')}numbers")
    first, second = arguments
    if kind == "normal" and second < 0:
        raise OptionError(field, arguments, "a mean and a standard deviation >= 0")
    if kind != "normal" and not (first <= second and math.isfinite(float(second) - float(first))):
        raise OptionError(field, arguments, "two numbers, the lower first")
    if kind == "log_uniform" and first <= 0:
        raise OptionError(field, arguments, "two numbers above zero")
    if kind == "integers" and max(map(abs, arguments)) >= 2**62:
        raise OptionError(field, arguments, "whole numbers below 2^62")


def _draw(path: str, distribution: Mapping[str, list[Any]], seed: int, number: int) -> Any:
    ((kind, arguments),) = distribution.items()
    rng = np.random.default_rng(np.random.SeedSequence([seed, number, zlib.crc32(path.encode())]))
    if kind == "choice":
        return arguments[int(rng.integers(len(arguments)))]
    first, second = arguments
    if kind == "integers":
        return int(rng.integers(first, second, endpoint=True))
    if kind == "normal":
        return float(rng.normal(first, second))
    if kind == "uniform":
        return float(rng.uniform(first, second))
    return min(max(math.exp(rng.uniform(math.log(first), math.log(second))), first), second)


def settings_of(fixed: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of one cell: the fixed ones, overridden by whole settings, then by single values inside.

    A value inside another one overrides it in whatever order they are given.
    """
    settings = dict(fixed)
    settings |= {path: value for path, value in values.items() if path in SETTINGS}
    for path, value in sorted(values.items(), key=lambda item: item[0].count(".")):
        head, _, rest = path.partition(".")
        if path in SETTINGS:
            continue
        if head == "gains":
            name, _, gain = rest.rpartition(".")
            settings["gains"] = {**settings["gains"], name: {**settings["gains"].get(name, {}), gain: value}}
        elif head == "env_kwargs":
            settings["env_kwargs"] = {**settings["env_kwargs"], rest: value}
        else:
            settings["disturbances"] = _disturbed(settings, path, rest, value)
    return settings


def _disturbed(settings: Mapping[str, Any], path: str, inside: str, value: Any) -> dict[str, Any]:
    given = settings["disturbances"]
    if given is None:
        if settings["scenario"] is None:
            todo = "give one, or disturbances: {} for no others"
            raise OptionError("path", path, todo, "needs a scenario whose disturbances it changes")
        given = find_scenario(settings["scenario"]).disturbances
    kind, _, parameter = inside.partition(".")
    if kind not in DISTURBANCES:
        raise UnknownNameError("disturbance", kind, suggest_names(kind, DISTURBANCES))
    if not parameter:
        return {**given, kind: value}
    parameter, _, component = parameter.partition(".")
    names = [known.name for known in DISTURBANCES[kind].parameters]
    if parameter not in names:
        raise UnknownNameError(f"parameter of {kind}", parameter, suggest_names(parameter, names))
    if component:
        value = _with_component(_vector(settings, given, kind, parameter), path, component, value)
    return placed(given, kind, parameter, value)


def _vector(settings: Mapping[str, Any], given: Mapping[str, Any], kind: str, name: str) -> Any:
    """Find what a parameter is before one of its components is set."""
    env_id = settings["env"] or find_scenario(settings["scenario"]).env_id
    known = DISTURBANCES[kind]
    (parameter,) = (one for one in known.parameters if one.name == name)
    default = known.default_of(parameter, robot_of(env_id))
    return default if known.multiple else parameters_of(kind, given.get(kind)).get(name, default)


def _with_component(vector: Any, path: str, component: str, value: Any) -> list[Any]:
    places = [str(i) for i in range(len(vector))] if isinstance(vector, (list, tuple)) else []
    if component not in places:
        raise UnknownNameError(
            f"component in {path}", component, suggest_names(component, places) or "none: it is one value"
        )
    return [value if place == component else one for place, one in zip(places, vector, strict=True)]


def point_of(settings: Mapping[str, Any], vectorized: bool, names: set[Any]) -> SweepCell:
    """Make the cell of some settings; `names` are the controllers of the whole study, whose gains may be given."""
    known, controller = registered_controllers(), settings["controller"]
    if controller not in known:
        raise UnknownNameError("controller", controller, suggest_names(controller, known))
    for name in settings["gains"]:
        if name not in names:
            raise UnknownNameError("gains", name, suggest_names(name, [str(one) for one in names if one is not None]))
    given = (settings["env"], settings["scenario"], settings["env_kwargs"], settings["disturbances"])
    (cell,) = cells_of(*given, vectorized)
    gains, seed, spec = settings["gains"].get(controller, {}), settings["seed"], known[controller]
    means = cell._replace(kwargs=canonical.arguments(cell.kwargs, cell.env_id, vectorized))
    decides = [
        means.name,
        means.env_id,
        means.kwargs,
        means.phases,
        controller,
        identity_of(spec).value,
        canonical.numbers(gains),
        seed,
        "batch" if vectorized else "single",
    ]
    digest = hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()
    return SweepCell(cell, controller, spec, gains, seed, digest[:16])


def check_path(path: str) -> None:
    """Refuse what is no path to a setting."""
    head, _, rest = path.partition(".")
    depth = {"gains": 2, "env_kwargs": 1, "disturbances": 1}.get(head, 0)
    if path not in SETTINGS and not (depth and rest.count(".") >= depth - 1 and all(path.split("."))):
        raise UnknownNameError("path", path, suggest_names(path, [*SETTINGS, *INSIDE]))


def _check_at(path: str, value: Any) -> None:
    """Check the value for a path; values inside a setting are checked by their owners."""
    if path in SETTINGS:
        check_setting(path, value)


def check_setting(name: str, value: Any) -> None:
    """Refuse a whole setting of the wrong type."""
    if name in ("env", "scenario", "controller"):
        good, allowed = value is None or isinstance(value, str), "a name"
    elif name == "seed":
        good, allowed = _is_whole(value) and value >= 0, "a whole number >= 0"
    elif name == "gains":
        good = isinstance(value, Mapping) and all(isinstance(gains, Mapping) for gains in value.values())
        allowed = "a mapping of controllers to mappings of gains"
    else:
        good = isinstance(value, Mapping) or (name == "disturbances" and value is None)
        allowed = "a mapping"
    if not good:
        raise OptionError(name, value, allowed)


def check_plain(field: str, value: Any, depth: int = 0) -> None:
    """Check that JSON can store a value, so that nothing else ever gets into an environment or a file."""
    if depth > DEEPEST:
        raise OptionError(field, "...", f"at most {DEEPEST} levels")
    if isinstance(value, Mapping):
        for key, item in value.items():
            if not isinstance(key, str):
                raise OptionError(f"key of {field}", key, "text")
            check_plain(f"{field}: {key}", item, depth + 1)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_plain(f"{field}[{i}]", item, depth + 1)
    elif not (value is None or isinstance(value, (str, bool)) or is_number(value)):
        raise OptionError(field, value, "finite numbers, text, true, false, null, lists and mappings")


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _plain(value: Any) -> Any:
    """Convert a value for a column: numbers to float64, lists and mappings to JSON."""
    if isinstance(value, (list, dict)):
        return json.dumps(canonical.numbers(value), sort_keys=True)
    return value
