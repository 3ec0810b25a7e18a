"""Mutants of tests/mutants.txt: applies, builds, runs them. tests/mutants.sh says how it is called."""

import concurrent.futures
import dataclasses
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent
LIST = "tests/mutants.txt"
HOME = SOURCE / "build" / "mutants"
TREE = HOME / "tree"
BUILD = TREE / "build" / "release"
SEED = HOME / "cache"  # what tests without a mutant have kept; each mutant has a copy of its own
JOBS = int(os.environ.get("JOBS", os.cpu_count() or 1))

HEADER = """#pragma once
/// Which mutant this process has.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <thread>
#include <unistd.h>

namespace mutant {
inline const std::thread::id main_thread = std::this_thread::get_id();
inline bool broken(const char* id) {
    static const char* const chosen = std::getenv("SELDINGER_MUTANT");
    return chosen != nullptr && std::strcmp(chosen, id) == 0;
}
inline std::string cache() {
    const char* const folder = std::getenv("SELDINGER_MUTANT_CACHE");
    return folder != nullptr ? folder : "/nonexistent";
}
}  // namespace mutant
"""


class Wrong(Exception):
    """Said to whoever runs this, without a trace."""


@dataclasses.dataclass
class Mutant:
    id: str
    line: int
    row: str = ""
    files: list = dataclasses.field(default_factory=list)
    manual: str = ""
    as_text: bool = False
    seconds: float = 0
    tests: list = dataclasses.field(default_factory=list)
    changes: list = dataclasses.field(default_factory=list)  # file, old and new text

    def wrong(self, what):
        return Wrong(f"{LIST}:{self.line}: [{self.id}]: {what}")


def read_list():
    mutants = []
    before = ""  # kind of the line before
    for number, line in enumerate((SOURCE / LIST).read_text().splitlines(), 1):
        kind, _, rest = line.partition(" ")
        if line.startswith("[") and line.endswith("]"):
            mutants.append(Mutant(line[1:-1], number))
        elif not line or line.startswith("#"):
            kind = ""
        elif not mutants:
            raise Wrong(f"{LIST}:{number}: expected [NAME] before it, found '{line}'")
        else:
            at = mutants[-1]
            if kind == "row":
                at.row = rest
            elif kind == "file":
                at.files.append(rest)
            elif kind == "test":
                at.tests.append(rest)
            elif kind == "seconds":
                at.seconds = float(rest)
            elif kind == "manual":
                at.manual = rest
            elif kind == "as" and rest == "text":
                at.as_text = True
            elif kind == "-" and at.files:
                if before == "-":
                    at.changes[-1][1] += "\n" + rest
                else:
                    at.changes.append([at.files[-1], rest, ""])
            elif kind == "+" and at.changes:
                at.changes[-1][2] += ("\n" if before == "+" else "") + rest
            else:
                raise Wrong(f"{LIST}:{number}: '{line}' was found; expected row, file, test, -, +, seconds, as text or manual")
        before = kind
    ids = [m.id for m in mutants]
    for mutant in mutants:
        if ids.count(mutant.id) > 1:
            raise mutant.wrong("the name is there twice")
        if not (mutant.row and mutant.files and mutant.tests and mutant.changes):
            raise mutant.wrong("expected a row, a file, a test and a change")
        for *_, new in mutant.changes:
            if "BROKEN" not in new and not (mutant.as_text or mutant.manual):
                raise mutant.wrong("expected BROKEN in the new text")
    return mutants


def switch(mutant, file):
    if file.endswith(".py"):
        return f'(__import__("os").environ.get("SELDINGER_MUTANT") == "{mutant.id}")'
    return f'::mutant::broken("{mutant.id}")'


def find(mutant, file, text, old):
    count = text.count(old)
    if count != 1:
        raise mutant.wrong(f"{file} has the old text {count} times, expected once:\n{old}")
    return text.index(old)


