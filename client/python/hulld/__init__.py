"""Client of hulld, a server of 3D convex hulls and exact collision queries.

    import hulld

    with hulld.local() as client:                       # or hulld.Client("HOST:PORT")
        client.append_points("box", points, create=True)  # n x 3
        answer = client.check_collision("box", ("box", pose), separation=True)
        print(answer.relation.name, answer.separation)

README.md of the package shows each task.
"""

import ast
import importlib
import pkgutil
from typing import Any

from hulld._version import __version__


def _modules() -> dict[str, str]:
    """The module of each public name, by the imports in __init__.pyi. They run at first use:
    `import hulld` alone loads neither numpy nor gRPC."""
    stub = ast.parse(pkgutil.get_data(__name__, "__init__.pyi") or b"")
    return {
        alias.name: str(node.module)
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


_MODULES = _modules()
__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(importlib.import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return __all__
