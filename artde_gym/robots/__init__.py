"""The project's own robots, each a plug-in: what is known of one is in its folder, bound together by its `KIT`."""
