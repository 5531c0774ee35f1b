"""Physics engines behind one protocol; only this package imports them."""
