"""Pages of the site that are made, when it is built, from files elsewhere in the repository."""

from __future__ import annotations

import os
import posixpath
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]

# A file of the repository -> its page.
PAGES = {
    "physics/MODEL.md": "concepts/model.md",
    "physics/FIDELITY.md": "fidelity.md",
    "experiments/bench/RESULTS.md": "speed.md",
    "experiments/results/REPORT.md": "results.md",
    "experiments/results/ATTRACTORS.md": "attractors.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
COMMANDS_PAGE = "reference/commands.md"
RESULTS_PAGE = "results.md"
REPORTS = "experiments/results/*/figures/REPORT.md"  # a section for each claim of the paper
_RUN = "import hebbtorch_command; hebbtorch_command.main()"
_PICTURES = (".png", ".gif", ".svg")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]*)(#[^)\s]*)?\)")
_CLAIM = re.compile(r"^## (\d+[a-z]?)\. (.+)$", re.MULTILINE)
_SCALE = re.compile(r"(\d+) run\(s\) of each; (\d+) generations")
_UNMEASURED = "- nothing measured"
_VERDICT = re.compile(r"\*\*Verdict\*\*: (\w+)")


def on_files(files: Files, config: Any) -> Files:
    """Adds the pages, with the pictures that they show."""
    pages = {
        page: [((ROOT / source).read_text(encoding="utf-8"), source)]
        for source, page in PAGES.items()
    }
    claims = _claims()
    pages[RESULTS_PAGE] += [(_index(claims), "")]
    pages |= {_claim_page(number): page.parts() for number, page in claims.items()}
    shown = {file.src_uri for file in files}
    for page, parts in pages.items():
        moved = [_moved(text, source, page) for text, source in parts]
        content = "\n".join(text for text, _ in moved)
        files.append(File.generated(config, page, content=content))
        for picture in set().union(*(pictures for _, pictures in moved)) - shown:
            path = str(ROOT / picture)
            files.append(File.generated(config, picture, abs_src_path=path))
            shown.add(picture)
    files.append(File.generated(config, COMMANDS_PAGE, content=_commands()))
    return files


@dataclass(frozen=True)
class _Page:
    """What the campaigns say on a claim.

    Attributes:
        title: The claim.
        campaigns: Name of a campaign, the largest first -> the file and its section on the claim.
    """

    title: str
    campaigns: dict[str, tuple[str, str]]

    def parts(self) -> list[tuple[str, str]]:
        """The page's parts, each with the file that it is from; campaigns that measured come
        first, the others are named."""
        measured = {name: own for name, own in self.campaigns.items() if _UNMEASURED not in own[1]}
        others = [name for name in self.campaigns if name not in measured]
        parts = [(f"# {self.title}\n", "")]
        for name, (source, text) in measured.items():
            parts.append((f"## Campaign {name}\n\n{text}\n", source))
        if others:
            parts.append((f"\nNot measured in: {', '.join(others)}.\n", ""))
        return parts

    def verdict(self, name: str) -> str:
        """That of a campaign, or a dash where it measured nothing."""
        text = self.campaigns[name][1]
        match = _VERDICT.search(text)
        return match[1] if match and _UNMEASURED not in text else "-"


def _claims() -> dict[str, _Page]:
    """Number of a claim -> its page."""
    pages: dict[str, _Page] = {}
    for name, path in _campaigns().items():
        source = path.relative_to(ROOT).as_posix()
        start, *sections = _CLAIM.split(path.read_text(encoding="utf-8"))
        scale = start.strip().split("\n\n")[1]
        for number, claim, body in zip(*(sections[k::3] for k in range(3)), strict=True):
            page = pages.setdefault(number, _Page(f"Claim {number}: {claim}", {}))
            page.campaigns[name] = (source, f"{scale}\n\n{body.strip()}")
    return pages


def _campaigns() -> dict[str, Path]:
    """Name of each campaign, those with more runs and generations first -> its report."""
    found = []
    for path in ROOT.glob(REPORTS):
        match = _SCALE.search(path.read_text(encoding="utf-8"))
        assert match, path
        runs, generations = map(int, match.groups())
        found.append((-runs, -generations, path.parents[1].name, path))
    return {name: path for *_, name, path in sorted(found)}


def _index(claims: dict[str, _Page]) -> str:
    """The table of the claims' pages."""
    names = list(_campaigns())
    rows = [
        "## Claim by claim",
        "",
        "A dash: not measured.",
        "",
        f"| claim | {' | '.join(names)} |",
        "|---" * (1 + len(names)) + "|",
    ]
    for number, page in claims.items():
        words = page.title.removeprefix("Claim ")
        verdicts = " | ".join(page.verdict(name) for name in names)
        rows.append(f"| [{words}](docs/{_claim_page(number)}) | {verdicts} |")
    return "\n".join(rows) + "\n"


def _claim_page(number: str) -> str:
    return f"results/claim-{number}.md"


def _moved(text: str, source: str, page: str) -> tuple[str, set[str]]:
    """A file's text with links that hold on its page, and the pictures that it shows.

    Links to what the site does not have become plain text.
    """
    pictures: set[str] = set()

    def link(match: re.Match[str]) -> str:
        mark, words, target, anchor = match.groups()
        if not target or ":" in target:
            return match[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
        if path.startswith("docs/"):
            path = path.removeprefix("docs/")
        elif path in PAGES:
            path = PAGES[path]
        elif path.endswith(_PICTURES):
            pictures.add(path)
        else:
            return f"{words} (`{path}`)"
        there = posixpath.relpath(path, posixpath.dirname(page) or ".")
        return f"{mark}[{words}]({there}{anchor or ''})"

    return _LINK.sub(link, text), pictures


def _commands() -> str:
    """The help of every command."""
    top = _help()
    names = re.search(r"\{([a-z,]+)\}", top)
    assert names, top
    parts = ["# Command line", "", "```text", top, "```"]
    for name in names[1].split(","):
        parts += ["", f"## hebbtorch {name}", "", "```text", _help(name), "```"]
    return "\n".join(parts) + "\n"


def _help(*command: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", _RUN, *command, "--help"],
        env={**os.environ, "COLUMNS": "88", "NO_COLOR": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.rstrip()
