"""Hooks of MkDocs (`make docs`): the order of the kinds of page, and links that leave `docs/`."""

import os
import re
from pathlib import Path
from typing import Any

ORDER = ("index.md", "Tutorials", "How-to", "Reference", "Explanation", "Results", "Decisions")
TITLES = {"Tutorial": "Tutorials", "How to": "How-to"}
LINK = re.compile(r"\[([^\]]*)\]\((?!#|[a-z]+:)([^)#\s]+)(#[^)\s]*)?\)")


def on_nav(nav: Any, **_: Any) -> Any:
    """The sections as `docs/index.md` lists them. Raises ValueError on a section without a place in the order."""
    for item in nav.items:
        if item.is_section:
            item.title = TITLES.get(item.title, item.title)
    nav.items.sort(key=lambda item: ORDER.index(item.file.src_uri if item.is_page else item.title))
    return nav


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Links to files beside `docs/` become the file's path from the root: the site holds the pages alone."""
    docs = Path(config["docs_dir"])
    here = (docs / page.file.src_uri).parent

    def inside(link: re.Match[str]) -> str:
        target = Path(os.path.normpath(here / link[2]))
        if target.is_relative_to(docs) and not target.is_dir():
            return link[0]
        path = target.relative_to(docs.parent) if target.is_relative_to(docs.parent) else target
        return f"`{path}`" if link[1].strip("`") in (path.name, str(path)) else f"{link[1]} (`{path}`)"

    blocks = re.split(r"(?ms)(^ *```.*?^ *```$)", markdown)
    return "".join(block if number % 2 else LINK.sub(inside, block) for number, block in enumerate(blocks))
