"""What TensorBoard shows of an evolution: every tag, when, and that it is explained."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import hebbtorch
from experiments.analysis.episode_log import log_episode
from experiments.analysis.unseen import speeds_on
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.observation import Observer, is_filmed, is_observed
from experiments.rollout import controller
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios

GLOSSARY = Path(__file__).parents[3] / "docs" / "metrics.md"


def read(folder: Path) -> EventAccumulator:
    return EventAccumulator(str(folder), {"histograms": 0, "images": 0}).Reload()


def tags(folder: Path) -> set[str]:
    kinds = read(folder).Tags()
    return {tag for kind in ("scalars", "histograms", "images") for tag in kinds[kind]}


@pytest.fixture(scope="module")
def logged(tiny: EvolveConfig, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Runs of two generations and the episodes of their champions, plastic and static."""
    folders = {}
    for name in ("hebbian", "mlp"):
        config = replace(tiny, controller=name, generations=2, duration=3.0)
        folders[name] = tmp_path_factory.mktemp(name) / "run"
        with Session.create(config, folders[name]) as session:
            while not session.evolved:
                session.step()
            champions = session.finish()
        log_episode(folders[name], config, champions.genomes[0])
    return folders


def test_every_tag_is_explained(logged: dict[str, Path]) -> None:
    found = set().union(*(tags(folder) | tags(folder / "life") for folder in logged.values()))
    explained = set(re.findall(r"`([a-z_]+/[^`]+)`", GLOSSARY.read_text(encoding="utf-8")))
    for tag in found:
        general = re.sub(r"layer\d", "layer{k}", tag)
        general = re.sub(r"^validation/(?!damage).*", "validation/{terrain}", general)
        general = re.sub(r"share_[ABCD]", "share_{A,B,C,D}", general)
        general = re.sub(r"^rules/[ABCD]", "rules/{A,B,C,D}", general)
        assert general in explained, tag


def test_all_that_was_asked_for_is_there(logged: dict[str, Path]) -> None:
    shown = tags(logged["hebbian"])
    layers = [
        f"plasticity/{name}/layer{k}"
        for k in (0, 1)
        for name in (
            "weight_mean_abs", "weight_max_abs", "update_mean_abs", "drift_from_birth",
            "saturated", "sign_changes", "share_A", "share_B", "share_C", "share_D",
        )
    ]  # fmt: skip
    expected = {
        *("fitness/best", "fitness/median", "fitness/mean", "fitness/q75", "fitness/best_so_far"),
        *("fitness/population", "validation/hilly-3-30", "validation/damage"),
        *("genome/spread", "genome/mean_abs", "rules/A", "rules/B", "rules/C", "rules/D"),
        *(f"rules/{term}/layer{k}" for term in "ABCD" for k in (0, 1)),
        *layers,
        *("body/failed", "body/touch", "champion/film", "champion/strip", "time/generation"),
        *("time/evaluations_per_second", "time/robot_steps_per_second"),
    }
    assert expected <= shown
    of_life = tags(logged["hebbian"] / "life")
    assert {
        "life/speed", "life/weights/layer0", "life/activations/layer1", "life/share_A/layer0",
        "life/weights_over_time/layer1", "life/activation_raster/layer0",
    } <= of_life  # fmt: skip


def test_static_controllers_show_no_plasticity(logged: dict[str, Path]) -> None:
    shown = tags(logged["mlp"]) | tags(logged["mlp"] / "life")
    assert {"validation/damage", "life/speed", "life/activations/layer0"} <= shown
    assert not [tag for tag in shown if tag.startswith(("plasticity", "rules", "weights"))]
    assert not [tag for tag in shown if "weight" in tag or "share" in tag]


def test_steps_are_generations_in_a_run_and_seconds_in_an_episode(
    logged: dict[str, Path],
) -> None:
    run, life = read(logged["hebbian"]), read(logged["hebbian"] / "life")
    assert [event.step for event in run.Scalars("fitness/best")] == [1, 2]
    assert [event.step for event in run.Images("champion/film")] == [1, 2]
    assert [event.step for event in life.Scalars("life/speed")] == [1, 2, 3]
    assert [event.step for event in life.Histograms("life/weights/layer0")] == [1, 2, 3]
    drift = [event.value for event in life.Scalars("life/drift_from_birth/layer0")]
    assert drift[0] > 0  # initial weights are zero


def test_an_episode_is_replaced_when_it_is_logged_again(logged: dict[str, Path]) -> None:
    folder = logged["mlp"]
    before = [(e.step, e.value) for e in read(folder / "life").Scalars("life/speed")]
    with Session.resume(folder) as session:
        champions = session.finish()
    log_episode(folder, champions.config, champions.genomes[0])
    assert [(e.step, e.value) for e in read(folder / "life").Scalars("life/speed")] == before


def test_champions_are_looked_at_now_and_then() -> None:
    observed = [each for each in range(1, 231) if is_observed(each, 230)]
    assert observed == [1, 50, 100, 150, 200, 230]
    assert [each for each in observed if is_filmed(each, 230)] == [1, 100, 200, 230]
    assert [each for each in range(1, 61) if is_observed(each, 60)] == [1, 25, 50, 60]


def test_validation_is_the_reassessment_on_its_terrains(tiny: EvolveConfig) -> None:
    config = replace(tiny, duration=2.0, init="uniform", damage="half", eta=0.2)
    n_genes = controller.build(config, 1).n_genes
    genomes = torch.randn(2, n_genes, generator=torch.Generator().manual_seed(0))
    seen = Observer(config)(genomes)
    terrains = [500_000 + k for k in range(4)]
    scenarios = Scenarios.unseen(config.terrain, terrains)
    for damage, tag in (("none", "validation/hilly-3-30"), ("half", "validation/damage")):
        speeds = speeds_on(replace(config, damage=damage), genomes, scenarios).mean(1)
        assert [each.metrics[tag] for each in seen] == pytest.approx(speeds.tolist(), abs=2e-6)
    sizes = controller.build(config, 1).sizes
    assert [layer.shape for layer in seen[0].weights] == [sizes[1:2] * 2, (sizes[2], sizes[1])]


@pytest.mark.parametrize("rule", ["abcd", "oja"])
def test_networks_are_looked_at_by_a_monitor(tiny: EvolveConfig, rule: str) -> None:
    """In both control loops, and each champion by itself."""
    config = replace(tiny, duration=2.0, init="uniform", eta=0.2, rule=rule)
    n_genes = controller.build(config, 1).n_genes
    genomes = torch.randn(2, n_genes, generator=torch.Generator().manual_seed(0))
    seen = Observer(config)(genomes)
    for run in (0, 1):
        first = Scenarios.unseen(config.terrain, [500_000])
        episode = start_episode(config, genomes[run : run + 1], first)
        with hebbtorch.Monitor(episode.network, every=60) as monitor:
            episode.run(episode.n_steps, monitor)
        expected = {k: v for k, v in monitor.summary().items() if not k.startswith("weight_")}
        assert ("share_A/layer1" in expected) == (rule == "abcd")
        assert "saturated/layer1" in expected
        shown = {k: v for k, v in seen[run].metrics.items() if k.startswith("plasticity/")}
        assert shown == pytest.approx({f"plasticity/{k}": v for k, v in expected.items()})
