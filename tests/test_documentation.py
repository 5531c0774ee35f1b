"""Documentation that is true: its code runs, its commands parse, its notebooks execute, its site builds and holds."""

from __future__ import annotations

import contextlib
import dataclasses
import html.parser
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag

import gymnasium as gym
import nbformat
import numpy as np
import pytest
import typer
import typer.main
from documentation.blocks import Block, blocks, commands, mentions, script
from documentation.figures import FIGURES
from documentation.notebooks import NOTEBOOKS, notebook
from documentation.pages import ROOT, generated
from documentation.pages import laws as generated_laws
from documentation.plant import ARM, modeled, simulate
from nbclient import NotebookClient

from artde_gym.cli import app
from artde_gym.evaluation.environments import ours
from artde_gym.scenarios import SCENARIOS
from controllers.law_spec import LawSpec
from controllers.law_table import LAWS
from controllers.laws.computed_torque import ComputedTorqueGains
from controllers.laws.tde import TdeGains
from controllers.laws.tracking import Law, desired_acceleration

DOCS = ROOT / "docs"
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {
    **{str(page.relative_to(DOCS)): page.read_text(encoding="utf-8") for page in sorted(DOCS.rglob("*.md"))},
    **generated(),
}
COMMANDS = {" ".join(words): words for text in (README, *PAGES.values()) for words in commands(text)}
MENTIONS = {" ".join(words): words for text in (README, *PAGES.values()) for words in mentions(text)}


def scripts() -> dict[str, str]:
    """All blocks of a page as one script, in their order; those of the README and of `use.md` one by one.

    Pages that are notebooks too run as such. The examples of the environments, of one template, are one script.
    """
    apart = {"README": README, "use.md": PAGES["use.md"]}
    found = {
        f"{name}-{number}": script([part]) for name, text in apart.items() for number, part in enumerate(blocks(text))
    }
    pages = {name: script(blocks(text)) for name, text in PAGES.items() if name not in {*NOTEBOOKS, *apart}}
    made = [name for name in pages if name.startswith("environments/")]
    found["environments"] = "\n".join(pages.pop(name) for name in made)
    return {name: text for name, text in (found | pages).items() if text}


SCRIPTS = scripts()


