"""Calls without input or output: requests, how to read their answers, and what may be repeated.
Both clients use them."""
