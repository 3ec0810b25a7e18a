#!/bin/sh
# app/python.sh: sets up, builds the Python module into build/python, and prints ten steps of an exercise.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh python
./app/build.sh release python
python=/usr/bin/python3
[ -x "$python" ] || python=python3
PYTHONPATH=build/python PYTHONDONTWRITEBYTECODE=1 "$python" - <<'STEPS'
import seldinger as sd

print(f"seldinger {sd.__version__} from {sd.__file__}")
with sd.Simulation("s_bend", cache="build/python/cache") as sim:
    for _ in range(10):
        s = sim.step(advance_mm=2, rotate_deg=5)
        print(f"frame {s.frame}: {s.inserted_mm:.1f} mm inside, {s.path_to_target_mm:.1f} mm to go, "
              f"push {s.push_N:.3f} N, wall {s.wall_force_N:.3f} N, hash {s.hash:016x}")
STEPS
printf 'In Python: PYTHONPATH=%s %s\n' "$PWD/build/python" "$python"
