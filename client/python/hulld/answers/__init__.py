"""Answers of the server as plain values: frozen, with numpy arrays for columns of numbers."""
