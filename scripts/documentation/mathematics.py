"""TeX as MathML, which any browser shows without a script, and the font for it, which few systems have."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Iterable
from pathlib import Path

import ziamath
from fontTools import subset
from fontTools.ttLib import TTFont
from latex2mathml.converter import convert

FONT = Path(ziamath.__file__).parent / "fonts/STIXTwoMath-Regular.ttf"
LETTERS = {*range(0x20, 0x7F), *range(0x391, 0x3CA), *range(0x1D434, 0x1D468), *range(0x1D6E2, 0x1D71C), 0x210E}
"""Latin and Greek, upright and italic: browsers themselves make the variables of a formula italic."""
RADICAL = 0x221A
"""Which browsers draw where MathML has an element and no character."""
FORMULA = re.compile(
    r'<span class="arithmatex">\\\((?P<inline>.*?)\\\)</span>|<div class="arithmatex">\s*\\\[(?P<block>.*?)\\\]</div>',
    re.DOTALL,
)


def mathml(page: str) -> str:
    """Turn the formulas that pymdownx.arithmatex leaves in a page's HTML into MathML."""

    def replace(found: re.Match[str]) -> str:
        kind = str(found.lastgroup)
        return convert(html.unescape(found[kind].strip()), display=kind)

    return FORMULA.sub(replace, page)


def symbols(page: str) -> set[int]:
    """Return the characters in the MathML of a page."""
    formulas = re.findall(r"<math .*?</math>", page, re.DOTALL)
    return {ord(character) for formula in formulas for character in html.unescape(re.sub(r"<.*?>", "", formula))}


def font(characters: Iterable[int]) -> bytes:
    """STIX Two Math as WOFF, with these characters, letters and what formulas need to stretch; about 80 kB."""
    options = subset.Options(layout_features=["ssty"], name_IDs=[], hinting=False)
    whole = TTFont(FONT)
    chosen = subset.Subsetter(options)
    chosen.populate(unicodes={*LETTERS, RADICAL, *characters})
    chosen.subset(whole)
    whole.flavor = "woff"
    file = io.BytesIO()
    whole.save(file)
    return file.getvalue()
