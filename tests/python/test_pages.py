"""Pages of the manual: those made of what the module says, recipes and the notebook, which run."""

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import seldinger as sd

PAGES = Path(__file__).resolve().parents[2] / "docs" / "python"


def maker(file):
    spec = importlib.util.spec_from_file_location(file.stem, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", sd.gym.ENVIRONMENTS)
def test_the_page_of_an_environment_says_what_the_module_says(name, cache):
    made = maker(PAGES / "environments.py")
    path = PAGES / "environments" / f"{made.short(name).lower()}.md"
    env = sd.gym.make(name, cache=cache)
    assert path.read_text() == made.page(name, env), "run docs/python/environments.py"
    env.close()


def blocks(page):
    """Each block of Python of a page, and the text that the page says it prints."""
    return re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```\n)?", (PAGES / page).read_text(), re.S)


@pytest.mark.parametrize("page", ["start.md", "environments.md", "cookbook.md", "other-simulators.md"])
def test_recipes_run_and_print_what_their_page_says(page, cache, tmp_path):
    (tmp_path / "seldinger").symlink_to(cache)
    assert blocks(page)
    for code, printed in blocks(page):
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True,
                              env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
        assert done.returncode == 0, done.stderr
        assert done.stdout == printed, code


def test_the_notebook_runs_and_shows_what_it_says(cache, tmp_path):
    (tmp_path / "seldinger").symlink_to(cache)
    script = ("import importlib.util, json; spec = importlib.util.spec_from_file_location('notebook', %r); "
              "made = importlib.util.module_from_spec(spec); spec.loader.exec_module(made); "
              "print(json.dumps(made.run(json.loads(made.FILE.read_text()))))") % str(PAGES / "notebook.py")
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True,
                          env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
    assert done.returncode == 0, done.stderr

    def texts(notebook):
        return [[(one.get("text") or one["data"]["text/plain"], sorted(one.get("data", ()))) for one in cell.get("outputs", ())]
                for cell in notebook["cells"]]
    assert texts(json.loads(done.stdout)) == texts(json.loads((PAGES / "tour.ipynb").read_text())), "run docs/python/notebook.py"


def test_ways_of_exercises_are_those_of_their_vessels(cache):
    made = maker(PAGES.parent / "exercises_ways.py")
    stated = json.loads(made.FILE.read_text())
    assert set(stated) == set(sd.scenarios()), "run docs/exercises_ways.py, then docs/exercises.py"
    for name in ("renal", "bifurcation", "s_bend"):
        with sd.Simulation(name, cache=cache) as sim:
            way, passed, turns = made.way(sim)
        assert stated[name] == {"way": way, "passed": passed, "turns": turns}, name
