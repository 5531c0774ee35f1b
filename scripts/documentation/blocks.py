"""Markdown as prose and blocks of code: what runs in the tests, and what notebooks are made of."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from typing import NamedTuple

FENCE = re.compile(r"^```[ ]*(?P<language>\w*)[^\n]*\n(?P<text>.*?)^```[ ]*$", re.DOTALL | re.MULTILINE)
NOT_RUN = re.compile(r"<!-- not run: (?P<reason>.+?) -->\s*\Z")
CALL = "artde-gym "

SHELL = ["bash", "-euo", "pipefail", "-c"]


class Block(NamedTuple):
    """Prose (language "markdown"), or code in a language; `reason` says why code is not run, if it is not."""

    language: str
    text: str
    reason: str = ""


def blocks(markdown: str) -> list[Block]:
    """Return the parts of a page in their order."""
    found, end = [], 0
    for fence in FENCE.finditer(markdown):
        prose = markdown[end : fence.start()]
        excuse = NOT_RUN.search(prose)
        found.append(Block("markdown", NOT_RUN.sub("", prose)))
        found.append(Block(fence["language"], fence["text"], excuse["reason"] if excuse else ""))
        end = fence.end()
    return [*found, Block("markdown", markdown[end:])]


def script(parts: list[Block]) -> str:
    """All Python and shell blocks that run, in their order, as one Python script; a failing command ends it."""
    lines = []
    for part in parts:
        if part.language == "python" and not part.reason:
            lines.append(part.text)
        elif part.language == "sh" and not part.reason:
            lines.append(f"import subprocess\n\nsubprocess.run({[*SHELL, part.text]!r}, check=True)\n")
    return "\n".join(lines)


def commands(markdown: str) -> list[list[str]]:
    """Return the words after `artde-gym` of its calls in shell blocks."""
    return _calls(line for part in blocks(markdown) if part.language == "sh" for line in _lines(part.text))


def mentions(markdown: str) -> list[list[str]]:
    """Return the words of its calls in indented lines and code spans, which may be abbreviated."""
    prose = [part.text for part in blocks(markdown) if part.language == "markdown"]
    indented = [line.strip() for text in prose for line in _lines(text) if line[:4] == "    "]
    spans = [span.replace("\n", " ") for text in prose for span in re.findall(r"`([^`]+)`", text)]
    return _calls([*indented, *spans])


def _lines(text: str) -> list[str]:
    """Lines, but for a call that goes on after a backslash or within a single quote, which is one line."""
    lines: list[str] = []
    for line in text.replace("\\\n", " ").splitlines():
        if lines and lines[-1].lstrip().startswith(CALL) and lines[-1].count("'") % 2:
            lines[-1] += f" {line.strip()}"
        else:
            lines.append(line)
    return lines


def _calls(lines: Iterable[str]) -> list[list[str]]:
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith(CALL)]
