"""The real Gymnasium, where it is: SELDINGER_GYMNASIUM names the folder of its sources, else it is imported. Debian 12 has
no package of it; python3-cloudpickle is all that it needs besides NumPy."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

import seldinger as sd

FOLDER = os.environ.get("SELDINGER_GYMNASIUM")
HERE = Path(__file__).resolve().parent


@pytest.mark.parametrize("name", list(sd.gym.ENVIRONMENTS))
def test_make_vec_of_gymnasium_works_in_all_modes_and_equals_ours(cache, name):
    if not FOLDER and importlib.util.find_spec("gymnasium") is None:
        pytest.skip("gymnasium is not installed, and SELDINGER_GYMNASIUM names no folder of its sources")
    path = [FOLDER] if FOLDER else []
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([*path, os.environ.get("PYTHONPATH", "")]))
    ended = subprocess.run([sys.executable, HERE / "gymnasium_modes.py", name, "60", str(cache)], env=environment,
                           capture_output=True, text=True)
    assert ended.returncode == 0 and "equal" in ended.stdout, ended.stderr[-3000:]
