"""An arm with two joints and a payload: a robot that artde-gym finds by its entry points."""
