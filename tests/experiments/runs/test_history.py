"""history.csv: closed forms, exact numbers, cut back to the rows on resume."""

import csv
import math
from pathlib import Path

import torch

from experiments.runs.history import History, HistoryRow


def row(generation: int, best: float = 0.1) -> HistoryRow:
    return HistoryRow(0, generation, best, 0.2, -0.3, 1 / 3, 8 * generation, 1.5 * generation)


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_row_summarises_a_population() -> None:
    fitness = torch.tensor([3.0, torch.nan, 1.0, 5.0, 2.0, 4.0], dtype=torch.float64)
    # Without the failed one: 1 2 3 4 5, whose upper quartile is 4.
    assert HistoryRow.of(2, 7, fitness, 9.5) == HistoryRow(2, 7, 5.0, 3.0, 3.0, 4.0, 42, 9.5)


def test_quartile_and_median_are_interpolated() -> None:
    summary = HistoryRow.of(0, 1, torch.tensor([0.0, 1.0, 2.0, 10.0], dtype=torch.float64), 0.0)
    assert (summary.median, summary.q75, summary.mean) == (1.5, 4.0, 3.25)


def test_a_population_that_failed_as_a_whole_has_no_fitness() -> None:
    summary = HistoryRow.of(0, 1, torch.full((4,), torch.nan), 0.0)
    assert all(math.isnan(x) for x in (summary.best, summary.median, summary.mean, summary.q75))
    assert summary.evaluations == 4


def test_file_has_the_agreed_columns_and_exact_numbers(tmp_path: Path) -> None:
    path, history = tmp_path / "history.csv", History()
    history.write(path)
    history.append([row(1, 0.1 + 0.2)], path)
    assert path.read_text().splitlines()[0] == (
        "run,generation,best,median,mean,q75,evaluations,seconds"
    )
    (line,) = read(path)
    assert float(line["best"]) == 0.1 + 0.2
    assert float(line["q75"]) == 1 / 3
    assert (line["run"], line["generation"], line["evaluations"]) == ("0", "1", "8")


def test_what_is_beyond_the_rows_is_cut_off(tmp_path: Path) -> None:
    path, history = tmp_path / "history.csv", History()
    history.write(path)
    history.append([row(1)], path)
    saved = history.to_tensor()
    history.append([row(2)], path)
    with path.open("a") as file:
        file.write("0,3,0.4")  # torn by a kill
    History.from_tensor(saved).write(path)
    assert [line["generation"] for line in read(path)] == ["1"]


def test_tensor_keeps_rows_exactly() -> None:
    rows = [row(1, 0.1 + 0.2), row(2, 1e-300)]
    assert History.from_tensor(History(rows).to_tensor()).rows == rows
    assert History.from_tensor(History().to_tensor()).rows == []
