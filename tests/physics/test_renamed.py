"""Names of version 0.1 work, and warn."""

import importlib

import pytest

import physics
from physics.scene.terrain import Terrain

OLD = {
    "physics.apparatus": "Apparatus",
    "physics.canvas": "Camera",
    "physics.clock": "steps_in",
    "physics.damage": "Damage",
    "physics.frame": "Frame",
    "physics.material": "DT",
    "physics.morphology": "Morphology",
    "physics.movie": "write_gif",
    "physics.palette": "INK",
    "physics.render": "draw_film",
    "physics.terrain": "Terrain",
}


@pytest.mark.parametrize(("module", "name"), OLD.items())
def test_old_modules_warn_and_give_what_they_had(module: str, name: str) -> None:
    old = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=rf"{module}\.{name} is now physics\.") as caught:
        found = getattr(old, name)
    assert caught[0].filename == __file__
    new = str(caught[0].message).split(" is now ")[1].split(";")[0].rpartition(".")[0]
    assert found is getattr(importlib.import_module(new), name)
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        old.nothing_of_the_kind  # noqa: B018


def test_all_ways_of_importing() -> None:
    with pytest.warns(DeprecationWarning, match="is now physics.scene.terrain.Terrain"):
        from physics.terrain import Terrain as one
    with pytest.warns(DeprecationWarning, match="is now physics.scene.terrain.Terrain"):
        other = physics.terrain.Terrain
    assert one is other is Terrain


def test_damage_by_its_old_names() -> None:
    with pytest.warns(DeprecationWarning, match="Damage.from_name goes with version 0.3"):
        assert physics.Damage.from_name("none") is None
    with pytest.warns(DeprecationWarning, match="say None or Damage"):
        half = physics.Damage.from_name("half")
    assert (half.probability, half.time, half.mode) == (0.5, 30.0, "rest")
