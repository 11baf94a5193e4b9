"""Derives the asyncio client from the synchronous one.

    python3 generate_aio.py SOURCE TARGET

Reads the modules of MODULES in SOURCE (client/python/hulld) and writes them to TARGET/aio. A
function becomes a coroutine if it calls one, beginning with those of hulld/aio/transport.py. Lines
that end in "# sync only" are omitted.
"""

from __future__ import annotations

import ast
import pathlib
import sys

MODULES = ("appender", "client", "client_base", "collision_stream", "watches")
CLASSES = ("Appender", "Client", "ClientBase", "CollisionStream", "CollisionWatch", "HullWatch")
#: Coroutines, and asynchronous generators, of transport.py: functions, and methods of Duplex.
AWAITED = {"close_channel", "invoke", "pause", "read", "sleep"}
AWAITED_METHODS = {"close_sending", "expect", "receive", "send"}
ITERATED = {"each"}
#: Objects with methods that may be coroutines.
RECEIVERS = {"self", "self._connection", "connection", "appender"}
NAMES = {
    **{name: f"Async{name}" for name in CLASSES},
    "Iterator": "AsyncIterator",
    "StopIteration": "StopAsyncIteration",
}
METHODS = {
    "__iter__": "__aiter__",
    "__next__": "__anext__",
    "__enter__": "__aenter__",
    "__exit__": "__aexit__",
    "_ensure_open": "open",
}
ASYNC_METHODS = {"__next__", "__enter__", "__exit__"}
PACKAGE = "hulld."
CLASS_DOCUMENTATION = (
    "hulld.{} for asyncio: the same methods, arguments, answers, and errors. Calls are awaited; "
    "lists, parts, and watches are iterated by `async for`; streams are entered by `async with`. "
    "For one event loop."
)


def called(node: ast.AST) -> tuple[str, bool]:
    """The name of the called function, and True if it is a method of RECEIVERS; "" for other
    calls."""
    if not isinstance(node, ast.Call):
        return "", False
    if isinstance(node.func, ast.Name):
        return node.func.id, False
    if isinstance(node.func, ast.Attribute) and ast.unparse(node.func.value) in RECEIVERS:
        return node.func.attr, True
    return "", False


def own_nodes(function: ast.FunctionDef) -> list[ast.AST]:
    """The nodes of a function, without nested functions."""
    found: list[ast.AST] = []
    pending: list[ast.AST] = list(function.body)
    while pending:
        node = pending.pop()
        found.append(node)
        if not isinstance(node, (ast.FunctionDef, ast.Lambda)):
            pending.extend(ast.iter_child_nodes(node))
    return found


class Colors:
    """The functions that become coroutines, or asynchronous generators."""

    def __init__(self, trees: list[ast.Module]) -> None:
        self.methods = set(AWAITED_METHODS)
        self.generators = set(ITERATED)
        functions = [n for tree in trees for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
        size = -1
        while size != len(self.methods) + len(self.generators):
            size = len(self.methods) + len(self.generators)
            for function in functions:
                nodes = own_nodes(function)
                if any(map(self.waits, nodes)):
                    yields = any(isinstance(n, (ast.Yield, ast.YieldFrom)) for n in nodes)
                    (self.generators if yields else self.methods).add(function.name)

    def is_awaited(self, node: ast.AST) -> bool:
        name, is_method = called(node)
        return name in (self.methods if is_method else AWAITED)

    def is_iterated(self, node: ast.AST) -> bool:
        return called(node)[0] in self.generators

    def waits(self, node: ast.AST) -> bool:
        return (
            self.is_awaited(node)
            or (isinstance(node, (ast.For, ast.comprehension)) and self.is_iterated(node.iter))
            or (isinstance(node, ast.With) and is_async_context(node))
        )


def is_async_context(node: ast.With) -> bool:
    """True for a lock, and for a stream that is opened by a method of the client."""
    context = node.items[0].context_expr
    return ast.unparse(context) == "self._lock" or called(context)[0] == "open_append"


class ToAsync(ast.NodeTransformer):
    def __init__(self, colors: Colors) -> None:
        self._colors = colors

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        module = node.module or ""
        if module == "hulld.calls.transport":
            node.module = "hulld.aio.transport"
        elif module.removeprefix(PACKAGE) in MODULES:
            node.module = module.replace(PACKAGE, PACKAGE + "aio.")
        for alias in node.names:
            alias.name = NAMES.get(alias.name, alias.name)
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        if node.name in CLASSES:
            documentation = CLASS_DOCUMENTATION.format(node.name)
            node.body[0] = ast.Expr(ast.Constant(documentation))
        node.name = NAMES.get(node.name, node.name)
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST | None:
        if node.name == "__del__":
            # The garbage collector runs in any thread, but a loop belongs to one.
            return None
        nodes = own_nodes(node)
        becomes_async = node.name in ASYNC_METHODS or any(map(self._colors.waits, nodes))
        self.generic_visit(node)
        node.name = METHODS.get(node.name, node.name)
        if not becomes_async:
            return node
        fields = {name: getattr(node, name) for name in node._fields}
        return ast.copy_location(ast.AsyncFunctionDef(**fields), node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        is_awaited = self._colors.is_awaited(node)
        self.generic_visit(node)
        return ast.Await(node) if is_awaited else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        node.attr = METHODS.get(node.attr, node.attr)
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        node.id = NAMES.get(node.id, node.id)
        return node

    def visit_For(self, node: ast.For) -> ast.AST:
        is_iterated = self._colors.is_iterated(node.iter)
        self.generic_visit(node)
        if not is_iterated:
            return node
        fields = {name: getattr(node, name) for name in node._fields}
        return ast.copy_location(ast.AsyncFor(**fields), node)

    def visit_With(self, node: ast.With) -> ast.AST:
        is_async = is_async_context(node)
        self.generic_visit(node)
        if not is_async:
            return node
        return ast.copy_location(ast.AsyncWith(items=node.items, body=node.body), node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.value, ast.YieldFrom):
            return node
        # An asynchronous generator cannot use `yield from`.
        item = ast.Expr(ast.Yield(ast.Name("item", ast.Load())))
        target = ast.Name("item", ast.Store())
        return ast.For(target=target, iter=node.value.value, body=[item], orelse=[])


def generate(source: pathlib.Path, target: pathlib.Path) -> None:
    """Writes the modules to target/aio."""
    trees = []
    for module in MODULES:
        lines = (source / f"{module}.py").read_text(encoding="utf-8").splitlines()
        kept = [line for line in lines if not line.endswith("# sync only")]
        trees.append(ast.parse("\n".join(kept)))
    colors = Colors(trees)
    (target / "aio").mkdir(parents=True, exist_ok=True)
    for module, tree in zip(MODULES, trees):
        text = ast.unparse(ast.fix_missing_locations(ToAsync(colors).visit(tree)))
        (target / "aio" / f"{module}.py").write_text(
            f"# Written by generate_aio.py from {module}.py; do not edit.\n{text}\n",
            encoding="utf-8",
        )


if __name__ == "__main__":
    generate(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
