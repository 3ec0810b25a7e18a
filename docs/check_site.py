#!/usr/bin/env python3
"""docs/check_site.py FOLDER: fails where a link, an anchor or a picture of a site's pages leads nowhere in the folder."""

import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    """The anchors of a page, and what it links to."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.targets = set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.anchors.update(value for key, value in attrs if key in ("id", "name") and value)
        if tag == "a" and values.get("href"):
            self.targets.append(values["href"])
        if tag in ("img", "script") and values.get("src"):
            self.targets.append(values["src"])


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    found = {path: Page(path) for path in sorted(folder.rglob("*.html")) if path.name != "404.html"}
    faults = 0
    for path, page in found.items():
        for target in page.targets:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            file = file / "index.html" if file.is_dir() else file
            anchor = urllib.parse.unquote(parts.fragment)
            known = found.get(file)
            if not file.is_file() or (anchor and known and anchor not in known.anchors):
                print(f"{path.relative_to(folder)}: '{target}' leads nowhere")
                faults += 1
    print(f"{len(found)} pages of the site, {faults} links that lead nowhere")
    return 1 if faults or not found else 0


if __name__ == "__main__":
    sys.exit(main())
