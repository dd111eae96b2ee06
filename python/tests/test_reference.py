"""The page of the package in the documentation is made of its docstrings. MOCBAN_UPDATE_DOCS=1 writes it."""

from __future__ import annotations

import ast
import inspect
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import mocban

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "python.md"
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


def codes() -> Iterator[str]:
    """Return all values of ``code``, from the sources of the package and the names of the codes of the libraries."""
    names = {name for name in mocban.__all__ if isinstance(getattr(mocban, name), type)}
    names = {name for name in names if issubclass(getattr(mocban, name), mocban.Error)} | {"error"}
    for file in Path(mocban.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
                if len(node.args) > 1 and isinstance(node.args[1], ast.Constant):
                    yield node.args[1].value
    root = Path(__file__).parents[2] / "crates"
    for file in (root / "python" / "src").glob("*.rs"):
        yield from re.findall(r'raise\(\s*py,\s*"?\w+"?,\s*"(\w+)"', file.read_text(encoding="utf-8"))
    for name in ("explained", "failure"):
        enum = (root / "core" / "src" / "domain" / f"{name}.rs").read_text(encoding="utf-8")
        yield from re.findall(r'[A-Z]\w+ = "(\w+)"', enum)


def test_the_guide_has_all_codes_of_exceptions() -> None:
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", GUIDE.read_text(encoding="utf-8"), re.MULTILINE)
    listed = [code for row in rows for code in re.findall(r"`(\w+)`", row)]
    assert sorted(listed) == sorted(set(codes()))


def test_everything_public_is_described() -> None:
    for name in mocban.__all__:
        assert inspect.getdoc(getattr(mocban, name)), name
    assert list(mocban.__all__) == sorted(mocban.__all__)