def environment() -> dict[str, str]:
    """Variables under which `artde-gym` is that of this interpreter."""
    return {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def run(text: str, folder: Path) -> None:
    """A script in a folder of its own; warnings are errors."""
    file = folder / "example.py"
    file.write_text(text, encoding="utf-8")
    outcome = subprocess.run(
        [sys.executable, "-W", "error", str(file)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=folder,
        env={**environment(), "MPLBACKEND": "agg"},
    )
    assert outcome.returncode == 0, f"{outcome.stdout[-2000:]}\n{outcome.stderr[-4000:]}"


def test_a_page_is_taken_apart_and_put_together():
    page = (
        "Words.\n\n```python\nx = 1\n```\n\n<!-- not run: slow -->\n```sh\nartde-gym list\n```\n"
        "`artde-gym tune --trials\n3` and\n\n    artde-gym report a \\\n        --x\n\n```text\nout\n```\n"
    )
    parts = blocks(page)
    assert [part.language for part in parts] == ["markdown", "python", "markdown", "sh", "markdown", "text", "markdown"]
    assert parts[3] == Block("sh", "artde-gym list\n", "slow")
    assert script(parts) == "x = 1\n"
    assert commands(page) == [["list"]]
    assert mentions(page) == [["report", "a", "--x"], ["tune", "--trials", "3"]]


def test_a_failing_command_fails_its_script(tmp_path):
    with pytest.raises(AssertionError):
        run(script([Block("sh", "false | cat\n")]), tmp_path)


def test_there_is_enough_to_run():
    assert len([name for name in SCRIPTS if name.startswith("README")]) >= 2
    assert len([name for name in SCRIPTS if name.startswith("use.md")]) >= 3
    assert len([name for name in SCRIPTS if name.startswith("tutorials")]) >= 3
    assert len(COMMANDS) >= 5
    assert len(MENTIONS) >= 10


def needing(name: str) -> Any:
    """A script by name, marked if it needs PyTorch; what a newcomer tries first runs on each Python."""
    torch = any(package in SCRIPTS[name] for package in ("stable_baselines3", "import torch"))
    first = name.startswith("README") or name in ("index.md", "environments")
    return pytest.param(name, marks=[pytest.mark.torch] * torch + [pytest.mark.once] * (not first))


@pytest.mark.parametrize("name", [needing(name) for name in SCRIPTS])
def test_code_runs(name, tmp_path):
    run(SCRIPTS[name], tmp_path)


WHOLE = typer.main.get_group(app)


def parse(words: list[str]) -> None:
    """By the real command line, up to where it would begin to work."""
    context = WHOLE.make_context("artde-gym", list(words), resilient_parsing=True)
    name, command, rest = WHOLE.resolve_command(context, list(words))
    assert command is not None
    command.make_context(name, rest)


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_command_parses(words):
    parse(words)


@pytest.mark.once
@pytest.mark.parametrize("words", MENTIONS.values(), ids=MENTIONS)
def test_mentioned_command_parses_as_far_as_it_goes(words):
    with contextlib.suppress(typer.BadParameter):  # of which a missing one is a kind; an unknown option is none
        parse(words)


@pytest.mark.once
@pytest.mark.parametrize("page", NOTEBOOKS)
def test_notebook_executes(page, tmp_path):
    made = nbformat.reads(notebook(DOCS / page), as_version=4)
    nbformat.validate(made)
    where = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(made, timeout=300, kernel_name="python3", resources=where).execute(env=environment())
    outputs = [output for cell in made.cells if cell.cell_type == "code" for output in cell.outputs]
    assert len(outputs) >= 3
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == PAGES[page].count("plt.subplots(")
    assert [output for output in outputs if output.output_type == "error"] == []


class Links(html.parser.HTMLParser):
    """What a page refers to, and the anchors that it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    outcome = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=quiet)
    assert outcome.returncode == 0, outcome.stderr[-4000:]
    return folder


@pytest.mark.once
def test_every_link_of_the_site_leads_somewhere(site):
    pages = {path: Links(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    del pages[site / "404.html"]  # of a server, at its root
    assert len(pages) > 20
    for path, page in pages.items():
        for target in page.targets:
            if target.startswith(("http:", "https:", "data:", "mailto:", "javascript:")):
                continue
            place, anchor = urldefrag(target)
            there = (path.parent / unquote(place)).resolve() if place else path
            assert there.exists(), f"{path.relative_to(site)}: {target}"
            if anchor and there in pages and not anchor.startswith("__"):
                assert unquote(anchor) in pages[there].anchors, f"{path.relative_to(site)}: {target}"


@pytest.mark.browser
@pytest.mark.parametrize("width", [375, 1280])
@pytest.mark.parametrize("page", ["index", "laws/artde", "environments/BipedWalk-Payload-v0", "tutorials/first-run"])
def test_page_needs_no_network_and_fits(browser, site, page, width):
    browser.errors.clear()
    browser.open(site / f"{page}.html", width)
    assert browser.errors == []
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run("[...document.images].every((image) => image.complete && image.naturalWidth > 0)")


@pytest.mark.browser
def test_formulas_and_charts_are_drawn(browser, site):
    browser.open(site / "laws/artde.html")
    browser.run("document.fonts.ready.then(() => true)")
    assert browser.run("document.fonts.check('16px mathematics')")
    fraction = "document.querySelector('math[display=block] mfrac').getBoundingClientRect()"
    assert browser.run(f"{fraction}.height") > 25
    left = "document.querySelector('{}').getBoundingClientRect().left"
    assert browser.run(f"{left.format('msqrt > *')} - {left.format('msqrt')}") > 5  # the sign of the root is there
    assert "\\(" not in browser.run("document.querySelector('article').innerText")
    charts = "[...document.querySelectorAll('.chart svg')].map((chart) => chart.getBoundingClientRect().width)"
    assert min(browser.run(charts)) > 200


@pytest.mark.browser
def test_search_finds_a_word_without_a_server(browser, site):
    browser.errors.clear()
    browser.open(site / "index.html")
    browser.run("document.querySelector('[data-md-component=search-query]').focus()")
    for letter in "ratchet":
        browser.call("Input.dispatchKeyEvent", type="char", text=letter)
        browser.call("Input.dispatchKeyEvent", type="keyUp", key=letter)
    hits = "[...document.querySelectorAll('.md-search-result__link')].map((link) => link.href.split('/').pop())"
    wait = f"new Promise((done) => {{ const look = () => {hits}.length ? done() : setTimeout(look, 50); look(); }})"
    browser.run(wait)
    assert {name.split(".")[0] for name in browser.run(hits)} >= {"artde", "deviations"}
    assert browser.errors == []


@pytest.mark.parametrize("env_id", ours())
def test_page_of_an_environment_has_its_whole_layout(env_id):
    page = PAGES[f"environments/{env_id}.md"]
    env: Any = gym.make(env_id, duration=0.1).unwrapped
    for field in (*env.observation_layout.fields, *env.action_layout.fields):
        assert f"`{field.name}`" in page
    env.close()
    for scenario in SCENARIOS.values():
        assert (f"| {scenario.name} |" in page) == (scenario.env_id == env_id)
    assert not re.search(r"{(default|observation|shared)}", page)


def test_an_option_that_is_none_is_found():
    with pytest.raises(Exception, match=r"No such option\W+--episods"):  # its class differs between releases of Typer
        parse(["evaluate", "--episods", "3"])


def test_every_law_has_a_page_with_its_code_and_a_figure_or_a_generated_one():
    asked = {name: re.findall(r"<!-- (figure|source): (\S+) -->", text) for name, text in PAGES.items()}
    laws = {
        path: text
        for path, text in asked.items()
        if path.startswith("laws/") and path not in ("laws/index.md", *generated_laws())
    }
    assert all({kind for kind, _ in found} == {"figure", "source"} for found in laws.values())
    figures = {name for found in laws.values() for kind, name in found if kind == "figure"}
    sources = {name for found in laws.values() for kind, name in found if kind == "source"}
    assert figures == set(FIGURES) - {"rooms"}  # of the architecture page
    functions = {entry.law.step.__module__ for entry in LAWS.values() if "law_table" not in entry.law.step.__module__}
    sources |= {source for page in generated_laws().values() for source in re.findall(r"<!-- source: (\S+) -->", page)}
    assert {f"{module.replace('.', '/')}.py" for module in functions} <= sources


def test_a_law_without_a_page_gets_one_of_its_docstrings_and_code(monkeypatch):
    step: Any = desired_acceleration
    spec = LawSpec(Law(step, step), TdeGains, "a law of the test", like="tde")
    monkeypatch.setitem(LAWS, "own", spec)
    page = generated_laws()["laws/tracking.md"]
    for part in ("# own", spec.text, "::: controllers.laws.tracking", "<!-- source: controllers/laws/tracking.py -->"):
        assert part in page


@pytest.mark.once
def test_an_arm_under_its_exact_model_obeys_the_designed_error():
    """Computed torque leaves no error but that of a torque held for a sampling period: the plant is what it says."""
    gains = ComputedTorqueGains(25.0, 10.0)
    arm = dataclasses.replace(ARM, load=0.0, load_weight=0.0, push=0.0)
    coarse, fine = (np.abs(simulate(modeled(arm), gains, arm, period).e).max() for period in (0.004, 0.001))
    assert fine < 5e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


SHORTEST = 61  # characters of a description in a terminal of 80
PATH = re.compile(r"`((?:[\w.-]+/)+[\w.-]+\.(?:py|md|ya?ml|toml|txt|css|js|mjs))`")
MADE = ("runs/", "site/", "gallery/")  # by commands that a page shows


@pytest.mark.once
@pytest.mark.parametrize("name", [*PAGES, "README"])
def test_files_that_a_page_names_exist(name):
    text = README if name == "README" else PAGES[name]
    named = {path for path in PATH.findall(text) if not path.startswith(MADE)}
    assert not [path for path in named if not (ROOT / path).exists() and not (ROOT / "docs" / path).exists()]


@pytest.mark.parametrize("name", WHOLE.commands)
def test_the_list_of_commands_shows_whole_sentences(name):
    assert not WHOLE.commands[name].get_short_help_str(SHORTEST).endswith("...")


@pytest.mark.once
@pytest.mark.parametrize("name", ["README", "use.md", "index.md", "tutorials/first-run.md", "tutorials/multiverse.md"])
def test_a_walk_of_a_first_example_takes_steps(name):
    text = README if name == "README" else PAGES[name]
    walks = [part for part in text.split("\n\n") if re.search(r"Biped|S[12]\b", part) and "duration" in part]
    times = [float(time) for part in walks for time in re.findall(r"duration\W+(\d+\.?\d*)", part)]
    walked = [time for time in times if time > 1.0]  # the others are pushes
    assert walked
    assert min(walked) >= 5.0  # s: it stands for two at either end
