"""Live play: episodes that a browser shows while they run, and that a person disturbs."""
