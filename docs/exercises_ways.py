#!/usr/bin/env python3
"""Writes docs/exercises/ways.json: of each exercise the branches of the way from the device's tip at the start to the target,
and those that leave it, and where it turns from a branch into a child. docs/exercises.py puts them into the pages. Needs the built module:

    PYTHONPATH=build/python /usr/bin/python3 docs/exercises_ways.py [--cache FOLDER]
"""

import argparse
import json
from pathlib import Path

import numpy as np

import seldinger as sd

FILE = Path(__file__).resolve().parent / "exercises" / "ways.json"


def along(branch, place):
    """How far along the branch's centreline the nearest sample is, and how far outside its lumen the place [mm]."""
    points = branch["points_mm"]
    away = np.linalg.norm(points - place, axis=1)
    k = int((away - branch["radii_mm"]).argmin())
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return float(ways[k]), float((away - branch["radii_mm"])[k])


def nearest(branches, place):
    """The branch that a place lies deepest in, and how far along it."""
    found = [along(branch, place) for branch in branches]
    best = min(range(len(branches)), key=lambda i: found[i][1])
    return best, found[best][0]


def leaves_at(branches, i):
    return along(branches[branches[i]["parent"]], branches[i]["points_mm"][0])[0]


def way(sim):
    """Names of the branches of the way, in order; of those that leave it in between, as the tip passes them; and pairs of a
    branch and the child that the way turns into."""
    branches, state = sim.anatomy()["branches"], sim.state
    (start, at), (goal, to) = nearest(branches, state.tip_mm), nearest(branches, state.target_mm)

    def upward(i, place):
        """From a place on a branch to the root: branch, from, to."""
        made = []
        while i >= 0:
            made.append((i, place, 0.0))
            place, i = (leaves_at(branches, i) if branches[i]["parent"] >= 0 else 0.0), branches[i]["parent"]
        return made

    up, down = upward(start, at), upward(goal, to)
    shared = next(i for i, _, _ in up if i in {other for other, _, _ in down})
    stretches = []
    for i, place, _ in up:
        if i == shared:
            stretches.append((i, place, next(p for j, p, _ in down if j == shared)))
            break
        stretches.append((i, place, 0.0))
    for i, place, _ in reversed(down[:next(k for k, (j, _, _) in enumerate(down) if j == shared)]):
        stretches.append((i, 0.0, place))
    on = [i for i, _, _ in stretches]
    passed = []
    for i, first, last in stretches:
        here = [(leaves_at(branches, j), j) for j in range(len(branches)) if branches[j]["parent"] == i and j not in on]
        here = [(place, j) for place, j in here if min(first, last) <= place <= max(first, last)]
        passed += [j for _, j in sorted(here, reverse=last < first)]
    name = [branch["name"] for branch in branches]
    turns = [[name[i], name[j]] for i, j in zip(on, on[1:]) if branches[j]["parent"] == i]
    return [name[i] for i in on], [name[j] for j in passed], turns


def ways(cache):
    made = {}
    for name in sd.scenarios():
        with sd.Simulation(name, cache=cache) as sim:
            made[name] = dict(zip(("way", "passed", "turns"), way(sim)))
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cache", default=None)
    lines = [f'"{name}": {json.dumps(one)}' for name, one in ways(parser.parse_args().cache).items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    print(FILE)


if __name__ == "__main__":
    main()
