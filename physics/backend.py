"""The only module that imports taichi: start-up, number types, group-parallel loops.

Taichi 1.7.4 is the last release of its line, so the rest of the package uses a small subset
of the language through the names exported here, and the backend stays replaceable.

Worlds are simulated in groups: every quantity of a group is one vector with a lane per world.
On a CPU kernels are strict IEEE (``fast_math=False``): a world's result depends neither on its lane
nor on its neighbours.

With one lane per group a kernel is the scalar program, a world per thread, and the tensors lie the
other way round: an item of all worlds side by side. That is how a GPU runs; the CPU can run it too,
which is how it is checked. For a GPU Taichi always contracts to fused multiply-adds, flushes
denormals and divides approximately in float32: results are those of the CPU to rounding only.

``real_matrix_scalarize=False``, on the CPU, keeps these vectors whole down to LLVM's own vector
types. Measured against the default, which takes them apart and leaves it to LLVM to find them
again: 2.3 times the speed, a quarter of the compile time. In this mode Taichi 1.7.4 knows only part
of its operations on vectors; the others abort the process in LLVM. Use on lane vectors ``+ - * /``,
comparisons, ``& | ~`` of masks, ``select``, ``max``, ``min``, ``sqrt``. Write ``0 - x`` for ``-x``,
``x = x - y`` for ``x -= y``, ``numerics.magnitude`` for ``abs``, ``numerics.any_lane`` for ``any``
(which sees lane 0 alone, silently, as ``mask[lane]`` sees nothing); do casts, bits and libm
functions lane by lane (``S[item][lane]``).
"""

from __future__ import annotations

import contextlib
import io
import os
import threading
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor

from physics.compile_cache import cache_folder, some_home
from physics.compiler_thread import CompilerThread

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
        from quadrants.lang import impl as _impl
    else:
        import taichi as ti
        from taichi.lang import impl as _impl
        from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext as _Reader

# A CPU range-for of Taichi is never split below this many iterations, so a loop over chunks runs
# as ``for q in range(GRAIN * chunks): if q % GRAIN == 0: ...  # chunk q // GRAIN``.
GRAIN = 512
_MOST = 2**31 - 1  # numbers in a tensor


class _Process:
    """Taichi in this process.

    Attributes:
        device: "cpu" or "cuda", once it is started.
        program: Taichi's, while it runs; None again after a fork, until the next launch.
        epoch: how often it was started; a compiled kernel belongs to one epoch.
        pid: of the process that started it.
        lock: held while it starts, and from before to after a fork.
        compiler: starts and compiles.
    """

    def __init__(self) -> None:
        self.device = ""
        self.program: Any = None
        self.epoch = 0
        self.pid = 0
        self.lock = threading.RLock()
        self.compiler = CompilerThread()


_process = _Process()


def _current_program() -> Any:
    """The program that Taichi runs in this process, whoever started it; None without one."""
    return getattr(_impl.get_runtime(), "prog" if NAME == "taichi" else "_prog")


def start(device: str) -> None:
    """Starts Taichi once per process; a second call does nothing.

    A second ``ti.init`` would invalidate every compiled kernel, hence the guards: against other
    code that calls it before or after.

    Args:
        device: "cpu" or "cuda".

    Raises:
        ValueError: this process simulates on the other one already, uses Taichi in another way,
            or is a fork of one that does; or Taichi finds no CUDA.
    """
    _refuse_fork()
    if _process.device not in ("", device):
        raise ValueError(
            f"device: expected {_process.device}, on which this process simulates already, got "
            f"{device}; use a process for each"
        )
    with _process.lock:
        _running(device)


def _refuse_fork() -> None:
    """Refuses a copy of a process that simulates, made by other means than Python's or on a GPU."""
    if _process.program is not None and _process.pid != os.getpid():
        raise ValueError(
            "process: expected one that was started by itself, got a fork of one that simulates, "
            "whose threads it lacks; start it with the method spawn, such as "
            'multiprocessing.get_context("spawn")'
        )


def _running(device: str) -> Any:
    """Taichi's program, started if need be. The caller holds the lock."""
    if _process.program is None:
        _start(device)
    program = _process.program
    if _current_program() is not program:
        raise ValueError(
            "taichi: expected to be the only user of Taichi in this process, but ti.init or "
            "ti.reset was called since, which destroyed the simulator's kernels; use Taichi in a "
            "process of its own"
        )
    return program


