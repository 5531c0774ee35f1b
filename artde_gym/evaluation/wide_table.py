"""A table that prints all of its columns."""

from __future__ import annotations

from typing import Any

import pandas as pd


class WideTable(pd.DataFrame):
    """A data frame that prints wide tables in blocks of columns instead of leaving columns out."""

    @property
    def _constructor(self) -> type[WideTable]:
        return WideTable

    def __repr__(self) -> str:
        shown: Any = pd.option_context("display.max_columns", None, "display.expand_frame_repr", True)
        with shown:
            return super().__repr__()
