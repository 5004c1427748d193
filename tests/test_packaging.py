"""What is installed: the wheel in an environment that sees its dependencies, not the checkout."""

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.slow

EVOLVE = [
    *("evolve", "--shape", "worm-3x1", "--sensors", "high", "--terrain", "flat"),
    *("--generations", "1", "--population", "4", "--duration", "0.5", "--out"),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel, built from the sdist, and the sdist."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True, timeout=300)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


@pytest.fixture(scope="module")
def command(built: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The installed console script."""
    folder = tmp_path_factory.mktemp("venv")
    venv.create(folder, with_pip=False)
    own = folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    # A plain path in a .pth file brings the packages there, not what their own .pth files name,
    # which is where an editable install of this checkout hides.
    others = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    (own / "site-packages" / "dependencies.pth").write_text("\n".join(others) + "\n")
    install = ["-m", "pip", "--python", str(folder / "bin" / "python"), "install", "--no-deps"]
    quiet = ["--quiet", "--no-index", "--disable-pip-version-check", "--force-reinstall"]
    subprocess.run([sys.executable, *install, *quiet, str(built[0])], check=True, timeout=300)
    return folder / "bin" / "hebbtorch"


def run(command: Path, *arguments: object, folder: Path, **environment: str) -> str:
    """What a command prints, run in a folder."""
    done = subprocess.run(
        [str(command), *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_holds_every_module_and_no_results(built: tuple[Path, Path]) -> None:
    names = set(zipfile.ZipFile(built[0]).namelist())
    modules = {
        str(path.relative_to(ROOT))
        for package in ("hebbtorch", "physics", "experiments")
        for path in (ROOT / package).rglob("*.py")
    }
    recordings = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "experiments" / "validate" / "reference").rglob("*")
        if path.is_file()
    }
    assert modules | recordings <= names
    assert {f"{name}/py.typed" for name in ("hebbtorch", "physics", "experiments")} <= names
    assert not [name for name in names if name.startswith("experiments/results")]
    assert not [name for name in names if name.startswith(("tests", "docs"))]


def test_the_installed_command_works_from_an_empty_folder(command: Path, tmp_path: Path) -> None:
    run(command, *EVOLVE, "run", folder=tmp_path)
    assert (tmp_path / "run" / "champion.safetensors").is_file()
    run(command, "evaluate", "run", "--terrains", "1", folder=tmp_path)
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    for path in (ROOT / "experiments" / "validate" / "reference").glob("single_voxel_step*"):
        shutil.copy(path, recordings)
    assert "0 FAIL" in run(command, "validate", "--reference", recordings, folder=tmp_path)


def test_a_folder_named_experiments_stays_its_owners(command: Path, tmp_path: Path) -> None:
    notes = tmp_path / "experiments" / "notes.py"
    notes.parent.mkdir()
    notes.write_text("kept = 1\n")
    python = command.with_name("python")
    code = "import experiments.notes, experiments.config; print(experiments.notes.kept)"
    assert run(python, "-c", code, folder=tmp_path) == "1\n"
    run(command, *EVOLVE, "run", folder=tmp_path, PYTHONPATH=".")


def test_a_package_named_experiments_does_not_hide_ours(command: Path, tmp_path: Path) -> None:
    package = tmp_path / "experiments"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "config.py").write_text("raise SystemExit('not this one')\n")
    run(command, *EVOLVE, "run", folder=tmp_path, PYTHONPATH=".")