def changed_files(mutants):
    """The text of each file with all its mutants in it."""
    by_file = {}
    for mutant in mutants:
        for file, old, new in mutant.changes:
            by_file.setdefault(file, []).append((mutant, old, new))
    files = {}
    for file, changes in by_file.items():
        path = SOURCE / file
        if not path.is_file():
            raise changes[0][0].wrong(f"{file}: no such file")
        text = path.read_text()
        places = []
        for mutant, old, new in changes:
            at = find(mutant, file, text, old)
            if not (mutant.as_text or mutant.manual):
                places.append((at, at + len(old), new.replace("BROKEN", switch(mutant, file)), mutant))
        if not places:
            continue
        places.sort(key=lambda place: place[0])
        for one, other in zip(places, places[1:]):
            if other[0] < one[1]:
                raise other[3].wrong(f"its old text overlaps that of [{one[3].id}]")
        for begin, end, new, _ in reversed(places):
            text = text[:begin] + new + text[end:]
        files[file] = text if file.endswith(".py") else '#include "mutant.h"\n' + text
    return files


def program_of_tests():
    """The program, or the file of Python, of each test in the source."""
    programs = {}
    for path in sorted((SOURCE / "tests").rglob("*_test.cpp")):
        part = path.relative_to(SOURCE / "tests").parts[0]
        program = {"app": "app_tests", "frames": "frame_tests", "window": "window_tests", "studies": "study_tests"}.get(
            part, "unit_tests")
        for suite, name in re.findall(r"\nTEST(?:_F|_P)?\(([A-Za-z0-9_]+),\s*([A-Za-z0-9_]+)\)", path.read_text()):
            programs[f"{suite}.{name}"] = program
    for path in sorted((SOURCE / "tests" / "python").glob("test_*.py")):
        for name in re.findall(r"\ndef (test_\w+)\(", path.read_text()):
            programs[name] = str(path.relative_to(SOURCE))
    return programs


def write_if_other(path, content):
    """Keeps the time of what stays, so that it is not built again."""
    if path.is_file() and not path.is_symlink() and path.read_bytes() == content:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.write_bytes(content)


def make_tree(mutants):
    files = changed_files(mutants)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, check=True, capture_output=True, text=True).stdout
    names = [name for name in listed.split("\0") if name]
    for name in names:
        source, to = SOURCE / name, TREE / name
        if source.is_symlink():
            to.parent.mkdir(parents=True, exist_ok=True)
            if not to.is_symlink():
                to.symlink_to(os.readlink(source))
            continue
        if not source.is_file():
            continue
        if name in files:
            content = files[name].encode()
        else:
            content = source.read_bytes()
            if name.startswith("tests/") and name.endswith((".cpp", ".h")):
                content = with_own_cache(content.decode()).encode()
        write_if_other(to, content)
        mode = source.stat().st_mode
        if to.stat().st_mode != mode:
            to.chmod(mode)
    kept = set(names)
    for top in TREE.iterdir():
        for path in [] if top.name == "build" else [top] if top.is_file() else top.rglob("*"):
            if path.is_file() and str(path.relative_to(TREE)) not in kept | {"mutant.h"}:
                path.unlink()
    write_if_other(TREE / "mutant.h", HEADER.encode())


def with_own_cache(text):
    """Tests keep vessels in build/cache of the source; here each mutant has a cache of its own."""
    other = text
    for written in ('std::string(SELDINGER_SOURCE) + "/build/cache"', 'SELDINGER_SOURCE "/build/cache"'):
        other = other.replace(written, "::mutant::cache()")
    return other if other == text else '#include "mutant.h"\n' + other


def build(targets):
    log = HOME / "build.log"
    steps = [["cmake", "--preset", "release"],
             ["cmake", "--build", "build/release", "--parallel", str(JOBS), "--target", *targets]]
    with log.open("w") as output:
        for step in steps:
            if subprocess.run(step, cwd=TREE, stdout=output, stderr=subprocess.STDOUT).returncode != 0:
                tail = "\n".join(log.read_text().splitlines()[-40:])
                raise Wrong(f"{tail}\n{' '.join(step)} failed; the whole log is in {log}")


