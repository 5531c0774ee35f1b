"""`artde-gym list`: what there is."""

from __future__ import annotations

import json

import gymnasium as gym
from rich.console import Console
from rich.table import Table

from artde_gym.evaluation import SCENARIOS
from artde_gym.evaluation.environments import ours, robot_of
from artde_gym.evaluation.frontier_standard import STANDARDS
from artde_gym.registration import registered_controllers


def list_everything() -> None:
    """Show environments, scenarios, controllers and what frontiers vary."""
    console = Console()
    environments = Table("environment", "robot", "backends", title="Environments", title_justify="left")
    for name in ours():
        backends = "single, batch" if gym.spec(name).vector_entry_point else "single"
        environments.add_row(name, robot_of(name), backends)
    scenarios = Table("scenario", "environment", "arguments", "what it is", title="Scenarios", title_justify="left")
    for entry in SCENARIOS.values():
        scenarios.add_row(entry.name, entry.env_id, json.dumps(dict(entry.kwargs)), entry.text)
    known = Table("controller", "what it is", title="Controllers", title_justify="left")
    for name, spec in registered_controllers().items():
        known.add_row(name, spec.text)
    varied = Table("robot", "varied", "from", "to", "step", "harder", title="Frontiers", title_justify="left")
    for robot, standard in STANDARDS.items():
        for path, (low, high, step, harder) in standard.ranges.items():
            varied.add_row(robot, path, f"{low:g}", f"{high:g}", f"{step:g}", harder)
    for table in (environments, scenarios, known, varied):
        console.print(table)
