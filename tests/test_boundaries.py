"""Who may import whom, read from the sources."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = {
    "hebbtorch": {"physics", "experiments", "taichi"},
    "physics": {"hebbtorch", "experiments"},
    "experiments": {"tests"},
}


def imported(path: Path) -> Iterator[str]:
    """Full names of the modules that a file imports, wherever in it."""
    package = path.relative_to(ROOT).parent.parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join((*base, *([node.module] if node.module else [])))
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", FORBIDDEN)
def test_packages_know_only_those_below(package: str) -> None:
    assert sources(package)
    for path in sources(package):
        top_levels = {module.split(".")[0] for module in imported(path)}
        assert not top_levels & FORBIDDEN[package], path


def test_taichi_is_imported_in_one_module() -> None:
    importers = [
        str(path.relative_to(ROOT))
        for package in (*FORBIDDEN, "tests")
        for path in sources(package)
        if "taichi" in {module.split(".")[0] for module in imported(path)}
    ]
    assert importers == ["physics/backend.py"]


@pytest.mark.parametrize("package", FORBIDDEN)
def test_modules_do_not_import_in_circles(package: str) -> None:
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in sources(package)
    }
    below = {
        name: {module for module in imported(path) if module in modules}
        for name, path in modules.items()
    }
    while ready := [name for name, needs in below.items() if not needs]:
        for name in ready:
            del below[name]
        for needs in below.values():
            needs.difference_update(ready)
    assert not below, "these import each other, or modules that do"
