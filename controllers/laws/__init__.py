"""Control laws as pure functions of arrays: NumPy's, or those of any other library (`controllers.laws.namespaces`)."""
