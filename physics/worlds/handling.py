"""Worlds handled from outside: saved and restored, set to given poses, led along recorded ones."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics import backend, checks
from physics.engine.memory import layout as lay
from physics.engine.memory import state as st
from physics.worlds import saving
from physics.worlds.launcher import Launcher

__all__ = ["Handled"]


class Handled(Launcher):
    """N worlds whose state can be taken, given and set by hand."""

    _at_start: bool

    # --- saved worlds ---------------------------------------------------------------------------

    def state_dict(self) -> dict[str, Any]:
        """All that the worlds are now, terrains included, as copies; for `torch.save`."""
        return saving.pack(self._state, self._batch, self._signature())

    @torch.inference_mode(False)
    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Goes on from worlds of a simulator with the same settings, exactly.

        Args:
            saved: what `state_dict` returned, also after `torch.save` and `torch.load`.

        Raises:
            ValueError: it is none, or of worlds with another body, sensors, number, dtype or
                lanes; nothing has changed then.
        """
        saving.check_fit(saved, self._signature())
        self._batch.seeds = saved["seeds"].numpy().copy()
        self._batch.episodes = saved["episodes"].numpy().copy()
        if terrains := saving.unpack_terrains(saved):
            self._batch.set_terrains(np.arange(self.n_worlds), terrains)
        self._batch.segments = max(self._batch.segments, saved["segments"])
        if self._batch.segments > self._state.layout.segments:
            self._widen()
        items = backend.unpacked(saved["items"].to(self._state.items), self.lanes)
        lists = backend.unpacked(saved["lists"].to(self._state.lists), self.lanes)
        layout = dataclasses.replace(self._state.layout, segments=saved["segments"])
        state = st.State(items.clone(), lists.clone(), layout, self.n_worlds, self._places)
        if layout != self._state.layout:
            state = st.widened(state, self._state.layout)
        self._state = state
        self._center, self._at_start = None, False
        self._steps_exact = False
        self._most_steps()

    def _signature(self) -> dict[str, Any]:
        """What saved worlds must have in common with these."""
        robots = [
            {
                "body": body.morphology.grid.astype(int).tolist(),
                "materials": [each.name for each in body.morphology.materials],
                "sensors": list(body.apparatus.names(body.morphology)),
            }
            for body in self.bodies.unlike
        ]
        several = {"robots": robots, "robot_of_world": self.bodies.of_world.tolist()}
        return {
            **(robots[0] if self.bodies.alike else several),
            "n_worlds": self.n_worlds,
            "ground": self._batch.terrains is not None,
            "dtype": str(self.dtype),
            "lanes": self.lanes,
            "control_delay": self._conditions.control_delay,
            "features": list(self.program.features),
        }

    # --- set-up and checks ----------------------------------------------------------------------

    @torch.inference_mode(False)
    @torch.no_grad()
    def set_poses(self, poses: Tensor, velocities: Tensor | None = None) -> Tensor | None:
        """Moves the squares by hand and senses; time stands still.

        Args:
            poses: (N, V, 4, 3) x, y [m], angle [rad].
            velocities: (N, V, 4, 3) vx, vy [m/s], omega [rad/s]; None: at rest.

        Returns:
            Readings, as ``reset``.

        Raises:
            ValueError: wrong shape.
        """
        checks.tensor("poses", poses, **self._squares())
        rates = torch.zeros_like(poses) if velocities is None else velocities
        checks.tensor("velocities", rates, **self._squares())
        self._at_start = False
        st.set_poses(self._state, poses)
        scale = torch.tensor([1.0, 1.0, lay.GYRATION], dtype=torch.float64, device="cpu")
        lanes = self._state.lanes_of(rates.double().cpu() * scale)
        self._state.bodies()[:, :, :, lay.VX : lay.W + 1] = lanes
        st.forget_window(self._state)
        return self._look()

    def replay(self, poses: Tensor, velocities: Tensor) -> Tensor | None:
        """What the robots would have sensed along a recorded motion; time goes on.

        Args:
            poses: The poses of the squares after each step, (T, N, V, 4, 3), as for ``set_poses``.
            velocities: likewise, (T, N, V, 4, 3).

        Returns:
            Readings after each step, (T, N, R), or None without sensors.

        Raises:
            ValueError: wrong shape.
        """
        checks.tensor("poses", poses, steps=None, **self._squares())
        checks.tensor("velocities", velocities, steps=len(poses), **self._squares())
        self._require_countable(len(poses))
        readings = self._readings().new_empty(len(poses), self.n_worlds, self.n_readings)
        for k, pose in enumerate(poses):
            self._state.set_steps(self._state.steps() + 1)
            now = self.set_poses(pose, velocities[k])
            if now is not None:
                readings[k] = now
        self._steps_exact = False
        self._most_steps()
        return self._given(readings)
