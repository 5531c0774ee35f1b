"""References to follow: pure functions of time, without an engine."""
