"""One episode, from options and genomes to what came out of it."""

from experiments.rollout.episode import Episode, Outcome, simulator, start_episode
from experiments.rollout.evaluate import Evaluator, fitness
from experiments.rollout.scenarios import Scenarios

__all__ = ["Episode", "Evaluator", "Outcome", "Scenarios", "fitness", "simulator", "start_episode"]
