"""Motion: where a robot is over time, packed small, and the page in which a browser shows it."""
