"""Environments for libraries of reinforcement learning; needs the extra ``envs`` (gymnasium).

    import gymnasium
    env = gymnasium.make("physics.envs:hebbtorch/Locomotion-v0", shape="worm-7x1")

registers and makes one; also hebbtorch/Jumping-v0 and hebbtorch/Climbing-v0, and `make_vec` for
many worlds that step together. `VoxelVectorEnv` is the same with torch tensors.
"""

try:
    import gymnasium
except ImportError as error:
    raise ImportError(
        "physics.envs: expected gymnasium to be installed; pip install 'hebbtorch[envs]'"
    ) from error

from physics.envs.single import VoxelEnv
from physics.envs.tasks import TASKS, Climbing, Jumping, Locomotion, Task, stairs
from physics.envs.vector import VoxelVectorEnv

__all__ = [
    "Climbing",
    "Jumping",
    "Locomotion",
    "Task",
    "VoxelEnv",
    "VoxelVectorEnv",
    "numpy_vector_env",
    "stairs",
]


def numpy_vector_env(num_envs: int = 1, **settings: object) -> VoxelVectorEnv:
    """What `gymnasium.make_vec` makes: a `VoxelVectorEnv` that returns numpy arrays."""
    return VoxelVectorEnv(num_envs=num_envs, **{"arrays": "numpy", **settings})  # type: ignore[arg-type]


for _task in TASKS:
    gymnasium.register(
        id=f"hebbtorch/{_task.capitalize()}-v0",
        entry_point="physics.envs:VoxelEnv",
        vector_entry_point="physics.envs:numpy_vector_env",
        kwargs={"task": _task},
    )
