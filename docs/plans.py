"""All exercises planned from their scenario alone, beside the solutions that ship; and patients nobody has seen.

    python3 docs/plans.py build/release/bin/seldinger FOLDER [--cache CACHE] [--only NAME ...] [--patients]

Plans each exercise into FOLDER/NAME, or goes on there, plays its solution, and prints the table of docs/plan.md.
--patients plans patients of renal_right, cerebral and coronary_right instead, ten each, from seeds that no
exercise has. A whole run takes about an hour on two cores.
"""

import argparse
import json
import pathlib
import re
import resource
import subprocess
import time

UNSEEN = {"renal_right": range(1001, 1011), "cerebral": range(2001, 2011), "coronary_right": range(3001, 3011)}


def planned(program, name, folder, cache, patient=None):
    """The best of a plan, and processor time [s] where it was made now."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.monotonic()
    command = [program, "plan", name, "--out", folder, "--threads", "2", "--cache", cache]
    if patient:
        command += ["--patient", patient]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        return None, done.stderr.strip().splitlines()[-1], 0
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    timing = pathlib.Path(folder) / "time.json"
    if "made before" not in done.stdout:
        timing.write_text(json.dumps({"processor_s": spent, "wall_s": time.monotonic() - begun}))
    best = json.loads((pathlib.Path(folder) / "plan.json").read_text())["ranked"][0]
    return best, "", json.loads(timing.read_text())["processor_s"] if timing.exists() else spent


def shipped(program, name, folder, cache):
    """Score of the solution that ships."""
    subprocess.run([program, "run", name, "--commands", "solution", "--frames", "none", "--out", folder, "--cache", cache],
                   check=False, capture_output=True)
    return json.loads((pathlib.Path(folder) / "score.json").read_text())


def why(best):
    if best["refused"]:
        return best["refused"]
    if best.get("failures"):
        one = best["failures"][0]
        return f'{one["device"]} {one["ends"]} in {one["branch"]}'
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cache", default="")
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--patients", action="store_true")
    given = parser.parse_args()
    cache = given.cache or str(given.folder / "cache")
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.patients:
        print("| exercise | seed | reached | success | force, N | turns | processor, s |\n|---|---|---|---|---|---|---|")
        for name, seeds in UNSEEN.items():
            for seed in seeds:
                best, problem, spent = planned(given.program, name, str(given.folder / f"{name}-{seed}"), cache, f"seed:{seed}")
                if best is None:
                    print(f"| {name} | {seed} | {problem} | | | | |", flush=True)
                elif best["reached"]:
                    print(f'| {name} | {seed} | yes | {best["hands_reach"]}/10, {best["played_reach"]}/5 | '
                          f'{best["peak_wall_force_N"]:.2f} | {best["turns"]} | {spent:.0f} |', flush=True)
                else:
                    print(f'| {name} | {seed} | no: {why(best)} | | | | {spent:.0f} |', flush=True)
        return
    listed = subprocess.run([given.program, "list"], check=True, capture_output=True, text=True).stdout
    names = [line.split()[0] for line in listed.splitlines()[1:] if re.match(r"\w", line)]
    print("| exercise | reached | off by 5 % | at the keys | force, N (shipped) | travel, mm (shipped) | turns | processor, s |\n"
          "|---|---|---|---|---|---|---|---|")
    for name in names:
        if given.only and name not in given.only:
            continue
        best, problem, spent = planned(given.program, name, str(given.folder / name), cache)
        if best is None:
            print(f"| {name} | {problem} | | | | | | |", flush=True)
            continue
        score = shipped(given.program, name, str(given.folder / f"{name}-shipped"), cache)
        if not best["reached"]:
            print(f'| {name} | no, {abs(best["left_mm"]):.0f} mm left: {why(best)} | | | | | | {spent:.0f} |', flush=True)
            continue
        print(f'| {name} | yes | {best["hands_reach"]}/10 | {best["played_reach"]}/5 | '
              f'{best["peak_wall_force_N"]:.2f} ({score["peak_wall_force_N"]:.2f}) | '
              f'{best["travel_mm"]:.0f} ({score["wire_travel_mm"]:.0f}) | {best["turns"]} | {spent:.0f} |', flush=True)


if __name__ == "__main__":
    main()
