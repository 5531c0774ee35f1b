"""Hooks of MkDocs, called while the site is built (`make docs`)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from documentation.figures import FIGURES
from documentation.mathematics import font, mathml, symbols
from documentation.notebooks import NOTEBOOKS, notebook
from documentation.pages import ROOT, cards, generated, laws
from documentation.replays import frame
from mkdocs.structure.files import File

from artde_gym.motion.page import VIEWER

CHART_STYLE = ROOT / "artde_gym/report/assets/chart.css"

_symbols: set[int] = set()


def on_config(config: Any) -> None:
    """List what `mkdocs.yml` does not: the policies that are shipped, and laws without a page of their own."""
    results = next(section["Results"] for section in config.nav if "Results" in section)
    results += [{f"Policy {card.parent.name}": f"policies/{card.parent.name}.md"} for card in cards()]
    next(section["Laws"] for section in config.nav if "Laws" in section).extend(laws())


def on_files(files: Any, config: Any) -> None:
    """Add what has its source elsewhere: pages, notebooks, the look of charts."""
    contents = {
        **generated(),
        **{f"{page.removesuffix('.md')}.ipynb": notebook(Path(config.docs_dir) / page) for page in NOTEBOOKS},
        "assets/chart.css": CHART_STYLE.read_text(encoding="utf-8"),
        "assets/replay.js": VIEWER.read_text(encoding="utf-8"),
    }
    for path, content in contents.items():
        files.append(File.generated(config, path, content=content))


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Put in the figures, replays and sources that a page asks for, and the link to its notebook."""
    if page.file.src_uri in NOTEBOOKS:
        title, rest = markdown.split("\n", 1)
        markdown = f"{title}\n\n[This page as a notebook]({Path(page.file.src_uri).stem}.ipynb)\n{rest}"
    markdown = re.sub(r"<!-- figure: (\S+) -->", lambda found: FIGURES[found[1]](), markdown)
    markdown = re.sub(r"<!-- replay: (\S+) -->", lambda found: frame(found[1], page.file.src_uri), markdown)
    return re.sub(r"<!-- source: (\S+) -->", lambda found: _source(found[1]), markdown)


def on_page_content(content: str, **_: Any) -> str:
    """Make MathML of TeX."""
    content = mathml(content)
    _symbols.update(symbols(content))
    return content


def on_post_build(config: Any) -> None:
    """Add a font that has all symbols of all pages."""
    (Path(config.site_dir) / "assets/mathematics.woff").write_bytes(font(_symbols))


def _source(path: str) -> str:
    text = (ROOT / path).read_text(encoding="utf-8")
    language = {".py": "python", ".cff": "yaml", ".toml": "toml"}[Path(path).suffix]
    return f'``` {{ .{language} title="{path}" }}\n{text}```'
