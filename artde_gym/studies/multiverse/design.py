"""The design of a multiverse: plausible worlds, the controllers that meet all of them, and the claims to be judged.

    env: BipedWalk-Payload-v0          # fixed: env, scenario, disturbances, env_kwargs, gains, as for a sweep
    env_kwargs: {duration: 15.0}
    set: {disturbances.grf_pulse.shape: double_hump}   # single values that all worlds have
    controllers: [tde, atde, artde]    # each one meets every world
    matched: artde                     # then TDE at this law's mean gain of the same world, as "matched"
    worlds: 400
    seed: 0
    vectorized: true
    factors:
      ground force:
        path: disturbances.grf_pulse.share             # or a list of paths, which all get the value
        quantiles: [0.0, 0.45, 0.6]    # or uniform, log_uniform: [low, high], or choice: [...]
        unit: weight
        source: where this range comes from
    claims:                            # without, those of the robot
      - survives: [artde, tde]
    figure: [ground force, control period]             # survival against the first, by the second

A path is that of a sweep (`artde_gym.studies.sweep.design`). A world is known by its number and the seed: more worlds,
or other controllers, leave it as it was. Each has one episode, with a seed of its own that all controllers share.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from artde_gym.arguments import check_bool, check_integer
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation import canonical
from artde_gym.evaluation.environments import metrics_spec_of, robot_of
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.kit import ROBOTS
from artde_gym.registration import registered_controllers
from artde_gym.scenarios import scenario as find_scenario
from artde_gym.studies.multiverse.claims import WorldClaim, read_claims
from artde_gym.studies.multiverse.factor import Factor, check_world_path, sample
from artde_gym.studies.reproduce.reproduction import ABLATION
from artde_gym.studies.sweep.design import (
    SETTINGS,
    SweepCell,
    check_plain,
    check_setting,
    point_of,
    read,
    settings_of,
)

FIXED = ("env", "scenario", "disturbances", "env_kwargs", "gains")
KEYS = (*FIXED, "set", "controllers", "matched", "worlds", "seed", "vectorized", "factors", "claims", "figure")
MATCHED = "matched"
"""Label of the second pass: the ablation at the adaptive law's mean gain of the same world."""
MOST_WORLDS = 100_000


@dataclasses.dataclass(frozen=True)
class World:
    """One world: its number, the values of the factors, and the seed of `evaluate` whose first episode it is."""

    number: int
    factors: dict[str, Any]
    seed: int


@dataclasses.dataclass(frozen=True)
class Design:
    """A checked design; `text` is all of it as JSON.

    Attributes:
        fixed: settings that all worlds share.
        matched: the adaptive law whose mean gain the second pass takes; None for no second pass.
        figure: factors on the horizontal axis and of the lines of the survival curve.
    """

    fixed: dict[str, Any]
    controllers: tuple[str, ...]
    matched: str | None
    worlds: tuple[World, ...]
    vectorized: bool
    factors: tuple[Factor, ...]
    claims: tuple[WorldClaim, ...]
    figure: tuple[Factor, Factor | None]
    text: str

    @property
    def labels(self) -> tuple[str, ...]:
        """Names under which the controllers are listed, that of the second pass included."""
        return (*self.controllers, MATCHED) if self.matched else self.controllers

    @property
    def env_id(self) -> str:
        """The environment of all worlds."""
        return self.fixed["env"] or find_scenario(self.fixed["scenario"]).env_id

    @property
    def main(self) -> str:
        """Name of the metric that is the main error."""
        return f"rmse_{metrics_spec_of(self.env_id).errors[0].unit}"

    def points(self) -> dict[tuple[int, str], SweepCell]:
        """Return what runs in the first pass, by world and controller.

        Raises:
            UnknownNameError, OptionError: for a path or value that makes no cell.
        """
        return {(world.number, name): self._point(world, name) for world in self.worlds for name in self.controllers}

    def end_points(self) -> Iterator[tuple[str, list[SweepCell]]]:
        """Yield the first world with each factor at each end of its range: its name, and what each controller runs."""
        first = self.worlds[0]
        for factor in self.factors:
            for value in factor.ends:
                world = dataclasses.replace(first, factors={**first.factors, factor.name: value})
                points = [self._point(world, name) for name in self.controllers]
                yield f"world 0 with factor {factor.name!r} at {value!r}", points

    def matched_point(self, number: int, gains: Mapping[str, float]) -> SweepCell:
        """Return the second pass in one world."""
        point = self._point(self.worlds[number], ABLATION, gains)
        return dataclasses.replace(point, controller=MATCHED, id=f"{point.id}-{MATCHED}")

    def _point(self, world: World, name: str, gains: Mapping[str, float] | None = None) -> SweepCell:
        paths = {path: world.factors[factor.name] for factor in self.factors for path in factor.paths}
        settings = settings_of({**self.fixed, "controller": name, "seed": world.seed}, paths)
        if gains is not None:
            settings["gains"] = {name: {**settings["gains"].get(name, {}), **gains}}
        return point_of(settings, self.vectorized, {*self.controllers, ABLATION})


