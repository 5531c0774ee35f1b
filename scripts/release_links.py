"""Write the repository's address into README.md and pyproject.toml of a release.

On an index, relative links lead nowhere.

    python scripts/release_links.py https://host.example/owner/repository v1.2.3

The sources hold no address of the repository; the workflow of a release knows it.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:|#)([^)\s]+)\)")
BEFORE = "[project.scripts]\n"


def absolute(readme: str, repository: str, tag: str) -> str:
    """Return a README whose links and pictures lead to a tag of the repository."""

    def link(found: re.Match[str]) -> str:
        picture, text, path = found.groups()
        kind = "raw" if picture else "tree" if (ROOT / path).is_dir() else "blob"
        return f"{picture}[{text}]({repository}/{kind}/{tag}/{path})"

    return LINK.sub(link, readme)


def with_urls(project: str, repository: str, tag: str) -> str:
    """Return a pyproject.toml with the project's addresses."""
    urls = {
        "Repository": repository,
        "Documentation": f"{repository}/tree/{tag}/docs",
        "Changelog": f"{repository}/blob/{tag}/CHANGELOG.md",
        "Issues": f"{repository}/issues",
    }
    table = "".join(f'{name} = "{url}"\n' for name, url in urls.items())
    head, scripts, rest = project.partition(BEFORE)
    return f"{head}[project.urls]\n{table}\n{scripts}{rest}"


def main(repository: str, tag: str) -> None:
    """Write both files."""
    for name, written in (("README.md", absolute), ("pyproject.toml", with_urls)):
        file = ROOT / name
        file.write_text(written(file.read_text(encoding="utf-8"), repository.rstrip("/"), tag), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
