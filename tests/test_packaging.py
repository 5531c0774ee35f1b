import importlib
import importlib.metadata
import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HERE = ("CPython", (3, 11), "Linux", "x86_64", "glibc")


@pytest.fixture(scope="module")
def backend():
    spec = importlib.util.spec_from_file_location("build_backend", ROOT / "scripts" / "build_backend.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("version", [(3, 10), (3, 11)])
def test_platforms_with_a_wheel_are_accepted(backend, version):
    assert backend.refusal(HERE[0], version, *HERE[2:]) is None


@pytest.mark.parametrize(
    ("platform", "words"),
    [
        (("CPython", (3, 12), *HERE[2:]), "CPython 3.12 on Linux x86_64."),
        (("CPython", (3, 9), *HERE[2:]), "CPython 3.9 on Linux x86_64."),
        (("PyPy", *HERE[1:]), "PyPy 3.11 on Linux x86_64."),
        (("CPython", (3, 11), "Darwin", "arm64", ""), "CPython 3.11 on Darwin arm64."),
        (("CPython", (3, 11), "Windows", "AMD64", ""), "CPython 3.11 on Windows AMD64."),
        (("CPython", (3, 11), "Linux", "aarch64", "glibc"), "CPython 3.11 on Linux aarch64."),
        (("CPython", (3, 11), "Linux", "x86_64", ""), "CPython 3.11 on Linux x86_64 without glibc."),
    ],
)
def test_other_platforms_get_the_reason_in_one_line(backend, platform, words):
    message = backend.refusal(*platform)
    assert words in message
    assert "where PyBullet 3.2.7 has wheels" in message
    assert "python3.11" in message
    assert "\n" not in message


def test_every_hook_refuses_before_it_builds(backend, monkeypatch):
    monkeypatch.setattr("platform.system", lambda: "Darwin")
    for hook in ("get_requires_for_build_wheel", "prepare_metadata_for_build_wheel", "build_wheel", "build_editable"):
        with pytest.raises(SystemExit, match="PyBullet"):
            getattr(backend, hook)


def test_installed_version_is_that_of_pyproject():
    version = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert version
    assert importlib.metadata.version("artde-gym") == version[1]
    assert f"\nversion: {version[1]}\n" in (ROOT / "CITATION.cff").read_text()


def test_pybullet_has_one_version_everywhere():
    for name in ("pyproject.toml", "constraints.txt"):
        assert "pybullet==3.2.7" in (ROOT / name).read_text()


@pytest.mark.parametrize("package", ["artde_gym", "baselines", "controllers"])
def test_packages_are_typed(package):
    file = importlib.import_module(package).__file__
    assert file
    assert (Path(file).parent / "py.typed").is_file()
