"""Control laws as pure functions of NumPy arrays."""
