"""A process in which PyTorch and Taichi find a GPU: the stand-in for CUDA's driver.

Taichi runs as it is. PyTorch's tensors "on the GPU" are tensors of the host with a mark: results
of marked tensors are marked, and to mix them with others raises, as on a GPU. The driver's log also
gets a line for each time that PyTorch would have copied between host and GPU, or waited for it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._pytree import tree_leaves, tree_map

from physics import backend
from tests.gpu import ptx

_GPU = torch.device("cuda", 0)
_LOADER = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
# Functions that copy between tensors on both sides, that take them without mixing their numbers,
# that look at numbers, for which the host waits, and that need them on the host.
_COPIES = {"copy_", "__setitem__"}
_MIXED = {"to", "__get__", "__set__", "_has_compatible_shallow_copy_type"}
_LOOKS = {"__bool__", "__float__", "__index__", "__int__", "equal", "item", "nonzero", "tolist"}
_OF_HOSTS = {"numpy", "__array__"}


class Driver:
    """The stand-in for CUDA's driver, in this process.

    Args:
        folder: where compiled kernels are kept.
    """

    def __init__(self, folder: Path) -> None:
        self._library = ctypes.CDLL("libcuda.so")  # the one that Taichi finds too
        self._library.stand_in_log.restype = ctypes.c_char_p
        self._library.stand_in_tensor.argtypes = [ctypes.c_void_p]
        self._folder = folder
        self._kernels: dict[tuple[int, bytes], Any] = {}
        self._loader = _LOADER(self._load)  # which lives as long as the driver calls it
        self._library.stand_in_connect(self._loader)

    def _load(self, module: int, name: bytes) -> int | None:
        if (module, name) not in self._kernels:
            text = ctypes.string_at(module).decode()
            self._kernels[module, name] = ptx.load(text, name.decode(), self._folder)
        return ctypes.cast(self._kernels[module, name], ctypes.c_void_p).value

    def note(self, line: str) -> None:
        """Adds a line to the log."""
        self._library.stand_in_note(line.encode())

    def log(self) -> list[str]:
        """What was asked of the driver and of PyTorch: names, with bytes if there are any."""
        return self._library.stand_in_log().decode().splitlines()

    def during(self, action: Callable[[], Any]) -> list[str]:
        """What is asked meanwhile."""
        before = len(self.log())
        action()
        return self.log()[before:]

    def arguments(self, tensors: list[Tensor]) -> None:
        """Which arguments of the next launch lie on the GPU; the driver takes no others for it."""
        self._library.stand_in_forget_tensors()
        for tensor in tensors:
            self._library.stand_in_tensor(tensor.data_ptr())


class GpuTensor(Tensor):
    """A tensor that pretends to lie on a GPU."""

    __torch_function__ = torch._C._disabled_torch_function_impl  # type: ignore[assignment]
    device = _GPU
    is_cuda = True


class Pretend(TorchFunctionMode):
    """Keeps track of which tensors lie on the GPU.

    Args:
        note: is told when PyTorch would copy between host and GPU, or wait for it.
    """

    def __init__(self, note: Callable[[str], None]) -> None:
        super().__init__()
        self._note = note

    def __torch_function__(
        self, func: Any, types: Any, args: tuple = (), kwargs: dict | None = None
    ) -> Any:
        kwargs = kwargs or {}
        if func in (torch.device, torch._C._nn._parse_to):  # name a device, put nothing there
            return func(*args, **kwargs)
        name, given = func.__name__, tree_leaves((args, kwargs))
        tensors = [each for each in given if isinstance(each, Tensor)]
        some = any(isinstance(each, GpuTensor) for each in tensors)
        # Numbers of the host may meet tensors on a GPU.
        mixed = some and any(not isinstance(each, GpuTensor) and each.dim() for each in tensors)
        _check(name, args, some, mixed)
        if mixed and name == "_has_compatible_shallow_copy_type":
            return False  # so that a module that moves gets other parameters
        on_gpu = _goes_to_gpu(name, given, tensors, some)
        moves = name in ("to", "cpu") and isinstance(tensors[0], GpuTensor) != on_gpu
        if moves or (mixed and name in _COPIES) or (name == "tensor" and on_gpu):
            self._note(f"torch copies {name}")
        if some and name in _LOOKS:
            self._note(f"torch waits {name}")
        args, kwargs = tree_map(lambda each: "cpu" if _is_device(each) else each, (args, kwargs))
        result = func(*args, **kwargs)
        return tree_map(lambda each: _placed(each, on_gpu, tensors), result, is_leaf=_is_size)


def _check(name: str, args: tuple, some: bool, mixed: bool) -> None:
    """Raises what PyTorch would, given whether some tensors lie on the GPU and others do not."""
    if some and name in _OF_HOSTS:
        raise TypeError("can't convert cuda:0 device type tensor to numpy")
    index = name == "__getitem__" and isinstance(args[0], GpuTensor)  # may lie on the host
    if mixed and not index and name not in _MIXED | _COPIES:
        raise RuntimeError(f"Expected all tensors to be on the same device: {name}")


def _goes_to_gpu(name: str, given: list[Any], tensors: list[Tensor], some: bool) -> bool:
    """Whether a result lies on the GPU: as the call says, else where its tensors do."""
    if devices := [each for each in given if _is_device(each)]:
        return "cuda" in str(devices[0])
    if name == "to" and len(tensors) > 1:
        return isinstance(tensors[1], GpuTensor)
    return some and name != "cpu"


def _placed(result: Any, on_gpu: bool, sources: list[Tensor]) -> Any:
    """A result on the side where it belongs; one that only moves is a copy."""
    if not isinstance(result, Tensor) or isinstance(result, GpuTensor) == on_gpu:
        return result
    if any(result is each for each in sources):
        result = result.clone()
    return result.as_subclass(GpuTensor if on_gpu else Tensor)


def _is_device(value: Any) -> bool:
    is_name = isinstance(value, str) and value in ("cpu", "cuda", "cuda:0")
    return is_name or isinstance(value, torch.device)


def _is_size(value: Any) -> bool:
    return isinstance(value, torch.Size)


def start(folder: Path) -> Driver:
    """Makes this process find a GPU; to be called once, before anything is simulated.

    The environment's LD_LIBRARY_PATH must lead to driver.c, compiled as libcuda.so, from the start
    of the process: that is where the system looks for libraries.

    Args:
        folder: where compiled kernels are kept.
    """
    driver = Driver(folder)
    torch.cuda.is_available = lambda: True
    torch.cuda.current_device = lambda: 0
    torch.cuda.get_device_properties = lambda _: SimpleNamespace(multi_processor_count=132)  # type: ignore
    launch = backend.Kernel.__call__

    def launch_and_tell(kernel: backend.Kernel, *arguments: Tensor | int) -> None:
        driver.arguments([each for each in arguments if isinstance(each, GpuTensor)])
        launch(kernel, *arguments)

    backend.Kernel.__call__ = launch_and_tell  # type: ignore
    Pretend(driver.note).__enter__()
    return driver
