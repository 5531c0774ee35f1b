"""The report of flights with a load on a cable, run in a vector environment of its own engine."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from artde_gym.evaluation import evaluate
from artde_gym.report import write_report

KICK = {"body": "payload", "magnitude": 1.4, "direction": [1.0, 0.0, 0.0], "start": 0.5, "duration": 0.2}
LOAD: dict[str, Any] = {"payload": {"mass": 0.35, "cable": 0.5, "detach_time": 3.0}, "push": [KICK]}


def test_it_holds_the_load_and_the_gains_and_no_empty_column(tmp_path: Path) -> None:
    evaluate(
        ["tde", "tde+swing"], "QuadSling-Payload-v0", episodes=2, disturbances=LOAD, vectorized=True,
        env_kwargs={"duration": 4.0}, record_episodes=1, out=tmp_path / "run",
    )  # fmt: skip
    page = write_report(tmp_path / "run").read_text(encoding="utf-8")
    table = page[page.index("signals beside the errors") :]
    for words in ("swing (deg)", "load error (m)", "cable impulse (Ns)", "push0: 0/2 (0..66 %), never"):
        assert words in table
    assert "Gains of the controllers" in page  # of single environments, though numpy is the vector's engine alone
    heads = re.findall(r"<th scope=\"col\"[^>]*><button type=\"button\">([^<]*)</button>", page)
    assert "thesis" not in heads  # it has published nothing about this
    for title in ("swing", "load&#x27;s error", "cable&#x27;s impulse"):
        chart = page[page.index(f'aria-label="{title}') :]
        assert chart.index("push0") < chart.index("</svg>")
