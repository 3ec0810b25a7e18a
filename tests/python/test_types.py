"""The module's types: mypy --strict accepts the package and what a user writes with it, and finds what is wrong."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import seldinger as sd

MYPY = shutil.which("mypy")
PACKAGE = Path(sd.__file__).resolve().parent
USER = """
import copy
import numpy as np
import seldinger as sd
from seldinger.gym.sb3 import make_vec_env

sim = sd.Simulation("renal", set={"guidewire.friction": 0.1})
state = copy.deepcopy(sim).step(advance_mm=2)
length: float = state.catheter_inserted_mm + float(state.asdict()["time_s"])
env = sd.gym.make("seldinger/Renal-v1", obs=("tracking2d", "image"))
observation, info = env.reset(seed=7, options={"target": "RRA"})
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
total: float = reward + observation["tracking2d"].sum()
env.restore(env.snapshot())
many = sd.gym.make_vec("seldinger/Renal-v1", 4)
rewards: float = many.step(np.zeros((4, 1, 2)))[1].sum()
envs = make_vec_env("seldinger/Renal-v1", 4, seed=1)
with sd.VectorSimulation(sim, 3) as vector:
    depth: float = vector.tracks_mm[0, 0, 0, 2]
"""


def mypy(tmp_path, *arguments):
    (tmp_path / "seldinger").symlink_to(PACKAGE)
    return subprocess.run([MYPY, "--strict", "--cache-dir", str(tmp_path / "cache"), *arguments], cwd=tmp_path,
                          capture_output=True, text=True)


@pytest.mark.skipif(not MYPY, reason="mypy is not installed")
def test_the_package_is_strictly_typed(tmp_path):
    ended = mypy(tmp_path, "-p", "seldinger")
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.skipif(not MYPY, reason="mypy is not installed")
def test_what_a_user_writes_is_typed(tmp_path):
    (tmp_path / "user.py").write_text(USER)
    (tmp_path / "wrong.py").write_text("import seldinger as sd\nsd.Simulation('renal').step(advance=2)\n"
                                       "sd.gym.make('x').step()\nsd.gym.make_vec('x', 2).snapshot('y')\n")
    ended = mypy(tmp_path, "user.py", "wrong.py")
    found = [line for line in ended.stdout.splitlines() if line.startswith(("user.py", "wrong.py")) and "error" in line]
    assert [line.split(":")[:2] for line in found] == [["wrong.py", "2"], ["wrong.py", "3"], ["wrong.py", "4"]], ended.stdout
