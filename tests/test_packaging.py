import importlib
import importlib.metadata
import re
import tomllib
from pathlib import Path

import pytest
import release_links
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PACKAGES = ["artde_gym", "baselines", "controllers"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_installed_version_is_that_of_pyproject():
    assert importlib.metadata.version("artde-gym") == PROJECT["version"]
    assert f"\nversion: {PROJECT['version']}\n" in (ROOT / "CITATION.cff").read_text()


def test_every_python_from_3_11_is_allowed():
    assert PROJECT["requires-python"] == ">=3.11"
    assert "Programming Language :: Python :: 3.14" in PROJECT["classifiers"]


def test_pybullet_has_one_version_everywhere():
    texts = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["bullet"]]
    wanted = {str(one.specifier) for one in map(Requirement, texts) if one.name == "pybullet"}
    assert wanted == {"==3.2.7"}
    assert "pybullet==3.2.7" in (ROOT / "constraints.txt").read_text()


def test_the_core_has_an_engine_for_every_platform():
    (mujoco,) = [one for one in map(Requirement, PROJECT["dependencies"]) if one.name == "mujoco"]
    assert mujoco.marker is None


def test_every_dependency_has_a_lower_bound_and_constraints_allow_it():
    """The bounds are tried by `make lowest`; here, the versions that the tests run with lie within them."""
    pinned = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        if (found := re.match(r"([\w.-]+)==([^ ;]+)", line)) is not None:
            pinned.setdefault(re.sub(r"[-_.]+", "-", found[1]).lower(), []).append(found[2])
    texts = [*PROJECT["dependencies"], *(text for extra in PROJECT["optional-dependencies"].values() for text in extra)]
    for one in map(Requirement, texts):
        if one.name == "artde-gym":
            continue
        assert any(part.operator in (">=", "==") for part in one.specifier), one
        for version in pinned[re.sub(r"[-_.]+", "-", one.name).lower()]:
            assert one.specifier.contains(version), (one, version)


def test_licenses_of_everything_that_is_bundled_are_the_distributions_own():
    bundled = [path for package in PACKAGES for path in (ROOT / package).rglob("*") if "license" in path.name.lower()]
    found = {path.relative_to(ROOT).as_posix() for path in bundled}
    assert found
    assert {"LICENSE", *found} == set(PROJECT["license-files"])
    assert all((ROOT / name).is_file() for name in PROJECT["license-files"])


def test_the_sdist_has_what_its_documentation_and_tests_read():
    manifest = (ROOT / "MANIFEST.in").read_text(encoding="utf-8").split()
    own = {"README.md", "pyproject.toml"}  # setuptools adds them
    needed = {path.name for kind in ("*.md", "*.toml", "*.cff", "mkdocs.yml") for path in ROOT.glob(kind)}
    assert needed - own <= set(manifest)


def test_extras_in_workflows_are_quoted_since_a_comma_splits_arguments_of_powershell():
    for workflow in (ROOT / ".github/workflows").glob("*.yml"):  # an sdist has none
        given = re.findall(r"(\S?)\.\[\w+(?:,\w+)+\]", workflow.read_text(encoding="utf-8"))
        assert set(given) <= {"'", '"'}


def test_a_released_readme_leads_to_the_repository():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    base = "https://host.example/owner/repository"
    released = release_links.absolute(text, base, "v1.2.3")
    links = re.findall(r"(!?)\[[^\]]*\]\(([^)]+)\)", released)
    assert len(links) >= 10
    for picture, target in links:
        found = re.fullmatch(rf"{base}/(raw|tree|blob)/v1\.2\.3/(.+)", target)
        assert found is not None, target
        path = ROOT / found[2]
        assert found[1] == ("raw" if picture else "tree" if path.is_dir() else "blob")
        assert path.exists(), target
    assert release_links.absolute(released, base, "v1.2.3") == released
    project = release_links.with_urls((ROOT / "pyproject.toml").read_text(encoding="utf-8"), base, "v1.2.3")
    urls = tomllib.loads(project)["project"].pop("urls")
    assert urls["Repository"] == base
    assert {**PROJECT, "urls": urls} == tomllib.loads(project)["project"]


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_are_typed(package):
    file = importlib.import_module(package).__file__
    assert file
    assert (Path(file).parent / "py.typed").is_file()
