"""The calls of both clients: requests, decoders, retries, and the operations that wait."""
