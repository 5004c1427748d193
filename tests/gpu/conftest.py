"""Where the stand-in for a GPU is built, and what it needs."""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path

import pytest

from tests.gpu.ptx import COMPILER


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of compiled kernels, where driver.c lies compiled as libcuda.so."""
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        pytest.skip("the stand-in for a GPU needs Linux on x86-64")
    if COMPILER is None:
        pytest.skip("the stand-in for a GPU needs a C compiler, cc or gcc")
    built: Path = tmp_path_factory.mktemp("gpu")
    source, flags = Path(__file__).with_name("driver.c"), "-O1 -Wall -Wextra -shared -fPIC"
    command = [COMPILER, *flags.split(), str(source), "-o", str(built / "libcuda.so")]
    subprocess.run(command, check=True)
    return built
