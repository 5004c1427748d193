"""Every Python block of the README and of the documentation runs, and claims have their pages."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
WITH_CODE = [page for page in PAGES if BLOCK.search(page.read_text(encoding="utf-8"))]
REPORTS = ROOT.glob("experiments/results/*/figures/REPORT.md")
CAMPAIGNS = sorted(path.parents[1].name for path in REPORTS)  # those packed so far
HISTORY = "run,generation,best,median,mean,q75,evaluations,seconds\n0,1,0.5,0.1,0.2,0.3,4,1.0\n"

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_blocks_of_a_page_run_one_after_the_other(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "runs" / "first"  # as `make run` leaves it, for pages that read it
    run.mkdir(parents=True)
    (run / "history.csv").write_text(HISTORY)
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    names: dict[str, object] = {"__name__": "__main__"}
    for block in BLOCK.finditer(text):
        line = text.count("\n", 0, block.start(1))
        code = "\n" * line + block[1]  # so that errors name the line of the page
        exec(compile(code, str(page), "exec"), names)


def test_pages_with_code_are_found() -> None:
    assert ROOT / "README.md" in WITH_CODE
    assert len(WITH_CODE) >= 5
    assert {"first-scale", "ten-runs"} <= set(CAMPAIGNS)


def test_every_claim_has_a_page_with_what_each_campaign_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("mkdocs")
    from experiments.report.claims.paper import CLAIMS

    spec = importlib.util.spec_from_file_location("hooks", ROOT / "docs" / "hooks.py")
    assert spec is not None
    assert spec.loader is not None
    hooks = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "hooks", hooks)
    spec.loader.exec_module(hooks)
    pages = hooks._claims()
    assert sorted(pages) == sorted(claim.number for claim in CLAIMS)
    largest_first = ["full-scale", "controls", "ten-runs", "first-scale"]
    assert [name for name in hooks._campaigns() if name in largest_first] == largest_first
    for number, claim in pages.items():
        page = f"results/claim-{number}.md"
        assert f"](docs/{page})" in hooks._index(pages)
        (title, _), *parts = claim.parts()
        assert title.startswith(f"# Claim {number}: ")
        measured = [text.split()[2] for text, _ in parts if text.startswith("## Campaign ")]
        others = [name for name in hooks._campaigns() if name not in measured]
        assert sorted(measured + others) == CAMPAIGNS
        assert [name for name in others if claim.verdict(name) != "-"] == []
        if others:
            assert parts.pop()[0].strip() == f"Not measured in: {', '.join(others)}."
        for text, source in parts:
            assert "hebbtorch campaign" in text
            _, pictures = hooks._moved(text, source, page)
            assert all((ROOT / picture).is_file() for picture in pictures)
    assert pages["6"].verdict("full-scale") == "supported"
