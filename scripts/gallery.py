"""Remakes the pictures of docs/gallery.md by running the code on that page (`make gallery`)."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from documentation.blocks import blocks, script

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    parts = [part._replace(reason="") for part in blocks((DOCS / "gallery.md").read_text(encoding="utf-8"))]
    (DOCS / "gallery").mkdir(exist_ok=True)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run([sys.executable, "-c", script(parts)], cwd=DOCS, env={**os.environ, "PATH": path}, check=True)


if __name__ == "__main__":
    main()
