"""XML elements with their lines."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_MAX_DEPTH = 100


@dataclass
class Element:
    """An element of the file `source`."""

    source: str
    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def error(self, message: str) -> ValueError:
        """A ValueError that names file and line."""
        return ValueError(f"{self.source}:{self.line}: {message}")

    def all(self, tag: str) -> Iterator[Element]:
        """The children with that tag, in order."""
        return (child for child in self.children if child.tag == tag)

    def only(self, tag: str) -> Element | None:
        """The child with that tag, if any. ValueError: there are several."""
        found = list(self.all(tag))
        if len(found) > 1:
            raise found[1].error(f"<{self.tag}> contains <{tag}> twice; remove one of them")
        return found[0] if found else None

    def get(self, name: str) -> str:
        """An attribute; "" if it is missing."""
        return self.attributes.get(name, "")

    def require(self, name: str) -> str:
        """An attribute. ValueError: it is missing or empty."""
        if not self.get(name):
            raise self.error(f'<{self.tag}> lacks {name}="..."')
        return self.get(name)

    def numbers(self, name: str, count: int) -> list[float]:
        """An attribute of `count` finite numbers. ValueError: it is missing or malformed."""
        if name not in self.attributes:
            raise self.error(f'<{self.tag}> lacks {name}="..."')
        words = self.get(name).split()
        for word in words:
            if not _NUMBER.fullmatch(word) or math.isinf(float(word)):
                hint = "; expand the file with 'xacro' first" if "${" in self.get(name) else ""
                raise self.error(f"<{self.tag}> {name}: {word!r} is not a finite number{hint}")
        if len(words) != count:
            numbers = "number" if count == 1 else "numbers"
            raise self.error(f"<{self.tag}> {name} needs {count} {numbers}, got {len(words)}")
        return [float(word) for word in words]

    def number(self, name: str, default: float) -> float:
        """An attribute of one finite number; `default` if it is missing."""
        return self.numbers(name, 1)[0] if name in self.attributes else default


def read_xml(path: str | os.PathLike[str], root: str) -> Element:
    """The outermost element of a file.

    ValueError names file and line: malformed XML, a document type, a macro of xacro, elements that
    are nested too deeply, or an outermost element that is not `root`. OSError: the file cannot be
    read.
    """
    source = os.fspath(path)
    with open(path, "rb") as file:
        data = file.read()
    parser = expat.ParserCreate(_encoding_of(data))
    document = Element(source, "", {}, 0)
    open_elements = [document]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(source, tag, attributes, parser.CurrentLineNumber)
        # Macros needed no prefix before 2015.
        old_macro = len(open_elements) == 2 and tag in ("include", "macro")
        if tag.startswith("xacro:") or old_macro:
            raise element.error(f"<{tag}> is a macro; expand the file with 'xacro' first")
        if len(open_elements) > _MAX_DEPTH:
            raise element.error(f"elements are nested deeper than {_MAX_DEPTH}")
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def refuse(*_: object) -> None:
        # An entity may expand to any size.
        raise ValueError(
            f"{source}:{parser.CurrentLineNumber}: document types are not supported; remove "
            "<!DOCTYPE ...>"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_elements.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise ValueError(f"{source}:{error.lineno}: not valid XML: {reason}") from None
    element = document.children[0]
    if element.tag != root:
        raise element.error(f"the outermost element is <{element.tag}>, not <{root}>")
    return element


def _encoding_of(data: bytes) -> str | None:
    """ISO 8859-1, the most common encoding of files that are not UTF-8; None if expat finds the
    encoding itself."""
    try:
        data.decode()
    except UnicodeDecodeError:
        return None if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "ISO-8859-1"
    return None
