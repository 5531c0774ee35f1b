"""Pages that have their source in the code, or elsewhere in the repository."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator

from artde_gym.evaluation.environments import ours, robot_of
from artde_gym.registration import registered_controllers
from artde_gym.scenarios import SCENARIOS
from controllers.drive import DRIVES
from controllers.law_table import LAWS
from controllers.presets import all_presets
from documentation.replays import OF_ENVIRONMENTS

ROOT = Path(__file__).parents[2]
SLUNG = '{"mass": 0.3, "cable": 0.5}'
"""The payload of an example in an environment whose payload hangs on a cable."""
RAISES = re.compile(r"^Raises:\n((?:    .*\n?)+)", re.MULTILINE)
EXAMPLE = """\
```python
import gymnasium as gym
import artde_gym
import controllers

env = gym.make("{env_id}", duration=2.0, disturbances={{"payload": {payload}}})
policy = controllers.make("artde", env)
observation, info = env.reset(seed=0)
action, state = policy.predict(observation)
observation, reward, terminated, truncated, info = env.step(action)
print(info["reward_alive"], info["disturbance.payload.mass"])
```
"""


def generated() -> dict[str, str]:
    """Path in docs/ -> Markdown."""
    pages = {f"environments/{env_id}.md": environment(env_id) for env_id in ours()}
    pages |= {
        f"policies/{card.parent.name}.md": _moved(card.read_text(encoding="utf-8"), r"\.\./", "") for card in cards()
    }
    pages |= laws()
    pages["contributing.md"] = _linked_to_site((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    pages["changelog.md"] = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return pages


def cards() -> list[Path]:
    """Return the model cards of the shipped policies."""
    return sorted((ROOT / "baselines/policies").glob("*/README.md"))


def laws() -> dict[str, str]:
    """Return a page of the docstrings and the code for each law that no page shows."""
    shown = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs/laws").glob("*.md"))
    pages: dict[str, str] = {}
    for name, spec in LAWS.items():
        module = spec.law.step.__module__
        path = f"{module.replace('.', '/')}.py"
        if module.startswith("controllers.laws.") and f"<!-- source: {path} -->" not in shown:
            page = f"# {name}\n\n{spec.text}\n\n::: {module}\n\n## Code\n\n<!-- source: {path} -->\n"
            pages[f"laws/{module.rsplit('.', 1)[1]}.md"] = page
    return pages


def environment(env_id: str) -> str:
    """Return an environment's page: its docstring, then its entries in the registries."""
    spec, robot = gym.spec(env_id), robot_of(env_id)
    page = _page(load_env_creator(str(spec.entry_point)))
    shown = [f"<!-- replay: {OF_ENVIRONMENTS[env_id]} -->"] if env_id in OF_ENVIRONMENTS else []
    parts = [
        f"# {env_id}",
        *shown,
        page,
        "## Example",
        EXAMPLE.format(env_id=env_id, payload=SLUNG if "Sling" in env_id else 0.3),
    ]
    scenarios = [
        f"| {entry.name} | {entry.text} | `{json.dumps(dict(entry.kwargs))}` |"
        for entry in SCENARIOS.values()
        if entry.env_id == env_id
    ]
    if scenarios:
        parts += ["## Scenarios", "\n".join(["| scenario | what it is | arguments |", "|---|---|---|", *scenarios])]
        parts += ["`artde-gym list scenarios` shows the disturbances of each, with what varies from seed to seed."]
    parts += [
        "## Controllers",
        "Gains of the robot's presets. A controller's first preset is its default.",
        _presets(robot),
    ]
    if spec.vector_entry_point:
        own = [part for part in _sections(_page(load_env_creator(str(spec.vector_entry_point)))) if part not in page]
        parts += ["## The vector environment", *(part.replace("## ", "### ", 1) for part in own)]
    return "\n\n".join(parts) + "\n"


def _page(documented: Any) -> str:
    text = inspect.cleandoc(str(documented.__doc__))
    text = RAISES.sub(
        lambda found: "## Errors\n\n" + re.sub(r"^ +(\w+):", r"- `\1`:", found[1], flags=re.MULTILINE), text
    )
    return re.sub(r"\bdocs/(\w+)\.md\b", r"[\1](../\1.md)", text)


def _sections(page: str) -> list[str]:
    """Split a text into the part before the first heading and each section with its heading."""
    return [part.strip() for part in re.split(r"^(?=## )", page, flags=re.MULTILINE)]


def _presets(robot: str) -> str:
    texts = {name: spec.text for name, spec in registered_controllers().items()}  # of their default presets
    rows = ["| controller | what it is | preset | source of its gains |", "|---|---|---|---|"]
    rows += [
        f"| `{law}` | {texts.pop(law, '')} | `{preset}` | {entry.source} |"
        for (law, preset), entry in all_presets(DRIVES[robot]).items()
    ]
    return "\n".join(rows)


def _linked_to_site(text: str) -> str:
    """Turn links into docs/ into links of the site, and links to other files into their names."""
    return re.sub(r"\[([^\]]+)\]\((?!docs/|https?:)[^)]+\)", r"`\1`", text).replace("](docs/", "](")


def _moved(text: str, before: str, after: str) -> str:
    """Links to model cards in a folder, turned into links to their pages."""
    return re.sub(rf"\]\({before}([\w-]+)/README\.md", rf"]({after}\1.md", text)
