"""Gymnasium environments; make them with `gymnasium.make` after `import artde_gym`."""
