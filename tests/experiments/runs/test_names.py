"""Names of a run's files."""

from pathlib import Path

from experiments.runs import names


def test_files_of_earlier_versions_are_found_by_their_present_names(tmp_path: Path) -> None:
    assert names.present(tmp_path, names.RECORDING_MEASURES) is None
    (tmp_path / "inner_life.json").touch()
    assert names.present(tmp_path, names.RECORDING_MEASURES) == tmp_path / "inner_life.json"
    (tmp_path / "recording.json").touch()
    assert names.present(tmp_path, names.RECORDING_MEASURES) == tmp_path / "recording.json"
    assert names.present(tmp_path, names.PRUNING) is None
