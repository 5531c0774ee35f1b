"""Start-up: which packages a process has imported before it does anything, and names that are imported when needed."""

from __future__ import annotations

import functools
import json
import subprocess
import sys

import pytest

FLOOR = """
import sys, gymnasium, rich.console, rich.progress, typer
app = typer.Typer(add_completion=False, rich_markup_mode=None)

@app.command()
def job(number: int | None = None) -> None: pass
"""
OWN = {"artde_gym", "baselines", "controllers"}
PACKAGES = "import sys, json; names = {name.partition('.')[0] for name in sys.modules} - sys.stdlib_module_names\n"
PACKAGES += "print(json.dumps(sorted(name for name in names if not name.startswith('_'))), file=sys.stderr)"


@functools.cache
def packages(code: str) -> frozenset[str]:
    """Return the packages that a new process imports while it runs some code, without the standard library."""
    found = subprocess.run([sys.executable, "-c", f"{code}\n{PACKAGES}"], capture_output=True, text=True, check=True)
    return frozenset(json.loads(found.stderr.splitlines()[-1]))


def run(setup: str, arguments: list[str]) -> str:
    return f"{setup}\nsys.argv = ['artde-gym', *{arguments}]\ntry: app()\nexcept SystemExit: pass"


@pytest.mark.parametrize(
    "arguments", [["--version"], ["--help"], ["frontier", "--help"], ["design", "--help"], ["evaluate", "--nope"]]
)
def test_help_and_errors_import_nothing_but_the_command_line_and_gymnasium(arguments: list[str]) -> None:
    floor = packages(run(FLOOR, ["--number", "1"]))
    assert packages(run("import sys\nfrom artde_gym.cli import app", arguments)) - floor <= OWN


@pytest.mark.parametrize("package", ["evaluation", "evaluation.workers", "report", "studies"])
def test_packages_import_what_is_heavy_when_it_is_asked_for(package: str) -> None:
    floor = packages(FLOOR)
    assert packages(f"import artde_gym.{package}") - floor <= OWN


@pytest.mark.parametrize(
    ("package", "submodules"),
    [
        ("artde_gym.evaluation", ["evaluate", "result", "registered"]),
        ("artde_gym.report", ["report"]),
        ("artde_gym.studies", ["frontier", "multiverse", "reproduce", "sweep", "tune"]),
    ],
)
@pytest.mark.parametrize("first", [False, True])
def test_a_submodule_never_hides_the_function_of_the_same_name(
    package: str, submodules: list[str], first: bool
) -> None:
    code = "\n".join(f"import {package}.{name}" for name in submodules) if first else ""
    code += f"""
import sys, types, {package} as package
for name in package.__all__:
    assert callable(getattr(package, name)) and not isinstance(getattr(package, name), types.ModuleType), name
    assert name in dir(package)
    exec(f"from {package} import {{name}} as found")
    assert found is getattr(package, name)
import {package}.{submodules[0]}
assert all(callable(getattr(package, name)) for name in package.__all__)
try: package.nothing
except AttributeError as error: assert "{package}" in str(error)
else: raise SystemExit("a name that does not exist")
"""
    subprocess.run([sys.executable, "-c", code], check=True)
