"""Puts a page together: one file that holds its style, scripts and data."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from typing import Any

__all__ = ["page", "picture", "section", "table"]

_ASSETS = files("experiments.report.page") / "assets"


def page(title: str, sections: Iterable[str], data: Any = None) -> str:
    """A whole page.

    Args:
        title: The title of the page, plain text.
        sections: The sections of the page, HTML.
        data: what the scripts draw, ready for JSON; None for a page without scripts.
    """
    body = "\n".join(sections)
    scripts = ""
    if data is not None:
        # "</" would end the script element.
        text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
        scripts = (
            f"<script>{_asset('uPlot.iife.min.js')}</script>\n"
            f'<script id="data" type="application/json">{text}</script>\n'
            f"<script>{_asset('robot.js')}</script>\n<script>{_asset('page.js')}</script>"
        )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n"
        f"<style>{_asset('uPlot.min.css')}{_asset('page.css')}</style></head>\n"
        f"<body><main><h1>{escape(title)}</h1>\n{body}\n"
        f"<footer>Made by hebbtorch. Curves are drawn by uPlot:<details><summary>licence"
        f"</summary><pre>{escape(_asset('uPlot-LICENSE'))}</pre></details></footer></main>\n"
        f"{scripts}</body></html>\n"
    )


def section(heading: str, *parts: str, note: str = "") -> str:
    """A part of a page under a heading; plain text in heading and note, HTML in the parts."""
    explained = f"<p class='note'>{escape(note)}</p>" if note else ""
    return f"<section><h2>{escape(heading)}</h2>{explained}{''.join(parts)}</section>"


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table of plain texts and numbers; numbers are set to the right."""
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    whole = f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
    return f"<div class='scroll'>{whole}</div>"


def picture(png: bytes, words: str) -> str:
    """A picture with what it shows."""
    content = base64.b64encode(png).decode()
    return (
        f"<figure><img alt='{escape(words, quote=True)}' src='data:image/png;base64,{content}'>"
        f"<figcaption>{escape(words)}</figcaption></figure>"
    )


def _cell(value: Any) -> str:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    text = f"{value:.3g}" if isinstance(value, float) else str(value)
    return f"<td{' class=number' if is_number else ''}>{escape(text)}</td>"


def _asset(name: str) -> str:
    return (_ASSETS / name).read_text(encoding="utf-8")
