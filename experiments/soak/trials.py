"""`hebbtorch soak`: random trials for some minutes, and their counts."""

from __future__ import annotations

import dataclasses
import json
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from experiments.io import terminal
from experiments.io.atomic import write_atomically
from experiments.soak.counts import EpisodeCounts
from experiments.soak.damage import DamageCounts, Original, try_flip
from experiments.soak.kills import KillCounts, try_kills, undisturbed
from experiments.soak.worlds import WorldCounts, try_worlds

__all__ = ["soak"]

_FORMAT = 1  # of the table in JSON
_KILLS, _EPISODES, _DAMAGE = 0.3, 0.25, 0.1  # shares of the time; the worlds have the rest
# Of the memory [MB]: from the 20th trial of episodes on, when all programs have been compiled that
# there are, and from the 5th trial of worlds on, whose bodies and terrains are of any size.
_MOST_EPISODES_GROWTH, _MOST_WORLDS_GROWTH = 30.0, 300.0


def soak(minutes: float, seed: int, file: Path | None, folder: Path | None) -> int:
    """Try kills, damaged files, episodes and random worlds, each for its share of the time.

    Trials follow from the seed, one by one; the time decides only how many there are.

    Args:
        minutes: About how long it takes; at least one trial of each kind is made.
        seed: The seed of all trials.
        file: The file for the counts in JSON; None: none is written.
        folder: Existing or new one for the runs; None: a temporary one, which is removed. Runs
            with which something is wrong stay there.

    Returns:
        The exit code: 1 if a promise was broken.
    """
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="hebbtorch-soak-") as temporary:
        place = Path(temporary) if folder is None else folder
        place.mkdir(parents=True, exist_ok=True)
        whole = place / "undisturbed"
        expected = undisturbed(whole)
        kills, damage, worlds = KillCounts(), DamageCounts(), WorldCounts()
        _until(began + 60 * minutes * _KILLS, lambda k: try_kills(seed, k, place, expected, kills))
        _tell("kills", kills)
        original = Original(whole)
        end = time.monotonic() + 60 * minutes * _DAMAGE
        _until(end, lambda k: try_flip(seed, k, original, damage))
        _tell("damaged files", damage)
    episodes = EpisodeCounts()
    if find_spec("gymnasium") is None:
        terminal.say("episodes: not tried, for gymnasium is not installed")
    else:
        from experiments.soak.episodes import try_episodes

        end = time.monotonic() + 60 * minutes * _EPISODES
        _until(end, lambda k: try_episodes(seed, k, episodes))
        _tell("episodes", episodes)
    _until(began + 60 * minutes, lambda k: try_worlds(seed, k, worlds))
    _tell("worlds", worlds)
    broken = _broken(kills, damage, episodes, worlds)
    minutes_taken = (time.monotonic() - began) / 60
    terminal.say(f"{minutes_taken:.1f} minutes, seed {seed}: " + ("; ".join(broken) or "all held"))
    if file is not None:
        content = {
            "format": _FORMAT,
            "seed": seed,
            "minutes": round(minutes_taken, 2),
            "kills": vars(kills),
            "damage": vars(damage),
            "episodes": vars(episodes),
            "worlds": vars(worlds),
            "broken": broken,
        }
        write_atomically(file, (json.dumps(content, indent=1) + "\n").encode())
    return 1 if broken else 0


def _until(end: float, trial: Callable[[int], None]) -> None:
    """Trials 0, 1, ... up to a time, at least one."""
    number = 0
    while number == 0 or time.monotonic() < end:
        trial(number)
        number += 1


def _tell(title: str, counts: Any) -> None:
    """Print counts, one line each."""
    terminal.say(f"{title}:")
    for field in dataclasses.fields(counts):
        value = getattr(counts, field.name)
        if isinstance(value, dict):
            total = sum(value.values())
            parts = ", ".join(f"{name} {n}" for name, n in sorted(value.items()) if n)
            value = f"{total} ({parts})" if parts else total
        elif isinstance(value, float):
            value = round(value, 3)
        elif isinstance(value, list):
            value = ", ".join(str(each) for each in value) or "none"
        terminal.say(f"  {field.name}: {value}")


def _broken(
    kills: KillCounts, damage: DamageCounts, episodes: EpisodeCounts, worlds: WorldCounts
) -> list[str]:
    """What did not hold, in words."""
    found = {
        "evolutions ended differently after kills": kills.different,
        "killed runs were refused": kills.refused.total(),
        "killed runs hung": kills.hung,
        "files were left behind by kills": kills.leftovers,
        "damaged files were read as sound": damage.silent.total(),
        "damaged files raised other errors": damage.errors.total(),
        "worlds with staggered episodes misbehaved": episodes.faults.total(),
        "worlds misbehaved": worlds.faults.total(),
    }
    words = [f"{count} {what}" for what, count in found.items() if count]
    for what, memory, most in (
        ("episodes", episodes.memory, _MOST_EPISODES_GROWTH),
        ("worlds", worlds.memory, _MOST_WORLDS_GROWTH),
    ):
        if memory and memory[-1] - memory[0] > most:
            words.append(f"memory of {what} grew from {memory[0]:.0f} to {memory[-1]:.0f} MB")
    return words
