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
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
COMMANDS_PAGE = "reference/commands.md"
_RUN = "import hebbtorch_command; hebbtorch_command.main()"
_PICTURES = (".png", ".gif", ".svg")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Adds the pages, with the pictures that they show."""
    for source, page in PAGES.items():
        text, pictures = _moved((ROOT / source).read_text(encoding="utf-8"), source, page)
        files.append(File.generated(config, page, content=text))
        for picture in pictures - {file.src_uri for file in files}:
            path = str(ROOT / picture)
            files.append(File.generated(config, picture, abs_src_path=path))
    files.append(File.generated(config, COMMANDS_PAGE, content=_commands()))
    return files


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
