"""Who may import whom, read from the sources."""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = {
    "hebbtorch": {"physics", "experiments", "taichi"},
    "physics": {"hebbtorch", "experiments"},
    "experiments": {"tests"},
}

# What the folders and the single modules of a package may import of it, from the bottom up: only
# what stands above them here, and of that only what is named.
PHYSICS = {
    "renamed": "",
    "backend": "",
    "checks": "",
    "scene": "checks",
    "engine": "backend checks scene",
    "worlds": "backend checks engine scene",
    "simulator": "backend checks engine scene worlds",
    "render": "renamed scene",
    "envs": "checks render scene simulator worlds",
}
EXPERIMENTS = {
    "io": "",
    "config": "io",
    "rollout": "config",
    "runs": "config io",
    "analysis": "config io rollout runs",
    "validate": "analysis io rollout",
    "evolution": "analysis config io rollout runs",
    "report": "analysis config io runs",
    "campaign": "analysis config evolution io report rollout runs",
    "bench": "config evolution io rollout runs",
    "studies": "campaign config",
    "soak": "config evolution io runs",
    "cli": "analysis bench campaign config evolution io report runs soak studies validate",
}

# What experiments use of physics besides its public names.
INSIDE = {
    "physics.checks": {"bench", "config", "validate"},
    "physics.backend": {"bench", "rollout"},
    "physics.engine": {"bench", "rollout"},
    "physics.envs": {"bench", "soak"},
    "physics.render": {"analysis", "evolution", "report", "runs"},
    "physics.scene": {"soak", "validate"},
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


def rooms(package: str) -> dict[str, list[Path]]:
    """The folders of a package with all files below them, and its single modules."""
    found: dict[str, list[Path]] = {}
    for path in sources(package):
        first = path.relative_to(ROOT / package).parts[0].removesuffix(".py")
        if first != "__init__":
            found.setdefault(first, []).append(path)
    return found


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
        if {"taichi", "quadrants"} & {module.split(".")[0] for module in imported(path)}
    ]
    assert importers == ["physics/backend/language.py"]


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


@pytest.mark.parametrize(
    ("package", "allowed"), [("physics", PHYSICS), ("experiments", EXPERIMENTS)]
)
def test_folders_import_only_what_stands_below_them(
    package: str, allowed: Mapping[str, str]
) -> None:
    found = rooms(package)
    assert set(found) == set(allowed), "say of every folder and module what it may import"
    above: list[str] = []
    for room, names in allowed.items():
        assert set(names.split()) <= set(above), f"{room} may not import what stands above it"
        above.append(room)
        used = {
            module.split(".")[1]
            for path in found[room]
            for module in imported(path)
            if module.startswith(f"{package}.")
        }
        too_many = (used & set(found)) - {room, *names.split()}
        assert not too_many, f"{package}.{room} imports {', '.join(sorted(too_many))}"


def test_experiments_reach_into_physics_at_few_places() -> None:
    """By the names and modules that a package of physics offers, never deeper."""
    for room, paths in rooms("experiments").items():
        for path in paths:
            for module in imported(path):
                inside = ".".join(module.split(".")[:2])
                is_inside = inside.startswith("physics.") and inside.split(".")[1] in PHYSICS
                assert not is_inside or room in INSIDE.get(inside, ()), f"{path}: {module}"
        for path in paths:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                name = getattr(node, "module", None) if isinstance(node, ast.ImportFrom) else None
                is_physics = name is not None and name.startswith("physics.")
                assert not is_physics or name.count(".") == 1, f"{path}: {name}"


@pytest.mark.parametrize("package", FORBIDDEN)
def test_every_folder_has_a_charter(package: str) -> None:
    """A sentence that says what belongs there."""
    for folder in {path.parent for path in sources(package)} - {ROOT / "experiments"}:
        text = (folder / "__init__.py").read_text(encoding="utf-8")
        first = (ast.get_docstring(ast.parse(text)) or "").split("\n\n")[0]
        assert re.fullmatch(r"[A-Z`].{15,}[.:]", first, flags=re.DOTALL), folder
