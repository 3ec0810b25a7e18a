#!/usr/bin/env python3
"""tests/documents.py [PROGRAM]: checks README.md and the manual, and says every fault with its file and line.

- Every link leads to a file, and to a heading in it; every picture is there and not empty.
- Every command line `seldinger ...` in code names a command, options and an exercise that the program has.
- Blocks marked as console show what the program prints, where that is quick to find out.
- README.md has at most 150 lines.
- Questions that many have find their answer among the first three pages of a search.

Without PROGRAM the commands are not checked. Needs no network and writes nothing but to a folder of its own.
"""

import collections
import math
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
README_LINES = 150
# Commands whose output is known within a second; others in console blocks are not run.
QUICK = re.compile(r"seldinger (--version|list( devices| straight)?|run straight .*--frames none|(score|replay) hello/run.gw)")

# What people search for, and the sections that answer it; any of them will do.
SEARCHES = {
    "branch ends": ("docs/faq.md#where-does-a-branch-leave-its-parent-and-where-does-it-end",
                    "docs/author/own-mesh.md#where-a-branch-leaves-its-parent-and-where-it-ends"),
    "target radius": ("docs/faq.md#what-target-radius-is-good",),
    "where does the solution go": ("docs/faq.md#where-does-the-solution-go",),
    "units": ("docs/faq.md#which-units-does-seldinger-use",),
    "left and right": ("docs/faq.md#left-and-right-whose-are-they-and-what-are-the-axes",
                       "docs/author/own-mesh.md#axes-left-and-right"),
}

LINK = re.compile(r"(!?)\[(?:[^\[\]]|\[[^\]]*\])*\]\(<?([^()\s<>]+(?:\([^()]*\))?[^()\s<>]*)>?(?:\s+\"[^\"]*\")?\)")
PROMPT = re.compile(r"^\s*(?:\$ )?(?:[A-Z_]+=\S+ )*((?:\S*/)?seldinger(?: .*)?)$")


def pages():
    """All documents of the repository."""
    found = [ROOT / name for name in ("README.md", "CONTRIBUTING.md")]
    for folder in ("docs", "assets", "physics", "tests", "examples"):
        found += sorted((ROOT / folder).rglob("*.md"))
    return found


