"""Checks that go wrong, each in its own way; the doctor's processes import them."""

from __future__ import annotations

import os
import signal
import sys

from artde_gym.doctor.check_result import CheckResult


def raises() -> list[CheckResult]:
    raise RuntimeError("a broken package")


def dies() -> list[CheckResult]:
    os.kill(os.getpid(), signal.SIGSEGV)
    return []


def exits() -> list[CheckResult]:
    sys.exit(3)


def hangs() -> list[CheckResult]:
    signal.pause()
    return []
