import re
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "app" / "python" / "examples"


def run(name, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], capture_output=True, text=True)


def test_the_planner_reaches_the_renal_artery(cache, tmp_path, program):
    result = run("plan_renal.py", "--out", tmp_path / "plan", "--cache", cache)
    assert result.returncode == 0 and "\nreached: " in result.stdout, result.stdout + result.stderr
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")
    again = subprocess.run([program, "run", "renal", "--commands", tmp_path / "plan.gw", "--out", tmp_path / "out", "--frames",
                            "none", "--cache", cache, "--expect", tmp_path / "plan.gw"], capture_output=True, text=True)
    assert again.returncode == 0 and "all equal" in again.stdout and "target reached" in again.stdout, again.stderr


def test_the_linear_model_finds_tips_that_it_was_not_fitted_to(cache, tmp_path):
    result = run("find_tip.py", "--out", tmp_path / "tip", "--cache", cache, "--frames", 300)
    assert result.returncode == 0, result.stderr
    error = float(re.search(r"error of the tip ([\d.]+) pixels", result.stdout)[1])
    guess = float(re.search(r"mean place: ([\d.]+) pixels", result.stdout)[1])
    assert error < 0.25 * guess
    assert (tmp_path / "tip.png").exists() and (tmp_path / "tip.npz").exists()