def commands_for(tests, programs):
    """What runs the tests, by program."""
    by_program = {}
    for test in tests:
        by_program.setdefault(programs[test], []).append(test)
    commands = []
    for program, names in by_program.items():
        if program.endswith(".py"):
            commands.append((names, [sys.executable if shutil.which("/usr/bin/python3") is None else "/usr/bin/python3",
                                     "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", str(TREE / program), "-k",
                                     " or ".join(names)]))
        else:
            names_of_all = ":".join(f"{n}:*/{n}/*:{n}/*" for n in names)
            commands.append((names, [str(BUILD / "bin" / program), "--gtest_filter=" + names_of_all]))
    return commands


def copied(seed, to):
    """Links, which are as quick as they are small: what is kept is replaced, never written into."""
    to.mkdir(parents=True)
    for path in seed.rglob("*") if seed.is_dir() else []:
        if path.is_file() and not path.is_symlink() and not path.name.startswith("."):
            place = to / path.relative_to(seed)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.link(path, place)


def run(tests, programs, mutant, cache, limit):
    """Runs the tests; returns the names of those that failed, what else ended them, and what was said."""
    failed, how, said = [], "", ""
    scratch = Path(tempfile.mkdtemp(prefix="mutant."))
    environment = {**os.environ, "SELDINGER_MUTANT_CACHE": str(cache), "SELDINGER_TEST_CACHE": str(cache / "python"),
                   "XDG_CACHE_HOME": str(cache / "home"), "XDG_DATA_HOME": str(scratch), "XDG_CONFIG_HOME": str(scratch),
                   "TMPDIR": str(scratch), "SELDINGER_PROGRAM": str(BUILD / "bin" / "seldinger"),
                   "PYTHONPATH": str(TREE / "build" / "python"), "PYTHONDONTWRITEBYTECODE": "1",
                   "MESA_SHADER_CACHE_DISABLE": "true"}
    environment.pop("SELDINGER_MUTANT", None)
    if mutant:
        environment["SELDINGER_MUTANT"] = mutant.id
    try:
        for names, command in commands_for(tests, programs):
            with tempfile.TemporaryFile("w+", errors="replace") as output:
                process = subprocess.Popen(command, cwd=TREE, env=environment, stdin=subprocess.DEVNULL, stdout=output,
                                           stderr=subprocess.STDOUT, start_new_session=True)
                try:
                    process.wait(limit)
                except subprocess.TimeoutExpired:
                    how = f"hangs beyond {limit:.0f} s"
                finally:
                    try:
                        os.killpg(process.pid, signal.SIGKILL)
                    except ProcessLookupError:
                        pass
                    process.wait()
                output.seek(0)
                text = output.read()
            said += text
            if not how and command[0].endswith("python3"):
                failed += re.findall(r"^(?:FAILED|ERROR) \S*?::(test_\w+)", text, re.M)
                if process.returncode not in (0, 1):
                    how = f"pytest ends with {process.returncode}"
                if process.returncode == 0 and not re.search(r"\d+ passed", text):
                    how = "not run"
            elif not how:
                failed += re.findall(r"^\[  FAILED  \] ([\w/]+\.[\w/]+)(?:,| \()", text, re.M)
                if not re.search(r"^\[  PASSED  \]|^\[  FAILED  \]", text, re.M):
                    how = f"ends with {process.returncode}"
                if process.returncode == 0 and not re.search(r"^\[       OK \]", text, re.M):
                    how = "not run"
            if failed or how:
                break
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return list(dict.fromkeys(failed)), how, said


