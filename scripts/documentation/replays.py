"""Replays of docs/gallery in frames, which a browser loads when they come into sight."""

from __future__ import annotations

SHOWN = {
    "walk": "A walk with a payload under TDE, ARTDE and a stiffer TDE",
    "switched": "A walk with a payload under TDE with and without gains for each phase of support",
    "push": "A push on the chest under TDE, ATDE and ARTDE",
    "flight": "A flight in strong wind under TDE and ARTDE",
    "rivals": "A flight in strong wind under PID, INDI, ASMC and geometric control",
    "sling": "A load on a cable is kicked under TDE with and without the swing term",
    "arm": "An arm with a payload is pushed under TDE, ARTDE and computed torque",
}
"""Replay -> what it shows, for those who do not see it."""
OF_ENVIRONMENTS = {
    "BipedWalk-Payload-v0": "walk",
    "BipedPush-v0": "push",
    "QuadInfinity-Payload-v0": "flight",
    "QuadSling-Payload-v0": "sling",
    "ArmTrack-Payload-v0": "arm",
}


def frame(name: str, page: str) -> str:
    """Return the frame of a replay in a page, whose source is named from docs/ on."""
    source = "../" * page.count("/") + f"gallery/{name}.html"
    return f'<iframe class="replay-frame" loading="lazy" title="{SHOWN[name]}" src="{source}"></iframe>'