def load(given: str | Path | Mapping[str, Any], *, engine: str | None = None, **replaced: Any) -> Design:
    """Read a design: the standard one of a robot, a file, or plain values.

    Args:
        given: what to read.
        engine: of the environments, in place of its own.
        replaced: keys in place of its own; None leaves them.

    Raises:
        OptionError, UnknownNameError: for anything that is wrong with it, in one line.
    """
    content = dict(given) if isinstance(given, Mapping) else read(_file(given))
    if engine is not None:
        content["env_kwargs"] = {**content.get("env_kwargs", {}), "engine": engine}
    return design({**content, **{key: value for key, value in replaced.items() if value is not None}})


def standard_designs() -> dict[str, Path]:
    """Return the files of the robots' standard designs by robot."""
    return {name: kit.multiverse for name, kit in ROBOTS.items() if kit.multiverse is not None}


def design(given: Mapping[str, Any]) -> Design:
    """Check the content of a design file.

    Raises:
        OptionError, UnknownNameError: for an unknown key, a wrong type, an unknown name, or a factor without a source.
    """
    check_plain("design", given)
    for key in given:
        if key not in KEYS:
            raise OptionError("key of the design", key, suggest_names(key, KEYS))
    vectorized = check_bool("vectorized", given.get("vectorized", False))
    count = check_integer("worlds", given.get("worlds", 100), 1, MOST_WORLDS)
    seed = check_integer("seed", given.get("seed", 0), 0)
    controllers, matched = _controllers(given)
    factors = _factors(given.get("factors"))
    fixed = _fixed(given)
    for path in given.get("set", {}):
        if any(path == own or path.startswith(f"{own}.") for factor in factors for own in factor.paths):
            raise OptionError("path", path, "leave one of them", "is in 'set', and of a factor")
    labels = (*controllers, MATCHED) if matched else controllers
    claims = read_claims(given.get("claims"), _robot(fixed), labels)
    values = sample(factors, count, seed)
    worlds = tuple(World(i, values[i], episode_seed(seed, i)) for i in range(count))
    figure = _figure(given.get("figure"), factors)
    return Design(fixed, controllers, matched, worlds, vectorized, factors, claims, figure, json.dumps(given))


def _file(given: str | Path) -> Path:
    standard = standard_designs()
    if str(given) in standard:
        return standard[str(given)]
    if not Path(given).exists():
        raise OptionError(
            "design", str(given), f"a file, or a robot's standard design: {suggest_names(given, standard)}"
        )
    return Path(given)


def _fixed(given: Mapping[str, Any]) -> dict[str, Any]:
    fixed = {**SETTINGS, **{name: given[name] for name in FIXED if name in given}}
    for name, value in fixed.items():
        check_setting(name, value)
    if fixed["env"] is None and fixed["scenario"] is None:
        raise OptionError("design", list(given), "add one of them", "has neither env nor scenario")
    single = given.get("set", {})
    if not isinstance(single, Mapping):
        raise OptionError("set", single, "a mapping of paths to values")
    for path in single:
        check_world_path("path in set", path)
    return settings_of(fixed, single)


def _robot(fixed: Mapping[str, Any]) -> str:
    return robot_of(fixed["env"] or find_scenario(fixed["scenario"]).env_id)


def _controllers(given: Mapping[str, Any]) -> tuple[tuple[str, ...], str | None]:
    names, matched = given.get("controllers"), given.get("matched")
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise OptionError("controllers", names, "a list of registered names")
    known = registered_controllers()
    for name in names:
        if name not in known:
            raise UnknownNameError("controller", name, suggest_names(name, known))
    if again := canonical.twice(names):
        raise OptionError("controller", again, "give each name once", "is given twice")
    if matched is not None and matched not in names:
        raise OptionError("matched", matched, f"one of the controllers: {suggest_names(matched, names)}")
    return tuple(names), matched


def _factors(given: Any) -> tuple[Factor, ...]:
    if not (isinstance(given, Mapping) and given):
        raise OptionError("factors", given, "a mapping of names to factors, at least one")
    factors = tuple(Factor.of(name, content) for name, content in given.items())
    if again := canonical.twice(path for factor in factors for path in factor.paths):
        raise OptionError("path", again, "leave all but one", "is set by two factors")
    return factors


def _figure(given: Any, factors: tuple[Factor, ...]) -> tuple[Factor, Factor | None]:
    known = {factor.name: factor for factor in factors}
    names = list(known)[:2] if given is None else given
    good = isinstance(names, list) and all(isinstance(name, str) and name in known for name in names)
    if not (good and 1 <= len(names) <= 2):
        raise OptionError("figure", given, f"one or two of the factors: {', '.join(known)}")
    if again := canonical.twice(names):
        raise OptionError("factor of the figure", again, "give each one once", "is given twice")
    return known[names[0]], known[names[1]] if len(names) > 1 else None
