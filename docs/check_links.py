"""Local links of the built site: `python docs/check_links.py build/site` names those that lead nowhere, and fails."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The anchors of a page, and its links."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str | None] = set()
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Note the id, and where `href` and `src` lead."""
        found = dict(attributes)
        self.anchors |= {found.get("id"), found.get("name")}
        self.links += [link for link in (found.get("href"), found.get("src")) if link]


def broken(root: Path) -> list[str]:
    """``page: link`` for each local link to a file or an anchor that does not exist."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(root.resolve().rglob("*.html"))}
    if not pages:
        raise SystemExit(f"{root} has no pages: build the site first")
    found = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            goal = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            goal = goal / "index.html" if goal.is_dir() else goal
            anchor = unquote(parts.fragment)
            if not goal.exists() or (anchor and goal in pages and anchor not in pages[goal].anchors):
                found.append(f"{path.relative_to(root.resolve())}: {link}")
    return found


if __name__ == "__main__":
    failures = broken(Path(sys.argv[1]))
    print("\n".join(failures) or "every local link leads somewhere")
    sys.exit(bool(failures))
