"""The client for asyncio. transport.py is written by hand; generate_aio.py writes the other modules
when the package is built."""

from hulld.aio.appender import AsyncAppender as AsyncAppender
from hulld.aio.client import AsyncClient as AsyncClient
from hulld.aio.collision_stream import AsyncCollisionStream as AsyncCollisionStream
from hulld.aio.watches import AsyncCollisionWatch as AsyncCollisionWatch
from hulld.aio.watches import AsyncHullWatch as AsyncHullWatch
