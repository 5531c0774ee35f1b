"""The page of live play: the viewer of replays, which fetches everything else over its WebSocket."""

from __future__ import annotations

from artde_gym.motion.page import ASSETS, CREDIT, NEEDED, VIEWER, style

LIVE_STYLE = ASSETS / "live.css"


def live_page(nonce: str) -> str:
    """Return the page, whose script runs by a nonce."""
    script = VIEWER.read_text(encoding="utf-8")
    look = style() + LIVE_STYLE.read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<link rel="icon" href="data:,">\n'
        f"<title>artde-gym play</title>\n<style>\n{look}</style>\n</head>\n"
        f'<body class="replay-page">\n<main><div class="live"><noscript><p class="failed">{NEEDED}</p></noscript>'
        f'</div></main>\n{CREDIT}\n<script nonce="{nonce}">{script}</script>\n</body>\n</html>\n'
    )


def policy_of(nonce: str) -> str:
    """Return the content security policy of the page: its own script alone, and no connection but to its server."""
    return (
        f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; connect-src 'self'; "
        "img-src data:; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
    )
