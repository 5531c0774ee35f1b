"""`artde-gym doctor`: what fails is found, said with a remedy, and ends nothing else; what is missing is no failure."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.doctor import CHECKS, checks, run_checks
from artde_gym.doctor.machine import extras, files, python
from artde_gym.errors import UnknownNameError
from controllers.stability_check import stability

LIGHT = ["python", "extras", "files", "batch", "determinism", "stability"]
"""Checks that take no more than a few seconds; what the others call has tests of its own."""


def doctor(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["doctor", *arguments], env={"COLUMNS": "80"})


def test_this_machine_is_well() -> None:
    outcome = doctor("--json", "--checks", ",".join(LIGHT))
    found = json.loads(outcome.output)
    assert found["counts"]["failed"] == 0, outcome.output
    assert outcome.exit_code == 0
    assert list(found["checks"]) == LIGHT
    lines = {line["what"]: line for one in found["checks"].values() for line in one}
    for what in ("Python", "numpy", "mujoco", "BipedPush-v0", "biped in mujoco", "quadrotors in batch", "disk"):
        assert lines[what]["status"] == "ok", lines[what]
    assert all(line["remedy"] for line in lines.values() if line["status"] != "ok")
    assert not any(line["remedy"] for line in lines.values() if line["status"] == "ok")


def test_no_check_ends_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """An exception, a crash, an exit and a hang: each is a line with a remedy, and exit code 1."""
    monkeypatch.setenv("PYTHONPATH", f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    for name in ("raises", "dies", "exits", "hangs"):
        monkeypatch.setitem(CHECKS, name, checks.Check(name, f"broken_checks:{name}"))
    monkeypatch.setitem(CHECKS, "gone", checks.Check("gone", "artde_gym.nowhere:nothing"))
    names = ["raises", "dies", "exits", "gone", "files"]
    found = {name: report.outcomes for name, report in run_checks(names)}
    with monkeypatch.context() as hurry:
        hurry.setattr(checks, "PATIENCE", 0.5)
        found |= {name: report.outcomes for name, report in run_checks(["hangs"])}
    for name, words in (("raises", "a broken package (broken_checks.py"), ("dies", "exit code -11"),
                        ("exits", "exit code 3"), ("hangs", "no answer"), ("gone", "ModuleNotFoundError")):  # fmt: skip
        (line,) = found[name]
        assert (line.status, words in line.found, bool(line.remedy)) == ("failed", True, True), line
    assert found["files"][0].status == "ok"
    outcome = doctor("--checks", "raises,files")
    assert outcome.exit_code == 1
    assert "FAILED" in outcome.output
    assert "results folder: runs/ is writable" in outcome.output
    assert max(map(len, outcome.output.splitlines())) <= 80
    with pytest.raises(UnknownNameError, match="did you mean 'files'"):
        list(run_checks(["fles"]))


def test_a_wrong_python_a_missing_package_and_an_old_one(monkeypatch: pytest.MonkeyPatch) -> None:
    from importlib import metadata

    real = metadata.version
    versions = {"pandas": "1.5.0", "ray": None, "torch": "1.0"}

    def version(name: str) -> str:
        if versions.get(name, "") is None:
            raise metadata.PackageNotFoundError(name)
        return versions.get(name) or real(name)

    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr("platform.python_version", lambda: "3.10.9")
    lines = {line.what: line for line in python()}
    assert lines["Python"].status == "failed"
    assert "3.11" in lines["Python"].remedy
    assert lines["pandas"].status == "failed"
    assert "1.5.0, not >=2.2.2" in lines["pandas"].found
    optional = {line.what: line for line in extras()}
    scale = optional["extra [scale]"]
    assert (scale.status, scale.remedy) == ("missing", "pip install 'artde-gym[scale]'")
    assert "ray not installed" in scale.found
    assert "torch 1.0, not >=2.6" in optional["extra [rl]"].found


def test_a_folder_that_cannot_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.NamedTemporaryFile", _refused)
    (line,) = files()
    assert (line.what, line.status) == ("results folder", "failed")
    assert "--out" in line.remedy


def _refused(**_: Any) -> Any:
    raise PermissionError(13, "Permission denied")


@pytest.mark.once
def test_validity_names_the_model_that_is_invalid_by_design() -> None:
    lines = {line.what: line for line in stability()}
    assert "outside" in lines["biped, actuators 'none'"].found
    low, high = map(float, lines["biped, actuators 'rotor', presets 'stiff' too"].found.split(" to "))
    assert 0 < low < high < 2
    assert lines["quadrotor, position"].found == "0.676 to 0.676"  # m_bar 1 kg of 1.48 kg
    assert {line.status for what, line in lines.items() if "tuned" not in what} == {"ok"}
