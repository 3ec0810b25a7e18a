#!/usr/bin/env python3
"""A planner that reaches the left renal artery by trying: it keeps the state, tries many motions from it at once, goes back,
and makes the best one.

    PYTHONPATH=build/python /usr/bin/python3 app/python/examples/plan_renal.py [--out plan]

Writes plan.png (the wire's tip on its way, on a subtraction image) and plan.gw, which `seldinger replay` shows."""

import argparse
import time

import numpy as np

import seldinger as sd

TURN, PUSH = 4, 10  # frames of a try that turn, and that push


def tries(rng, n, reach):
    """(frames, n, 1, 2) motions in mm and rad: a turn, then a push; the first one goes straight on."""
    motions = np.zeros((TURN + PUSH, n, 1, 2))
    turn = rng.uniform(-np.pi, np.pi, n)
    turn[0] = 0
    push = rng.uniform(0.5, 1.0, n) * reach / PUSH
    back = rng.random(n) < 0.3  # some draw back before they turn
    back[0] = False
    motions[:TURN, :, 0, 1] = turn / TURN
    motions[:TURN, :, 0, 0] = -np.where(back, 0.5 * push, 0.0)
    motions[TURN:, :, 0, 0] = push
    return motions


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="plan")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tries", type=int, default=24)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--cache", default=None)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    sim = sd.Simulation("renal", cache=options.cache)
    many = sd.VectorSimulation(sim, options.tries)
    state, trail, frames = sim.state, [sim.state.tip_mm], 0
    start = time.process_time()
    for number in range(options.rounds):
        snapshot = sim.snapshot()
        for i in range(options.tries):
            many.restore(i, snapshot)
        motions = tries(rng, options.tries, reach=np.clip(0.3 * state.path_to_target_mm, 8, 25))
        least = np.full(options.tries, np.inf)
        when = np.zeros(options.tries, int)
        for k, motion in enumerate(motions):
            many.step(motion)
            frames += options.tries
            cost = np.where(np.isnan(many.path_to_target_mm), 1e3, many.path_to_target_mm)
            cost = np.maximum(cost, many.tip_to_target_mm) + 5 * many.wall_force_N
            nearer = cost < least
            least[nearer], when[nearer] = cost[nearer], k
        chosen = int(least.argmin())
        for motion in motions[:when[chosen] + 1, chosen, 0]:
            state = sim.step(advance_mm=motion[0], rotate_deg=np.degrees(motion[1]))
            trail.append(state.tip_mm)
        print(f"round {number + 1}: {state.path_to_target_mm:6.1f} mm to go, in {state.branch}, "
              f"largest force {state.wall_force_N:.2f} N")
        if state.on_target:
            break
    while state.on_target and not state.completed:
        state = sim.step()
    score = sim.score()
    print(f"{'reached' if state.completed else 'not reached'}: {frames} frames tried and {state.frame + 1} made in "
          f"{time.process_time() - start:.0f} s of processor time; peak force {score['peak_wall_force_N']:.2f} N")
    sim.save(options.out + ".gw")
    picture = np.repeat(sim.image(512, mode="dsa")[..., None], 3, -1)
    picture[sim.masks(512)["vessels"] == 255, 2] = 255
    for colour, places in (((255, 160, 0), np.array(trail)), ((255, 0, 0), state.target_mm[None])):
        for x, y in sim.project(places, 512).astype(int):
            if 3 <= x < 509 and 3 <= y < 509:
                picture[y - 2:y + 3, x - 2:x + 3] = colour
    sd.write_png(options.out + ".png", picture)
    print(f"{options.out}.png, {options.out}.gw")
    return 0 if state.completed else 1


if __name__ == "__main__":
    raise SystemExit(main())
