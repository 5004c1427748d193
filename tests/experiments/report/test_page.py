"""`hebbtorch report`: one file, read back here and looked at in a browser where there is one."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from experiments.analysis.recorder import record
from experiments.report.page.episode_data import episode_data
from experiments.report.page.write import write_page
from tests.experiments.champions import PLASTIC, STATIC, random_champions, run_folder
from tests.experiments.finished_runs import write_csv, write_evaluation, write_freezing

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


class References(HTMLParser):
    """Collects what a page refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value or "" for name, value in attrs if name in ("src", "href")]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two champions with all that a page can show."""
    folder = run_folder(tmp_path_factory.mktemp("page"))
    rows = [
        (k, g, 1.0 * g + k, 0.5 * g, 0.5 * g, 0.75 * g, 8 * g, g) for g in (1, 2, 3) for k in (0, 1)
    ]
    columns = ["run", "generation", "best", "median", "mean", "q75", "evaluations", "seconds"]
    write_csv(folder / "history.csv", columns, rows)
    write_evaluation(folder, PLASTIC, [[1.0, 2.0, 3.0], [2.0, 4.0, float("nan")]])
    write_freezing(folder, [[0.0, 1.0], [0.5, 2.0]])
    return folder


@pytest.fixture(scope="module")
def page(run: Path) -> Path:
    return write_page(run, run.parent / "page.html")


def data_of(page: Path) -> dict:
    text = page.read_text(encoding="utf-8")
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.S)
    assert found is not None
    return json.loads(found.group(1))


def unpacked(packed: dict) -> np.ndarray:
    """As the scripts do it."""
    import base64
    import zlib

    flat = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), packed["type"])
    with np.errstate(over="ignore"):
        values = np.cumsum(flat.reshape(packed["shape"]), axis=0, dtype=packed["type"])
    return values * packed["scale"]


def test_the_page_needs_nothing_else(page: Path) -> None:
    references = References()
    references.feed(page.read_text(encoding="utf-8"))
    assert all(each.startswith("data:") for each in references.found)
    assert "MIT License" in page.read_text(encoding="utf-8")  # of the library within


def test_an_episode_is_what_was_recorded() -> None:
    champions = random_champions()
    course = record(PLASTIC, champions.genomes[1], every=2, weights_every=0.25)
    data = episode_data(course, "it", inside=True)
    corners = unpacked(data["outlines"])
    assert corners.shape == (len(course.times), 3, 4, 2)
    assert corners.mean(axis=(1, 2)) == pytest.approx(course.centers, abs=0.05)
    assert unpacked(data["actuation"]) == pytest.approx(course.actuation, abs=0.5 / 127)
    all_activations = np.concatenate(course.activations, axis=1).clip(-1, 1)  # noise leads beyond
    assert unpacked(data["activations"]) == pytest.approx(all_activations, abs=0.5 / 127 + 1e-6)
    for layer, weights in zip(data["layers"], course.weights, strict=True):
        levels = unpacked(layer["levels"])
        assert np.sign(levels) * levels**2 * layer["largest"] == pytest.approx(
            weights, abs=0.02 * layer["largest"]
        )
    assert data["weight_times"] == pytest.approx([0, 0.25, 0.5, 0.75, 1.0], abs=0.04)
    assert data["momentary"][-1] == pytest.approx(course.speed, abs=0.2)


def test_a_run_shows_its_champion_intact_damaged_and_frozen(page: Path) -> None:
    data = data_of(page)
    names = [each["name"] for each in data["episodes"]]
    assert names[:2] == ["champion", "damaged"]
    assert names[2].startswith("weights frozen at ")
    broken = [unpacked(each["broken"]) for each in data["episodes"]]
    assert [bool(each.any()) for each in broken] == [False, bool(broken[1].any()), False]
    assert data["episodes"][0]["layers"]
    assert not data["episodes"][1]["layers"]  # once is enough
    assert set(data["charts"]) == {"fitness", "freezing"}
    assert data["charts"]["freezing"]["curves"][0]["y"] == [0.25, 1.5]
    assert data["charts"]["fitness"]["curves"][0]["y"] == [1.5, 2.5, 3.5]


def test_static_champions_have_no_weights_to_show(tmp_path: Path) -> None:
    data = data_of(write_page(run_folder(tmp_path, STATIC)))
    assert [each["name"] for each in data["episodes"]] == ["champion", "damaged"]


def test_a_campaign_shows_its_conditions(run: Path, tmp_path: Path) -> None:
    root = tmp_path / "root"
    shutil.copytree(run, root / "conditions" / "one")
    text = write_page(root).read_text(encoding="utf-8")
    assert "worm-3x1" in text
    assert "paper&#x27;s claims" in text
    data = data_of(root / "report.html")
    assert data["charts"]["curves-0"]["curves"][0]["y"] == [1.5, 2.5, 3.5]
    assert [each["name"] for each in data["episodes"]] == ["worm-3x1 high, η = 0.2"]
    assert data["episodes"][0]["layers"]


def test_champions_of_a_campaign_act_beside_each_other(tmp_path: Path) -> None:
    for name, config in (("plastic", PLASTIC), ("static", STATIC)):
        run_folder(tmp_path, config, name)
    episodes = data_of(write_page(tmp_path))["episodes"]
    assert sorted(each["name"] for each in episodes) == [
        "worm-3x1 high, MLP",
        "worm-3x1 high, η = 0.2",
    ]
    shown = "activations" in episodes[0], "activations" in episodes[1]
    assert shown == (True, False)  # of the first alone


@pytest.mark.parametrize(
    ("folder", "out", "message"),
    [
        ("nowhere", None, "run: expected the folder of a run or a campaign"),
        (".", "page.pdf", "out: expected a name ending in .html"),
        (".", "nowhere/page.html", "out: expected a name .* in an existing folder"),
        (".", None, "root: expected a run or a campaign with finished runs"),
    ],
)
def test_mistakes_are_told_and_nothing_is_written(
    tmp_path: Path, folder: str, out: str | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        write_page(tmp_path / folder, tmp_path / out if out else None)
    assert list(tmp_path.iterdir()) == []


def browse(page: Path, profile: Path, *options: str) -> str:
    command = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
        f"--user-data-dir={profile}", "--virtual-time-budget=10000", "--window-size=1100,900",
        *options, page.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_in_a_browser_there_is_no_error_and_the_robot_moves(page: Path, tmp_path: Path) -> None:
    pictures = []
    for time in ("0.10", "0.90"):
        here = tmp_path / f"{time}.html"
        here.write_text(
            page.read_text(encoding="utf-8").replace("location.hash", f"'#t={time}'"),
            encoding="utf-8",
        )
        shown = browse(here, tmp_path / "profile", "--dump-dom")
        assert 'data-ready="yes"' in shown
        assert "data-error" not in shown
        assert f'data-time="{time}"' in shown
        path = tmp_path / f"{time}.png"
        browse(here, tmp_path / "profile", f"--screenshot={path}")
        with Image.open(path) as image:
            pictures.append(np.asarray(image.convert("RGB")).astype(int))
    robot = np.abs(pictures[0] - pictures[1])[180:500]
    assert (robot.sum(axis=-1) > 60).sum() > 300
