"""What the server answers, as plain values: frozen, with numpy arrays where there are many numbers.
"""
