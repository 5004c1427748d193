"""What the report tells of damage at the full scale, computed again from the published files."""

import zipfile

import numpy as np
from scipy import stats

from tests.results.published import (
    FULL,
    RESULTS,
    Published,
    condition,
    per_run,
    report_rows,
    rows,
)

PLACES = [
    f"{body} {sensors}" for body in ("biped", "worm") for sensors in ("low", "medium", "high")
]


def holm(p: list[float]) -> list[float]:
    """Holm's correction for as many tests as there are."""
    found, least = np.empty(len(p)), 0.0
    for rank, index in enumerate(np.argsort(p)):
        least = max(least, min((len(p) - rank) * p[index], 1.0))
        found[index] = least
    return found.tolist()


def test_the_table_of_evolution_with_damage() -> None:
    published = Published(FULL)
    found = report_rows("With damage")
    assert [row[:2] for row in found] == [
        [where, network] for where in PLACES for network in ("Hebbian", "MLP")
    ]
    for where, network, *told in found:
        with_damage, without = (
            published.cells(condition(where, network, damage=damage)) for damage in (True, False)
        )
        assert told == [*with_damage[:3], without[0]], (where, network)


def test_the_speeds_beside_those_of_the_authors() -> None:
    found = {name: told for name, *told in report_rows("Beside the authors' own numbers")}
    published = Published(FULL)
    for network in ("Hebbian", "MLP"):
        both = np.array(
            [
                np.median(published.runs[condition(where, network, damage=True)], axis=0)
                for where in PLACES
            ]
        )
        speed, unseen = ([f"{x:.1f}" for x in column] for column in both.T)
        assert found[f"{network}, damage, ours"] == speed
        assert found[f"{network}, damage, ours on 40 terrains"] == unseen


def test_what_the_report_says_of_damage_in_words() -> None:
    text = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("## With damage")[1]
    words = " ".join(text.split("\n## ")[0].split())
    published = Published(FULL)
    ratios, p_ratio, p_network, falls, p_falls, rises, p_rises = ([] for _ in range(7))
    with zipfile.ZipFile(FULL / "tables.zip") as archive:
        for where in PLACES:
            without, damaged, static = (
                np.array(published.runs[condition(where, network, damage=damage)])
                for network, damage in (("Hebbian", False), ("Hebbian", True), ("MLP", True))
            )
            ratios.append(np.median(damaged[:, 0]) / np.median(without[:, 0]))
            p_ratio.append(stats.mannwhitneyu(damaged[:, 0], without[:, 0]).pvalue)
            p_network.append(stats.mannwhitneyu(damaged[:, 1], static[:, 1]).pvalue)
            whole, after = (
                [
                    per_run(
                        archive, f"{condition(where, 'Hebbian', damage=damage)}/recovery.csv", name
                    )
                    for damage in (False, True)
                ]
                for name in ("speed_undamaged", "speed_after")
            )
            falls.append(1 - np.median(whole[1]) / np.median(whole[0]))
            rises.append(np.median(after[1]) - np.median(after[0]))
            p_falls.append(stats.mannwhitneyu(*whole).pvalue)
            p_rises.append(stats.mannwhitneyu(*after).pvalue)
    assert f"they have {min(ratios):.2f} to {max(ratios):.2f} of the speed" in words
    low, *others = (f"{p:.1g}" for p in holm(p_ratio))
    assert f"(Holm's p {low} for the biped with few sensors, {others[0]} elsewhere)" in words
    assert set(others) == {others[0]}
    assert f"(p {min(p_network[:3]):.1g} and more," in words
    few, medium, high = (f"{p:.1g}" for p in holm(p_network)[3:])
    assert f"few sensors (Holm's p {few}), static ones with medium and high sensors" in words
    assert f"({medium} and {high})" in words
    more = [1, 2, 4, 5]  # places with more than few sensors
    assert f"{100 * min(falls[k] for k in more):.0f} to {100 * max(falls):.0f} %" in words
    assert f"(Holm's p {max(holm(p_falls)[k] for k in more):.1g} at most)" in words
    told = [f"{edge(rises[k] for k in more):.2f}" for edge in (min, max)]
    assert f"(medians {told[0]} to {told[1]} m/s higher," in words
    assert f"Holm's p {min(holm(p_rises)[k] for k in more):.2g} and more" in words


def test_robots_that_evolved_without_damage_are_faster_with_it() -> None:
    text = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("go faster than those")[1]
    words = " ".join(text.split())
    told, p = [], []
    with zipfile.ZipFile(FULL / "tables.zip") as archive:
        for where in PLACES:
            names = [condition(where, "Hebbian", damage=damage) for damage in (False, True)]
            table = "evaluation-hilly-3-30-half-40-seed0.csv"
            speeds = [per_run(archive, f"{name}/{table}", "speed") for name in names]
            told.append(" against ".join(f"{np.median(own):.1f}" for own in speeds))
            p.append(float(stats.mannwhitneyu(*speeds).pvalue))
    _, medium, high, _, *worms = told
    assert f"(on 40 terrains {medium} and {high} m/s, worms {' and '.join(worms)};" in words
    assert f"Holm's p {', '.join(f'{holm(p)[k]:.1g}' for k in (1, 2, 4, 5))})" in words


def test_the_share_of_speed_that_damage_leaves() -> None:
    text = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("### After the damage")[1]
    found: dict[bool, list[float]] = {True: [], False: []}
    for name in ("recovery", "unforeseen"):
        for row in rows(FULL / "figures" / f"{name}.csv"):
            shares = [100 * float(row[f"share_{side}"]) for side in ("first", "second")]
            found[row["where"].endswith("low")] += shares
    words = " ".join(text.split())
    few, more = (f"{min(own):.0f} to {max(own):.0f} %" for own in found.values())
    assert f"with few sensors {few} of the speed, with more {more}" in words


def test_the_table_of_what_damage_leaves() -> None:
    found = {where: told for where, *told in report_rows("After the damage")}
    assert list(found) == PLACES
    with zipfile.ZipFile(FULL / "tables.zip") as archive:
        for column, damage in ((0, False), (3, True)):
            p = []
            for where, told in found.items():
                left = []
                for cell, network in zip(told[column:], ("Hebbian", "MLP"), strict=False):
                    table = f"{condition(where, network, damage=damage)}/recovery.csv"
                    after = per_run(archive, table, "speed_after")
                    whole = per_run(archive, table, "speed_undamaged")
                    assert len(after) == len(whole) == 10
                    assert cell == f"{np.median(after):.2f} of {np.median(whole):.1f}", table
                    left.append(after)
                p.append(float(stats.mannwhitneyu(*left).pvalue))
            assert [told[column + 2] for told in found.values()] == [f"{x:.2g}" for x in holm(p)]