def main(words):
    mutants = read_list()
    if words == ["--check"]:
        files = changed_files(mutants)
        programs = program_of_tests()
        for mutant in mutants:
            for test in mutant.tests:
                if not mutant.manual and test not in programs:
                    raise mutant.wrong(f"no such test: {test}")
        print(f"{len(mutants)} mutants in {len(files)} files")
        return 0
    chosen = [m for m in mutants if not words or any(m.id.startswith(word) for word in words)]
    for word in words:
        if not any(m.id.startswith(word) for m in mutants):
            raise Wrong(f"no mutant's name begins with '{word}'")
    programs = program_of_tests()
    manual = [m for m in chosen if m.manual]
    chosen = [m for m in chosen if not m.manual]
    tests = list(dict.fromkeys(test for m in chosen for test in m.tests))
    for mutant in chosen:
        for test in mutant.tests:
            if test not in programs:
                raise mutant.wrong(f"no such test: {test}")
    print(f"{len(chosen)} mutants, {len(tests)} tests; building {TREE.relative_to(SOURCE)}", flush=True)
    HOME.mkdir(parents=True, exist_ok=True)
    make_tree(mutants)
    used = {programs[test] for test in tests}
    targets = {p for p in used if not p.endswith(".py")} | {"seldinger"}
    if used & {"app_tests"}:
        targets.add("seldinger-study")
    if any(p.endswith(".py") for p in used):
        targets.add("python")
    build(sorted(targets))

    # Without a mutant all pass; what they keep is what mutants begin with.
    SEED.mkdir(exist_ok=True)
    took = {}

    def plain(test):
        start = time.monotonic()
        failed, how, said = run([test], programs, None, SEED, 1800)
        took[test] = time.monotonic() - start
        return test, failed, how, said

    bad = []
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        for test, failed, how, said in pool.map(plain, tests):
            if failed or how:
                (HOME / f"{test}.log").write_text(said)
                bad.append(f"{test}: {how or 'fails'}")
    if bad:
        print("without a mutant:\n  " + "\n  ".join(bad) + f"\n(said: {HOME}/TEST.log)", flush=True)
    unusable = {line.split(":")[0] for line in bad}

    caches = HOME / "caches"
    shutil.rmtree(caches, ignore_errors=True)

    def with_mutant(mutant):
        own = [test for test in mutant.tests if test not in unusable]
        if not own:
            return mutant, False, "its tests do not pass without it"
        cache = caches / mutant.id
        copied(SEED, cache)
        before = {}
        for file, old, new in mutant.changes if mutant.as_text else []:
            path = TREE / file
            text = path.read_text()
            before.setdefault(path, (text, path.stat()))
            at = find(mutant, file, text, old)
            path.write_text(text[:at] + new + text[at + len(old):])
        try:
            failed, how, said = run(own, programs, mutant, cache,
                                    mutant.seconds or 60 + 8 * max(took[test] for test in own))
        finally:
            for path, (text, state) in before.items():
                path.write_text(text)
                os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
            shutil.rmtree(cache, ignore_errors=True)
        caught = bool(failed) or (bool(how) and how != "not run")
        (HOME / "said").mkdir(exist_ok=True)
        (HOME / "said" / f"{mutant.id}.txt").write_text(said)
        return mutant, caught, ", ".join(failed) or how or "-"

    rows = []
    width = max((len(m.id) for m in chosen), default=0)

    def tell(result):
        mutant, caught, by = result
        rows.append((mutant.id, mutant.row, ("" if caught else "NOT CAUGHT ") + by))
        print(f"{mutant.id:{width}}  {rows[-1][2]}", flush=True)
        return caught

    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        caught = [tell(r) for r in pool.map(with_mutant, [m for m in chosen if not m.as_text])]
    caught += [tell(with_mutant(m)) for m in chosen if m.as_text]
    for mutant in manual:
        rows.append((mutant.id, mutant.row, f"by hand: {mutant.manual}"))
        print(f"{mutant.id:{width}}  {rows[-1][2]}")
    table = "| mutant | promise | caught by |\n| --- | --- | --- |\n"
    table += "".join(f"| {a} | {b} … | {c} |\n" for a, b, c in rows)
    (HOME / "table.md").write_text(table)
    print(f"{sum(caught)} of {len(chosen)} caught, {len(manual)} left to be run by hand: {HOME.relative_to(SOURCE)}/table.md")
    return 0 if all(caught) and not bad else 1


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Wrong as wrong:
        print(wrong, file=sys.stderr)
        sys.exit(2)
