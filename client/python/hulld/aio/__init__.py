"""The client for asyncio: the surface of hulld.Client, with await, async for and async with."""
