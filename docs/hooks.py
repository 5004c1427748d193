"""Pages of the site that are made, when it is built, from files elsewhere in the repository."""

from __future__ import annotations

import os
import posixpath
import re
import subprocess
import sys
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
_VERDICT = re.compile(r"\*\*Verdict\*\*: (\w+)")


def on_files(files: Files, config: Any) -> Files:
    """Adds the pages, with the pictures that they show."""
    pages = {
        page: [((ROOT / source).read_text(encoding="utf-8"), source)]
        for source, page in PAGES.items()
    }
    claims = _claims()
    pages[RESULTS_PAGE] += [(_index(claims), "")]
    pages |= {_claim_page(number): parts for number, parts in claims.items()}
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


def _claims() -> dict[str, list[tuple[str, str]]]:
    """Number of a claim -> the parts of its page, each with the file that it is from."""
    pages: dict[str, list[tuple[str, str]]] = {}
    for path in sorted(ROOT.glob(REPORTS)):
        source = path.relative_to(ROOT).as_posix()
        start, *sections = _CLAIM.split(path.read_text(encoding="utf-8"))
        scale = start.strip().split("\n\n")[1]
        for number, claim, body in zip(*(sections[k::3] for k in range(3)), strict=True):
            heading = f"## Campaign {path.parents[1].name}\n\n{scale}\n\n{body.strip()}\n"
            page = pages.setdefault(number, [(f"# Claim {number}: {claim}\n", source)])
            page.append((heading, source))
    return pages


def _index(claims: dict[str, list[tuple[str, str]]]) -> str:
    """The table of the claims' pages."""
    names = sorted(path.parents[1].name for path in ROOT.glob(REPORTS))
    rows = [
        "## Claim by claim",
        "",
        f"| claim | {' | '.join(names)} |",
        "|---" * (1 + len(names)) + "|",
    ]
    for number, ((title, _), *parts) in claims.items():
        words = title.removeprefix("# Claim ").strip()
        verdicts = [match[1] if (match := _VERDICT.search(text)) else "" for text, _ in parts]
        rows.append(f"| [{words}](docs/{_claim_page(number)}) | {' | '.join(verdicts)} |")
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
