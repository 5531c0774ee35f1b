"""Block diagrams of the control loops, in the symbols of the laws."""

from __future__ import annotations

from html import escape

Block = tuple[float, float, float, tuple[str, ...]]
"""Left, top, width and lines of text."""
HEIGHT = 46

_JOINTS: tuple[Block, ...] = (
    (6, 30, 84, ("walking", "pattern")),
    (140, 30, 140, ("u = qdd_ref + Kd ed", "+ Kp e + du")),
    (330, 30, 84, ("Ojas,", "12 joints")),
    (140, 120, 140, ("adaptation by |s|, |xi|", "of b0, b1 (or c)")),
    (330, 120, 84, ("delay L:", "tau, a")),
)
_JOINT_WIRES = (
    ("M90 53H140", "q_ref", 115, 47),
    ("M280 53H330", "tau", 305, 47),
    ("M190 120V76", "du", 178, 102),
    ("M372 76V120", "q, qd", 390, 102),
    ("M330 152H280", "xi", 305, 147),
    ("M330 134H305V100H250V76", "tau - m_bar a", 268, 113),
)
_CASCADE: tuple[Block, ...] = (
    (6, 20, 84, ("infinity", "path")),
    (140, 20, 140, ("position loop: tau_p =", "applied + m_bar (u - a)")),
    (330, 20, 84, ("filter: R_d,", "w_d, alpha_d")),
    (330, 120, 84, ("attitude", "loop: tau_q")),
    (140, 120, 140, ("allocation to 4 rotors,", "with their limits")),
    (6, 120, 84, ("Q450, load,", "wind")),
)
_CASCADE_WIRES = (
    ("M90 43H140", "p_ref", 115, 37),
    ("M280 43H330", "tau_p", 305, 37),
    ("M385 66V120", "R_d", 400, 97),
    ("M330 143H280", "u2..u4", 305, 137),
    ("M140 143H90", "thrusts", 115, 137),
    ("M345 66V94H235V120", "u1 = tau_p . R e3", 292, 88),
    ("M48 166V200H372V166", "R, w, and the torques applied one L ago", 210, 195),
    ("M48 120V94H185V66", "p, v, force one L ago", 112, 88),
)


def joint_loop() -> str:
    """One loop for all joints of the biped."""
    name = "Block diagram: reference, law with adaptation, robot, and the estimate of one sample ago"
    return _svg(name, 190, _JOINTS, _JOINT_WIRES)


def cascade() -> str:
    """Position loop outside, attitude loop inside, as the quadrotor has them."""
    name = "Block diagram of the cascade: position loop, desired attitude, attitude loop, allocation, vehicle"
    return _svg(name, 205, _CASCADE, _CASCADE_WIRES)


def _svg(name: str, height: int, blocks: tuple[Block, ...], wires: tuple[tuple[str, str, float, float], ...]) -> str:
    drawn = [
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path class="head" d="M0 0L8 4L0 8z"/></marker></defs>'
    ]
    for path, text, x, y in wires:
        drawn.append(f'<path class="wire" d="{path}" marker-end="url(#head)"/>')
        drawn.append(f'<text x="{x}" y="{y}" text-anchor="middle" class="wire-text">{escape(text)}</text>')
    for left, top, width, lines in blocks:
        drawn.append(f'<rect class="block" x="{left}" y="{top}" width="{width}" height="{HEIGHT}" rx="4"/>')
        for i, line in enumerate(lines):
            x, y = left + width / 2, top + HEIGHT / 2 + 4 + 15 * (i - (len(lines) - 1) / 2)
            size = f' textLength="{width - 8}" lengthAdjust="spacingAndGlyphs"' if 5.6 * len(line) > width - 8 else ""
            drawn.append(f'<text class="block-text" x="{x}" y="{y}" text-anchor="middle"{size}>{escape(line)}</text>')
    label = escape(name, quote=True)
    return (
        f'<div class="chart diagram"><svg role="img" aria-label="{label}" viewBox="0 0 420 {height}">'
        f"<title>{escape(name)}</title>{''.join(drawn)}</svg></div>"
    )
