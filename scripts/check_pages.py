#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the pages: every link leads to a file (and heading) of the repository, every page is reached from doc/index.md.

Exit code 1 where one is not. Usage: check_pages.py [REPOSITORY]
"""
import re
import sys
from pathlib import Path

ROOT = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def anchors(page):
    """The headings as GitHub names them; code blocks hold none."""
    names = set()
    for line in page.read_text().splitlines():
        if line.startswith("#"):
            title = line.lstrip("#").strip().lower().replace("`", "")
            names.add(re.sub(r"[^\w\- ]", "", title).replace(" ", "-"))
    return names


def main():
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"] + sorted((ROOT / "doc").rglob("*.md"))
    links, bad = {}, []
    for page in pages:
        links[page] = set()
        text = "\n".join(line for line in page.read_text().splitlines() if not line.startswith("    "))
        text = re.sub(r"`[^`\n]*`", "", text)
        for target in LINK.findall(text):
            if target.startswith(("http://", "https://")):
                continue
            path, _, anchor = target.partition("#")
            file = (page.parent / path).resolve() if path else page
            if not file.exists():
                bad.append(f"{page.relative_to(ROOT)}: {target}: no such file")
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                bad.append(f"{page.relative_to(ROOT)}: {target}: no such heading")
            links[page].add(file)
    reached, todo = set(), [ROOT / "doc/index.md"]
    while todo:
        page = todo.pop()
        if page not in reached:
            reached.add(page)
            todo += [p for p in links.get(page, ()) if p in links]
    bad += [f"{page.relative_to(ROOT)}: not reached from doc/index.md" for page in pages if page not in reached]
    pictures = {p for found in links.values() for p in found}
    bad += [f"{p.relative_to(ROOT)}: no page shows it" for p in sorted((ROOT / "doc").rglob("*.png")) if p not in pictures]
    print("\n".join(bad) or f"{len(pages)} pages, {sum(map(len, links.values()))} links: all valid")
    return 1 if bad else 0


sys.exit(main())
