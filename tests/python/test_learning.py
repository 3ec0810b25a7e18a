"""PPO of Stable-Baselines3 learns to leave the introducer and to reach the aorta, within a minute of processor time. A label of
its own: ctest --test-dir build/release -L learning. SELDINGER_GYMNASIUM and SELDINGER_SB3 name folders of sources."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "app" / "python" / "examples" / "train_ppo.py"


def test_ppo_reaches_the_aorta_in_a_minute(cache, tmp_path):
    folders = [os.environ[name] for name in ("SELDINGER_GYMNASIUM", "SELDINGER_SB3") if os.environ.get(name)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([os.environ["PYTHONPATH"], *folders])}
    there = subprocess.run([sys.executable, "-c", "import gymnasium, stable_baselines3"], env=environment, capture_output=True)
    if there.returncode != 0:
        pytest.skip("gymnasium and stable_baselines3 are not installed, and no variable names their sources")
    trained = subprocess.run([sys.executable, EXAMPLE, "--minutes", "1", "--patients", "1", "--unseen", "0", "--cache", cache,
                              "--out", tmp_path], env=environment, capture_output=True, text=True)
    assert trained.returncode == 0, trained.stderr
    with open(tmp_path / "curve.csv") as file:
        returns = [float(row["mean_return"]) for row in csv.DictReader(file)]
    print("mean returns", returns)
    # A hundredth for each mm of the way, a mean of the last hundred episodes, of which the first went nowhere. The aorta begins
    # 100 mm beyond where the wire starts.
    assert returns[-1] > 0.8 and returns[-1] > returns[0] + 0.5
