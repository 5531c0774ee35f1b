"""Checks that go wrong, each in its own way; the doctor's processes import them."""

from __future__ import annotations

import os
import signal
import sys

from artde_gym.doctor.outcome import Outcome


def raises() -> list[Outcome]:
    raise RuntimeError("a broken package")


def dies() -> list[Outcome]:
    os.kill(os.getpid(), signal.SIGSEGV)
    return []


def exits() -> list[Outcome]:
    sys.exit(3)


def hangs() -> list[Outcome]:
    signal.pause()
    return []
