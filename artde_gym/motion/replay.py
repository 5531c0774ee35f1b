"""Replays of episodes, to be saved as a file or shown by a notebook."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from artde_gym.files import check_replaceable, write_atomically
from artde_gym.motion.page import page

HEIGHT = 900  # pixels, of the frame in a notebook


@dataclasses.dataclass(frozen=True)
class Replay:
    """Episodes in a browser, one figure a scenario; a notebook shows it as it is.

    Attributes:
        figures: what the viewer shows, as plain data.
        notes: what has to be said about them, such as an episode that did not repeat.
    """

    figures: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...] = ()

    @property
    def html(self) -> str:
        """The whole page: one file that needs no network."""
        return page(self._title, self.figures)

    @property
    def _title(self) -> str:
        return f"artde-gym replay: {', '.join(str(data['title']) for data in self.figures)}"

    def save(self, out: str | Path, *, viewer: str | None = None) -> Path:
        """Write the page and return its path.

        Args:
            out: the file.
            viewer: address of a copy of `VIEWER` in `artde_gym.motion.page` that several pages share, as the page sees
                it; None to put it into the page.
        """
        out = Path(out)
        check_replaceable(out)
        out.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(out, lambda file: file.write(page(self._title, self.figures, viewer).encode()))
        return out

    def _repr_html_(self) -> str:
        frame = f'style="width:100%;height:{HEIGHT}px;border:0" title="replay"'
        return f'<iframe sandbox="allow-scripts" {frame} srcdoc="{escape(self.html, quote=True)}"></iframe>'
