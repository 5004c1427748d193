"""Taichi, or its fork: the only module that imports it."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

from physics.backend.compile_cache import some_home

__all__ = ["BACKENDS", "NAME", "current_program", "impl", "reader", "ti", "variable"]

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
os.environ.setdefault("TI_ENABLE_PYBUF", "0")  # no kernel prints, and it tells that one could
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")  # it would ask a server on the internet

# Upstream Taichi is no longer maintained; `quadrants` is its living fork, and gives the same bits.
BACKENDS = ("taichi", "quadrants")
NAME = os.environ.get("HEBBTORCH_BACKEND") or BACKENDS[0]
if NAME not in BACKENDS:
    raise ValueError(f"HEBBTORCH_BACKEND: expected {' or '.join(BACKENDS)}, got {NAME!r}")

with some_home():
    if NAME == "quadrants":
        import quadrants as ti
        from quadrants.lang import impl
    else:
        import taichi as ti
        from taichi.lang import impl


def current_program() -> Any:
    """The program that Taichi runs in this process, whoever started it; None without one."""
    return getattr(impl.get_runtime(), "prog" if NAME == "taichi" else "_prog")


def variable(value: Any) -> Any:
    """In a kernel: keeps a value, so that it is not computed wherever it is used."""
    return impl.expr_init(value)


def reader() -> Any:
    """Taichi's class that walks through the source of a kernel."""
    return import_module(f"{NAME}.lang.ast.ast_transformer_utils").ASTTransformerContext
