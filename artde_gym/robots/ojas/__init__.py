"""Ojas, the biped."""
