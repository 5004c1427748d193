"""What a batch of worlds holds: robots, their sensors and the ground."""

from __future__ import annotations

from physics.scene.bodies import Bodies, Body
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus
from physics.scene.terrain import Terrain
from physics.worlds.batch import Batch

__all__ = ["Contents"]


class Contents:
    """The robots and terrains of N worlds.

    Attributes:
        bodies: The robots.
    """

    bodies: Bodies
    _batch: Batch

    @property
    def morphologies(self) -> list[Morphology]:
        """The shape of each world's robot, N of them."""
        return [self.bodies.unlike[number].morphology for number in self.bodies.of_world]

    @property
    def morphology(self) -> Morphology:
        """The shape of the robots.

        Raises:
            ValueError: worlds have different robots.
        """
        return self._only("morphology", "morphologies").morphology

    @property
    def apparatus(self) -> Apparatus:
        """The sensors of the robots.

        Raises:
            ValueError: worlds have different robots.
        """
        return self._only("apparatus", "bodies").apparatus

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Of the readings, R names such as "v3_0_lidar_1".

        Raises:
            ValueError: worlds have different robots.
        """
        return self.apparatus.names(self.morphology)

    @property
    def sensor_kinds(self) -> tuple[str, ...]:
        """Of the readings, R kinds such as "lidar".

        Raises:
            ValueError: worlds have different robots.
        """
        return self.apparatus.kinds

    @property
    def terrains(self) -> list[Terrain] | None:
        """The terrain of each world, or None without ground."""
        terrains = self._batch.terrains
        return None if terrains is None else list(terrains)

    def _only(self, name: str, instead: str) -> Body:
        """The robot, if all worlds have the same."""
        if not self.bodies.alike:
            raise ValueError(
                f"{name}: expected one robot in all worlds, got {len(self.bodies.unlike)} that "
                f"differ; look at Simulator.{instead}"
            )
        return self.bodies.unlike[0]
