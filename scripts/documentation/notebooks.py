"""Tutorials as Jupyter notebooks, made of their pages.

python -m documentation.notebooks docs/tutorials/first-run.md > first-run.ipynb      (in scripts/)
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import nbformat
from nbformat import v4

from documentation.blocks import Block, blocks

NOTEBOOKS = ("tutorials/first-run.md", "tutorials/own-controller.md")
"""Pages, in docs/, that the site offers as notebooks too."""
LINK = re.compile(r"\[([^]]+)\]\((?!https?:)[^)]+\)")
COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)


def notebook(page: Path) -> str:
    """Return the notebook of a page as JSON: prose, Python cells, shell cells; links to other pages are plain words."""
    cells = [cell for part in blocks(page.read_text(encoding="utf-8")) if (cell := _cell(part)) is not None]
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"  # the same page gives the same file
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return nbformat.writes(v4.new_notebook(cells=cells, metadata={"kernelspec": kernel}))


def _cell(part: Block) -> nbformat.NotebookNode | None:
    if part.language == "markdown":
        text = COMMENT.sub("", LINK.sub(r"\1", part.text)).strip()
        return v4.new_markdown_cell(text) if text else None
    text = part.text.rstrip("\n")
    if part.language == "python" and not part.reason:
        return v4.new_code_cell(text)
    if part.language == "sh" and not part.reason:
        return v4.new_code_cell(f"%%bash\n{text}")
    return v4.new_markdown_cell(f"```{part.language}\n{text}\n```")


if __name__ == "__main__":
    sys.stdout.write(notebook(Path(sys.argv[1])))
