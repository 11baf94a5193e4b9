#!/usr/bin/env python3
"""Checks that comments and pages are written in standard technical English.

    python3 tests/prose.py [--worst N] [PATH ...]

Prints, for each path, the words that exceed their limit, and with --worst N the N paragraphs that
exceed the limits most. Without a path, checks everything in the source tree. Exits with 1 if a path
exceeds a limit.

The limits are twice the highest rate among the comments of S2, Box3D, Jolt, Manifold, etcd, and
TigerBeetle. A paragraph is a block of comment lines, a docstring, or a paragraph of a page; tables,
headings, and code blocks do not count.
"""

import argparse
import pathlib
import re
import sys
from collections import Counter
from collections.abc import Iterator

# Occurrences per 1,000 words.
WORD_LIMITS = {
    "what": 0.8,
    "tell|tells|told": 0.2,
    "those": 0.8,
    "others": 0.2,
    "whose": 0.8,
    "once": 1.6,
    "whether": 2.5,
    "at a time": 0.3,
    "anew|beside|meanwhile|by then|let go|lets go|is there|are there|nobody|anyone|of one": 0.5,
}
# Percentage of paragraphs that may start with a relative pronoun or a reference to other text.
START_LIMIT = 1.0
START = re.compile(
    r"(What|Whether|Whose|Those|Who|Which|How|Where|Than|Of|Told|The same|As (in|above|there))\b"
)
# Shorter texts have no meaningful rates.
MIN_WORDS = 500
MIN_PARAGRAPHS = 100

ROOT = pathlib.Path(__file__).resolve().parent.parent
PATHS = ("core", "server", "client", "proto", "docker", "tests", "README.md", ".github")
SKIPPED_FOLDERS = {"build", "results", "__pycache__"}
COMMENT_MARKS = dict.fromkeys((".cc", ".h", ".js", ".proto"), "//") | dict.fromkeys(
    (".py", ".sh", ".cmake", ".txt", ".yaml"), "#"
)

Paragraph = tuple[pathlib.Path, int, str]


def runs(lines: list[str | None]) -> Iterator[tuple[int, str]]:
    """Yields each maximal run of lines that are not None: its first line number and its text."""
    run: list[str] = []
    for number, line in enumerate([*lines, None], 1):
        if line is not None:
            run.append(line)
        elif run:
            yield number - len(run), " ".join(run)
            run = []


def page_lines(text: str) -> Iterator[str | None]:
    in_code = False
    for line in map(str.strip, text.splitlines()):
        is_fence = line.startswith("```")
        in_code ^= is_fence
        yield None if in_code or is_fence or not line or line[0] in "|#" or line[:4] == "<!--" else line


def comment_lines(text: str, mark: str) -> Iterator[str | None]:
    for line in map(str.strip, text.splitlines()):
        is_comment = line.startswith(mark) and not line.startswith("#!")
        yield line.lstrip("/#").strip() if is_comment else None


def paragraphs_of(path: pathlib.Path) -> Iterator[tuple[int, str]]:
    if path.suffix != ".md" and path.suffix not in COMMENT_MARKS:
        return
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from runs(list(page_lines(text)))
        return
    yield from runs(list(comment_lines(text, COMMENT_MARKS[path.suffix])))
    if path.suffix == ".py":
        for docstring in re.finditer(r'"""(.*?)"""', text, re.DOTALL):
            yield 1 + text.count("\n", 0, docstring.start()), " ".join(docstring[1].split())


def files_under(path: pathlib.Path) -> Iterator[pathlib.Path]:
    if path.is_file():
        yield path
        return
    for file in sorted(path.rglob("*")):
        if file.is_file() and SKIPPED_FOLDERS.isdisjoint(file.relative_to(path).parts):
            yield file


def excess_of(paragraphs: list[Paragraph]) -> list[str]:
    """Describes each limit that the paragraphs exceed."""
    words = sum(len(text.split()) for _, _, text in paragraphs)
    hits: Counter[str] = Counter()
    for _, _, text in paragraphs:
        hits += count_hits(text)
    excess = []
    if words > MIN_WORDS:
        for word, limit in WORD_LIMITS.items():
            rate = 1000 * hits[word] / words
            if rate > limit:
                excess.append(f'"{word}" {rate:.1f} times per 1,000 words (limit {limit})')
    starts = sum(bool(START.match(text)) for _, _, text in paragraphs)
    if len(paragraphs) > MIN_PARAGRAPHS and 100 * starts > START_LIMIT * len(paragraphs):
        share = 100 * starts / len(paragraphs)
        excess.append(f"{share:.1f} % of paragraphs start with a pronoun (limit {START_LIMIT} %)")
    return excess


def count_hits(text: str) -> Counter[str]:
    return Counter(
        {word: len(re.findall(rf"\b(?:{word})\b", text, re.IGNORECASE)) for word in WORD_LIMITS}
    )


def badness(text: str) -> float:
    """Returns the hits of a paragraph relative to its length; 0 for a single hit."""
    hits = count_hits(text).total() + 2 * bool(START.match(text))
    return hits / (4 + len(text.split())) if hits > 1 else 0


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--worst", type=int, default=0, metavar="N")
    parser.add_argument("paths", nargs="*", type=pathlib.Path, metavar="PATH")
    arguments = parser.parse_args()
    everything: list[Paragraph] = []
    passed = True
    for path in arguments.paths or [ROOT / name for name in PATHS]:
        if not path.exists():
            parser.error(f"{path} does not exist")
        paragraphs = [
            (file, line, text) for file in files_under(path) for line, text in paragraphs_of(file)
        ]
        everything += paragraphs
        for excess in excess_of(paragraphs):
            passed = False
            print(f"{path}: {excess}")
    worst = sorted(((badness(text), file, line, text) for file, line, text in everything), reverse=True)
    for score, file, line, text in worst[: arguments.worst]:
        if score > 0:
            print(f"{file}:{line}: {text[:200]}")
    if not passed and not arguments.worst:
        print("See the paragraphs with: python3 tests/prose.py --worst 50")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