def _start(device: str) -> None:
    if _current_program() is not None:
        raise ValueError(
            "taichi: expected to start Taichi, but ti.init was called in this process before, and "
            "a second one would destroy its fields; use Taichi in a process of its own"
        )
    if device == "cuda":  # its kernels crash at exit if another thread than the main one ran them
        _init(device)
    else:
        _process.compiler.run(lambda: _init(device))
    _process.device, _process.program = device, _current_program()
    _process.epoch += 1
    _process.pid = os.getpid()


def _init(device: str) -> None:
    """Calls ``ti.init``.

    ``default_fp`` is f64 so that literals keep their digits; kernels cast them to their own
    type. ``cfg_optimization`` is off because it costs compile time for no speed. On a GPU blocks
    of one warp spread few worlds over many multiprocessors, and vectors of one lane must be taken
    apart: Taichi's CUDA has no square root of a vector.
    """
    folder = cache_folder()
    with some_home(folder), contextlib.redirect_stdout(io.StringIO()):  # its greeting
        ti.init(
            arch=ti.cuda if device == "cuda" else ti.cpu,
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            cfg_optimization=False,
            log_level=ti.WARN,
            real_matrix_scalarize=device == "cuda",
            default_gpu_block_dim=32,
            **({} if NAME == "taichi" else {"offline_cache_file_path": str(folder / NAME)}),
        )
    if device == "cuda" and _impl.current_cfg().arch != ti.cuda:  # it only warns of it
        ti.reset()
        raise ValueError(
            'device: expected "cpu", for Taichi finds no CUDA driver it can use, got "cuda"'
        )


def _before_fork() -> None:
    """Ends Taichi, so that the child inherits no trace of threads that it has not.

    Both sides start it again when they need it; the state of worlds is in torch's tensors, and
    kernels come from the cache. A GPU's context does not survive a fork: the child is refused.
    """
    _process.lock.acquire()
    program = _process.program
    if _process.device == "cpu" and program is not None and _current_program() is program:
        _process.program = None
        del program
        _process.compiler.run(_stop)


def _stop() -> None:
    with some_home():
        ti.reset()


def _after_fork_in_child() -> None:
    """The lock and the compiler are those of the parent."""
    _process.lock = threading.RLock()
    _process.compiler = CompilerThread()


os.register_at_fork(
    before=_before_fork,
    after_in_parent=lambda: _process.lock.release(),
    after_in_child=_after_fork_in_child,
)


class Features(NamedTuple):
    """Stages of the engine that a kernel has only if asked for: each costs time in every step."""

    self_collision: bool = False
    """Squares of a robot collide with each other."""
    continuous: bool = False
    """Squares that land are stopped where they touch the ground."""
    varied: bool = False
    """Gravity, friction and springs are those of each world and voxel, not the same for all."""


class Program(NamedTuple):
    """What a kernel is compiled for.

    Attributes:
        dtype: torch.float32 or torch.float64.
        lanes: worlds of a group that it simulates: all, or the first ones (see ``narrow``).
        places: worlds of a group in memory, a multiple of lanes.
        features: see `Features`.
        device: "cpu" or "cuda".
    """

    dtype: torch.dtype
    lanes: int
    places: int
    features: Features = Features()
    device: str = "cpu"

    def packed(self, items: Tensor) -> Tensor:
        """A tensor (groups, items, places), its memory in the order of kernels, as this program
        takes it: a view, in vectors of its lanes; see `Real.array`."""
        if self.lanes == 1:
            return packed(items, 1)
        return items.view(-1, self.lanes)


