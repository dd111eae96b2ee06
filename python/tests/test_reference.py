"""The page of the package in the documentation is made of its docstrings. MOCBAN_UPDATE_DOCS=1 writes it."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import mocban

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "python.md"


def call_of(value: Callable[..., object]) -> str:
    """Return the parameters with their defaults."""
    signature = inspect.signature(value)
    bare = [p.replace(annotation=inspect.Parameter.empty) for p in signature.parameters.values() if p.name not in ("self", "cls")]
    return str(signature.replace(parameters=bare, return_annotation=inspect.Signature.empty))


def described(name: str, value: object, level: int) -> Iterator[str]:
    heading = name
    if inspect.isfunction(value) or inspect.ismethod(value):
        heading = f"{name}{call_of(value)}"
    yield f"{'#' * level} `{heading}`\n"
    doc = inspect.getdoc(value)
    if doc:
        yield f"```text\n{doc}\n```\n"
    if inspect.isclass(value) and not issubclass(value, Exception):
        for inner, member in vars(value).items():
            member = member.__func__ if isinstance(member, classmethod) else member
            is_shown = inspect.isfunction(member) or isinstance(member, property)
            if is_shown and not inner.startswith("_") and inspect.getdoc(member):
                yield from described(f"{name}.{inner}", member, level + 1)


def page() -> str:
    parts = [
        "# The Python package\n",
        "Written from the package by `MOCBAN_UPDATE_DOCS=1 pytest python/tests/test_reference.py`. "
        "[Use mocban from Python](../guides/python.md) is the guide.\n",
    ]
    for name in mocban.__all__:
        parts += described(f"mocban.{name}", getattr(mocban, name), 2)
    return "\n".join(parts)


def test_the_page_is_that_of_the_docstrings() -> None:
    if os.environ.get("MOCBAN_UPDATE_DOCS") == "1":
        PAGE.write_text(page(), encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == page()


def test_everything_public_is_described() -> None:
    for name in mocban.__all__:
        assert inspect.getdoc(getattr(mocban, name)), name
    assert list(mocban.__all__) == sorted(mocban.__all__)
