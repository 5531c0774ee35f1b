"""Prose that reads at first sight: docstrings begin as the house style says, and some words are not used."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from documentation.pages import ROOT

pytestmark = pytest.mark.once

PACKAGES = ("artde_gym", "controllers", "baselines", "scripts")
OPENINGS = re.compile(r"(What|Whether|Those|Where|How|Who|Which)\b(?![^.]*\?)")  # a question may open so
WORDS = re.compile(
    r"\b(nobody|likewise|as of(?! (CPython|MuJoCo|NumPy|\d))|the latter|the former|of ours|look on|anybody's|"
    r"begins? anew|learnt|\w*(factor|raster)is(e|ed|es|er|ing|ation))\b",  # British, unknown to codespell
    re.IGNORECASE,
)
MODULES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *sorted((ROOT / "docs").rglob("*.md"))]


def docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and the docstring of a module, its classes and functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
            yield getattr(node, "name", path.stem), text


def sentences(text: str) -> list[str]:
    """Return the sentences of prose, code in backquotes left as it is."""
    return [part.strip() for part in re.split(r"(?<=[.;:])\s+|\n\s*\n", text) if part.strip()]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_docstrings_begin_with_what_they_describe(path):
    found = [
        f"{name}: {sentence}"
        for name, text in docstrings(path)
        for sentence in sentences(text)
        if OPENINGS.match(sentence)
    ]
    assert not found


@pytest.mark.parametrize("path", [*MODULES, *PAGES], ids=lambda path: str(path.relative_to(ROOT)))
def test_words_that_need_a_second_reading(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert not [f"{number}: {line}" for number, line in enumerate(lines, 1) if WORDS.search(line)]