class Real:
    """The number type a kernel is built for.

    Attributes:
        f: Taichi's scalar type; ``f(0.1)`` in a kernel is a literal of this type.
        vec: one value per lane.
        lanes: worlds of a group that are simulated.
        places: worlds of a group in memory.
        double: whether f is float64.
        features: stages of the engine that the kernel has.
        on_gpu: whether it runs on a GPU.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(self, program: Program) -> None:
        self.double = program.dtype == torch.float64
        self.f = ti.f64 if self.double else ti.f32
        self.vec = ti.types.vector(program.lanes, self.f)
        self.lanes = program.lanes
        self.places = program.places
        self.features = program.features
        self.on_gpu = program.device == "cuda"

    @property
    def flags(self) -> Any:
        """One int32 per lane."""
        return ti.types.vector(self.lanes, ti.i32)

    @property
    def words(self) -> Any:
        """One uint32 per lane."""
        return ti.types.vector(self.lanes, ti.u32)

    @property
    def singles(self) -> Any:
        """One float32 per lane."""
        return ti.types.vector(self.lanes, ti.f32)

    @property
    def array(self) -> Any:
        """Kernel argument: lane vectors, a tensor of `Program.packed`. They are one row, group
        after group, or, with one lane, (items, groups). Kernels use it through `group`."""
        return ti.types.ndarray(dtype=self.vec, ndim=2 if self.lanes == 1 else 1)

    @property
    def narrow(self) -> bool:
        """Whether a group has places for more worlds than are simulated."""
        return self.lanes < self.places

    @property
    def grain(self) -> int:
        """Iterations of a parallel loop for each chunk of groups, see GRAIN."""
        return 1 if self.on_gpu else GRAIN

    def group(self, array: Any, number: Any, items: Any) -> Group:
        """In a kernel: the items of a group.

        Args:
            array: an argument of the kernel that was declared as `array`.
            number: of the group.
            items: how many each group has.
        """
        if self.lanes == 1:
            return Group(array, number, items, lambda item: (item, number))
        start = _variable(number * (items * (self.places // self.lanes)))
        mask = 2**31 // self.lanes - 1
        return Group(array, number, items, lambda item: ((start + item) & mask,))

    def items(self, array: Any, other: Any, items: Any) -> Any:
        """In a kernel: how many items a group has in an array, from those it has in another."""
        if self.lanes == 1:
            return array.shape[0]
        parts = self.places // self.lanes
        return _variable(array.shape[0] // (other.shape[0] // (items * parts)) // parts)

    def lists(self, array: Any, number: Any) -> Group:
        """In a kernel: the integers of a group.

        Args:
            array: an argument that was declared as `integers(2)`, a tensor of `packed`.
            number: of the group.
        """
        order = (lambda item: (item, number)) if self.places == 1 else (lambda item: (number, item))
        return Group(array, number, array.shape[0 if self.places == 1 else 1], order)

    def scalars(self, ndim: int) -> Any:
        """Kernel argument: a contiguous torch tensor of ndim dimensions."""
        return ti.types.ndarray(dtype=self.f, ndim=ndim)


def real(program: Program) -> Real:
    """The Real of a program.

    Raises:
        ValueError: its dtype is neither float32 nor float64.
    """
    if program.dtype not in (torch.float32, torch.float64):
        raise ValueError(
            f"dtype: expected torch.float32 or torch.float64, got {program.dtype}; choose one of "
            "these"
        )
    return Real(program)


class Kernel:
    """A compiled kernel that is launched with little ado.

    Taichi looks at every argument of every launch for some ten microseconds. Ours are always of
    the same kinds, so that it is enough if it looks at those of the first launch; later ones only
    hand it the pointers that have changed. On 400 worlds this is a tenth of a control step.

    Args:
        function: decorated with ``ti.kernel``; its arguments are tensors and integers.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._epoch = 0  # in which it was compiled

    def __call__(self, *arguments: Tensor | int) -> None:
        """Launch it.

        Args:
            arguments: contiguous tensors and integers as in its declaration.

        Raises:
            ValueError: a tensor is too large for Taichi.
        """
        for value in arguments:
            if isinstance(value, Tensor) and value.numel() > _MOST:
                raise ValueError(
                    f"tensor: expected at most {_MOST} numbers, which Taichi counts in 32 bits, "
                    f"got shape {tuple(value.shape)}; give fewer worlds, or fewer steps, at once"
                )
        _refuse_fork()
        with _process.lock:
            self._launch(*arguments)

    def _launch(self, *arguments: Tensor | int) -> None:
        program = _running(_process.device)
        if NAME != "taichi":
            _process.compiler.run(lambda: self._function(*arguments))
            return
        if self._epoch != _process.epoch:
            if _process.device == "cpu":
                _process.compiler.run(lambda: self._first_launch(*arguments))
            else:
                self._first_launch(*arguments)
            return
        if _process.device == "cuda":  # there a launch uses its context up
            self._begin_context(len(arguments))
        for place, value in enumerate(arguments):
            if isinstance(value, int):
                if self._given[place] != value:
                    self._given[place] = value
                    self._context.set_arg_int((place,), value)
                continue
            memory = value.data_ptr(), value.shape
            if self._given[place] != memory:
                assert value.is_contiguous()
                self._given[place] = memory
                shape = value.shape[: value.dim() - self._element_dims[place]]
                self._context.set_arg_external_array_with_shape(
                    (place,), memory[0], value.nbytes, shape, 0
                )
        program.launch_kernel(self._compiled, self._context)

    def _first_launch(self, *arguments: Tensor | int) -> None:
        """Lets Taichi compile and launch it, and keeps what later launches need."""
        with _brief_places(), some_home():
            self._function(*arguments)
            primal = self._function._primal
            (self._kernel,) = primal.compiled_kernels.values()
            program = _process.program
            self._compiled = program.compile_kernel(
                program.config(), program.get_device_caps(), self._kernel
            )
        kinds = (getattr(each.annotation, "dtype", None) for each in primal.arguments)
        self._element_dims = [getattr(kind, "ndim", 0) for kind in kinds]
        self._begin_context(len(arguments))
        self._epoch = _process.epoch

    def _begin_context(self, arguments: int) -> None:
        """Makes a context for launches, and notes that no argument was handed to it."""
        self._context = self._kernel.make_launch_context()
        self._given: list[Any] = [None] * arguments


