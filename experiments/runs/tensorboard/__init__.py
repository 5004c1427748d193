"""What TensorBoard shows of a run or a campaign; docs/metrics.md explains every tag."""

from experiments.runs.tensorboard.event_file import EventFile
from experiments.runs.tensorboard.tracker import Tracker

__all__ = ["EventFile", "Tracker"]