class Page:
    """A document: its lines of prose, its blocks of code, the anchors of its headings."""

    def __init__(self, path):
        self.path = path
        self.name = str(path.relative_to(ROOT))
        self.prose, self.code, self.consoles = [], [], []  # (line number, text); a console is a list of them
        self.anchors = set()
        self.sections = []  # [anchor, heading, text]
        fence, blank, indented = None, True, False
        for number, line in enumerate(path.read_text(encoding="utf-8").split("\n"), 1):
            if self.sections:
                self.sections[-1][2] += line + "\n"
            mark = re.match(r"\s*(```+|~~~+)\s*(\w*)", line)
            if mark and (fence is None or line.strip().startswith(fence)):
                fence = None if fence else mark.group(1)
                if fence and mark.group(2) == "console":
                    self.consoles.append([])
                self.in_console = bool(fence) and mark.group(2) == "console"
                continue
            if fence:
                self.code.append((number, line))
                if self.in_console:
                    self.consoles[-1].append((number, line))
                continue
            indented = line.startswith("    ") and (blank or indented)
            blank = not line.strip()
            if indented and not blank:
                self.code.append((number, line))
                continue
            self.prose.append((number, line))
            if heading := re.match(r"#{1,6}\s+(.*?)\s*#*$", line):
                self.sections.append([self.add_anchor(heading.group(1)), heading.group(1), ""])
            self.anchors.update(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", line))

    def add_anchor(self, heading):
        """As GitHub makes them."""
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
        slug = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
        name, k = slug, 1
        while name in self.anchors:
            name, k = f"{slug}-{k}", k + 1
        self.anchors.add(name)
        return name

    def links(self):
        """(line number, is a picture, target) of every link that leads to this repository."""
        for number, line in self.prose:
            for picture, target in LINK.findall(re.sub(r"`[^`]*`", "code", line)):
                if not re.match(r"[a-z]+:", target):
                    yield number, bool(picture), target

    def command_lines(self):
        """(line number, text) of each command line of the program, its continued lines joined."""
        joined = None
        for number, line in self.code:
            if joined:
                joined = (joined[0], joined[1] + " " + line.strip().rstrip("\\"))
            elif match := PROMPT.match(line.rstrip("\\")):
                joined = (number, match.group(1))
            if joined and not line.endswith("\\"):
                yield joined
                joined = None
        for number, line in self.prose:
            for code in re.findall(r"`(seldinger [a-z][^`…]*)`", line):
                yield number, code


def link_faults(all_pages):
    """Links and pictures that lead nowhere."""
    by_path = {page.path: page for page in all_pages}
    for page in all_pages:
        for number, picture, target in page.links():
            file, _, anchor = target.partition("#")
            path = (page.path.parent / file).resolve() if file else page.path
            where = f"{page.name}:{number}"
            if not path.is_file():
                yield f"{where}: expected a file, found none at '{target}'"
            elif picture and path.stat().st_size < 100:
                yield f"{where}: expected a picture, found none in '{target}'"
            elif anchor and path in by_path and anchor not in by_path[path].anchors:
                yield f"{where}: '{file or page.name}' has no heading '#{anchor}'"


def search(all_pages, query):
    """The best section of each page for a query, best first, ranked much as the site's search does: BM25, a word of a
    heading counts a thousand times, and a section with all words twice."""
    def words(text):
        return collections.Counter(re.findall(r"[^\W_]+", text.lower()))

    sections = [(f"{page.name}#{anchor}", words(heading), words(text))
                for page in all_pages for anchor, heading, text in page.sections]
    terms = words(query).keys() - {"a", "and", "does", "is", "the", "what", "where", "which"}
    means = [sum(section[field].total() for section in sections) / len(sections) for field in (1, 2)]
    rarities = {term: math.log(1 + len(sections) / (1 + sum(term in heading or term in text for _, heading, text in sections)))
                for term in terms}
    scores = collections.defaultdict(lambda: (0, ""))
    for name, heading, text in sections:
        score = 0
        for term, rarity in rarities.items():
            for field, mean, boost in ((heading, means[0], 1000), (text, means[1], 1)):
                length = 0.3 + 0.9 * field.total() / mean
                score += boost * rarity * 2.2 * field[term] / (length + field[term])
        score *= 2 if all(term in heading or term in text for term in terms) else 1
        page = name.split("#")[0]
        scores[page] = max(scores[page], (score, name))
    return [name for score, name in sorted(scores.values(), reverse=True) if score > 0]


def search_faults(all_pages):
    """Questions whose answer is not among the first three pages that a search shows."""
    for query, answers in SEARCHES.items():
        found = search(all_pages, query)
        if not set(answers) & set(found[:3]):
            yield f"expected {' or '.join(answers)} among the first three pages for '{query}', found {', '.join(found[:3])}"


class Program:
    """What the program says of its commands, asked once each."""

    def __init__(self, path):
        self.path, self.helps = str(pathlib.Path(path).resolve()), {}
        self.scratch = tempfile.TemporaryDirectory()
        self.exercises = {line.split()[0] for line in self.run("list").split("\n")[1:] if line.strip()}
        self.studies = {line.split()[0] for line in self.run("study").split("\n") if re.match(r"[a-z][a-z-]+ ", line)}

    def run(self, *arguments):
        environment = dict(os.environ, HOME=self.scratch.name, XDG_DATA_HOME=self.scratch.name,
                           XDG_CACHE_HOME=self.scratch.name, LC_ALL="C.UTF-8")
        return subprocess.run([self.path, *arguments], capture_output=True, text=True, timeout=60, check=False,
                              cwd=self.scratch.name, env=environment, stdin=subprocess.DEVNULL).stdout

    def help_of(self, words):
        """(sub-commands, options) of a command."""
        if words not in self.helps:
            text = self.run(*words, "--help")
            below = text.split("\nOptions:\n")[-1] if re.search(r"^Usage: .* COMMAND ", text, re.M) else ""
            options = set()
            for line in text.split("\n"):
                if match := re.match(r"\s+(-[^\s]+)", line):
                    options.update(name.split(":")[0] for name in match.group(1).split(","))
            self.helps[words] = (set(re.findall(r"^  ([a-z]+)(?:  |$)", below, re.M)), options)
        return self.helps[words]

    def fault(self, line, own):
        """What is wrong with a command line, or None; `own` are names of exercises that the manual makes."""
        try:
            words = shlex.split(re.split(r"\s[|>;]|\s2>|\s&&|\s&$", line)[0], comments=True)[1:]
        except ValueError as error:
            return str(error)
        if not words or words[0] in ("--help", "--version", "COMMAND"):
            return None
        command = ()
        while words and words[0] in self.help_of(command)[0]:
            command += (words.pop(0),)
        if command == ("study",) and not self.studies:
            return None  # seldinger-study, which knows them, is not built
        below, options = self.help_of(command)
        if not command or (below and words and not words[0].startswith("-")):
            return f"expected a command of 'seldinger{''.join(' ' + w for w in command)}', found '{words[0]}'"
        for word in words:
            if re.match(r"--?[a-z]", word) and word.split("=")[0] not in options:
                return f"'seldinger {' '.join(command)}' has no option '{word}'"
        first = words[0] if words else ""
        if re.fullmatch(r"[a-z][a-z_0-9]*", first):
            if command[0] in ("run", "play", "show", "render", "serve", "author", "check") and first not in self.exercises | own:
                return f"expected an exercise that ships, found '{first}'"
            if command == ("study",) and self.studies and first not in self.studies | {"all", "merge"}:
                return f"expected a study, found '{first}'"
        return None


def command_faults(all_pages, program):
    """Command lines that the program would refuse."""
    lines = [(page, number, line) for page in all_pages for number, line in page.command_lines()]
    own = {match.group(1) for _, _, line in lines if (match := re.search(r"seldinger new (\w+)", line))}
    if not program.exercises:
        yield f"expected exercises of '{program.path} list', found none"
    if len(lines) < 100:
        yield f"expected more than 100 command lines in the manual, found {len(lines)}"
    for page, number, line in lines:
        if fault := program.fault(line, own):
            yield f"{page.name}:{number}: {line.strip()}: {fault}"


def console_faults(all_pages, program):
    """Lines of console blocks that quick commands do not print, in their order; `…` stands for anything."""
    checked = 0
    for page in all_pages:
        for console in page.consoles:
            printed = None
            for number, line in console:
                if line.startswith("$ "):
                    command = line[2:].strip()
                    printed = program.run(*shlex.split(command)[1:]).split("\n") if QUICK.fullmatch(command) else None
                elif printed is not None and line.strip() not in ("", "…"):
                    pattern = ".*".join(map(re.escape, line.rstrip().split("…")))
                    found = next((k for k, text in enumerate(printed) if re.fullmatch(pattern, text.rstrip())), None)
                    checked += 1
                    if found is None:
                        yield f"{page.name}:{number}: '{command}' does not print '{line}' there"
                    else:
                        printed = printed[found + 1:]
    if not checked:
        yield "expected lines of output in the console blocks of the manual, found none"


def main():
    all_pages = [Page(path) for path in pages()]
    faults = [*link_faults(all_pages), *search_faults(all_pages)]
    count = len((ROOT / "README.md").read_text(encoding="utf-8").split("\n")) - 1
    if count > README_LINES:
        faults.append(f"README.md: expected at most {README_LINES} lines, found {count}")
    if len(sys.argv) > 1:
        program = Program(sys.argv[1])
        faults += command_faults(all_pages, program)
        faults += console_faults(all_pages, program)
    print("\n".join(faults) if faults else f"{len(all_pages)} documents: links, pictures and commands are right")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