@contextlib.contextmanager
def _brief_places() -> Iterator[None]:
    """Lets Taichi name file and line of what it reads, and leave out the text of the line.

    It makes that text for every expression, for the message of an error that may come, which
    takes two thirds of its time before a compiled kernel is found in the cache.
    """

    def place(self: Any, node: Any) -> str:
        line = node.lineno + self.lineno_offset
        return f'File "{self.file}", line {line}, in {self.func.func.__name__}:\n'

    full, _Reader.get_pos_info = _Reader.get_pos_info, place
    try:
        yield
    finally:
        _Reader.get_pos_info = full


class Group:
    """The items of a group in a kernel's array, indexed as ``[item]``.

    It exists while a kernel is compiled only, and leaves no trace in it.

    Taichi adds indices as 32-bit integers of which it promises LLVM nothing. Unless LLVM knows
    that a sum stays below 2^31, it has to compute every address from its own sum, one by one: of
    the instructions for the springs of a voxel, two fifths. So the place of a block of items is
    one masked number, which is surely small, and its items lie at constants behind it: these become
    part of the instruction that loads or stores.

    Attributes:
        number: of the group.
        items: how many it has.
        at: ``at[item]`` is the `Block` of the items from this one on.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(
        self, array: Any, number: Any, items: Any, address: Callable[[Any], tuple[Any, ...]]
    ) -> None:
        self._array = array
        self._address = address
        self.number = number
        self.items = items
        self.at = _Blocks(array, address)

    def __getitem__(self, item: Any) -> Any:
        return _impl.subscript(None, self._array, *self._address(item))


class _Blocks:
    """Of a group, by their first items."""

    def __init__(self, array: Any, address: Callable[[Any], tuple[Any, ...]]) -> None:
        self._array = array
        self._address = address

    def __getitem__(self, item: Any) -> Block:
        first, *group = self._address(item)
        return Block(self._array, _variable(first), *group)


class Block:
    """Items of a group from one of them on, the first as ``[0]``; see `Group`."""

    _data_oriented = True

    def __init__(self, array: Any, first: Any, *group: Any) -> None:
        self._array = array
        self._first = first
        self._group = group

    def __getitem__(self, item: Any) -> Any:
        return _impl.subscript(None, self._array, self._first + item, *self._group)


def _variable(value: Any) -> Any:
    """In a kernel: keeps a value, so that it is not computed wherever it is used."""
    return _impl.expr_init(value)


def integers(ndim: int) -> Any:
    """Kernel argument: a contiguous int32 torch tensor of ndim dimensions."""
    return ti.types.ndarray(dtype=ti.i32, ndim=ndim)


def packed(items: Tensor, lanes: int) -> Tensor:
    """A tensor of groups and items, (groups, items, ...), as kernels take it: a view, contiguous
    if its memory is in that order, as that of `unpacked` tensors is."""
    return items.transpose(0, 1) if lanes == 1 else items


def unpacked(items: Tensor, lanes: int) -> Tensor:
    """The same values (groups, items, ...), with their memory in the order of kernels."""
    return packed(packed(items, lanes).contiguous(), lanes)  # a transposition undoes itself
