#!/usr/bin/env python3
"""How hard each environment is for who knows nothing, and for a script: a table of the solutions that ship and of random actions.

    PYTHONPATH=build/python /usr/bin/python3 app/python/examples/baselines.py

Trained policies: train_ppo.py. Processor time is that of one core."""

import argparse
import contextlib
import re
import time

import numpy as np

import seldinger as sd


def of_random_actions(name, episodes, cache, model=None):
    """(share that reached the target, mean steps, mean largest force on the wall [N], steps a core-second)"""
    envs = sd.gym.make_vec(name, episodes, cache=cache, hashes=False, set=model)
    rng, start = np.random.default_rng(0), time.process_time()
    envs.reset(seed=0)
    ended, reached, steps, force = np.zeros(episodes, bool), np.zeros(episodes, bool), np.zeros(episodes, int), np.zeros(episodes)
    made = 0
    while not ended.all():
        _, _, terminated, truncated, info = envs.step(rng.uniform(-1, 1, envs.action_space.shape))
        made += episodes
        force = np.maximum(force, np.where(ended, 0, info["wall_force_N"]))
        steps += ~ended
        reached |= ~ended & terminated & info["success"]
        ended |= terminated | truncated
    envs.close()
    return reached.mean(), steps.mean(), force.mean(), made / (time.process_time() - start)


def solution(scenario):
    """The commands of each frame."""
    commands = {}
    for line in (sd.assets() / "scripts" / f"{scenario}.gw").read_text().splitlines():
        if line := re.sub(r"\s*#.*", "", line).strip():
            when, command = line.split(maxsplit=1)
            first, _, last = when.partition("..")
            for frame in range(int(first), int(last or first) + 1):
                commands.setdefault(frame, []).append(command)
    return commands


def of_solution(scenario, cache, model=None):
    """(whether it reached the target, frames, largest force on the wall [N], place of the tip, frames a core-second)"""
    commands, force = solution(scenario), 0.0
    with sd.Simulation(scenario, cache=cache, set=model, images=False) as sim:
        start = time.process_time()
        for frame in range(max(commands)):
            for command in commands.get(frame, []):
                sim.apply(command)
            state = sim.step()
            force = max(force, state.wall_force_N)
            if state.completed:
                break
        return state.completed, frame + 1, force, np.array(state.tip_mm), (frame + 1) / (time.process_time() - start)


def of_patients(name, patients, cache):
    """In how many patients of these seeds the solution of the exercise reaches the target, and random actions do."""
    own, scripted, random = sd.gym.ENVIRONMENTS[name], 0, 0
    commands, rng = solution(own["scenario"]), np.random.default_rng(0)
    for patient in patients:
        drawn = {**own.get("randomize", {}), "anatomy.seed": (patient, patient + 1)}
        with contextlib.closing(sd.gym.make(name, cache=cache, hashes=False, randomize=drawn)) as env:
            env.reset(seed=0)
            sim = env.simulation
            for frame in range(max(commands)):
                for command in commands.get(frame, []):
                    sim.apply(0, command)
                sim.step(np.zeros((1, sim.inserted_mm.shape[1], 2)))
                if sim.completed[0]:
                    scripted += 1
                    break
            env.reset(seed=0)
            done = False
            while not done:
                _, _, reached, cut, _ = env.step(rng.uniform(-1, 1, env.action_space.shape))
                done = reached or cut
            random += reached
    return scripted, random


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=16)
    parser.add_argument("--cache", default=None)
    parser.add_argument("--patients", type=int, help="so many of those that train_ppo.py trains on, and as many that it has not met, instead")
    options = parser.parse_args()
    if options.patients:
        print("| environment | solution: patients of training | unseen | random: patients of training | unseen |")
        print("| --- |" + " ---: |" * 4)
        for name in sd.gym.ENVIRONMENTS:
            known, unseen = (of_patients(name, range(first, first + options.patients), options.cache) for first in (1, 1001))
            print(f"| {name.split('/')[1].split('-')[0]} | {known[0]} | {unseen[0]} | {known[1]} | {unseen[1]} |", flush=True)
        return
    print("| environment | solution: frames | largest force | frames a core-second | coarse: tip away | frames a core-second | "
          "random: reached | largest force | steps a core-second | coarse |")
    print("| --- |" + " ---: |" * 9)
    for name, own in sd.gym.ENVIRONMENTS.items():
        done, frames, most, tip, speed = of_solution(own["scenario"], options.cache)
        coarse = of_solution(own["scenario"], options.cache, sd.gym.COARSE)
        away = f"{np.linalg.norm(coarse[3] - tip):.1f} mm" if coarse[0] else "not reached"
        share, _, force, steps = of_random_actions(name, options.episodes, options.cache)
        fast = of_random_actions(name, options.episodes, options.cache, sd.gym.COARSE)[3]
        print(f"| {name.split('/')[1].split('-')[0]} | {frames if done else 'not reached'} | {most:.2f} N | {speed:.0f} | {away} | "
              f"{coarse[4]:.0f} | {100 * share:.0f} % | {force:.2f} N | {steps:.0f} | {fast:.0f} |", flush=True)


if __name__ == "__main__":
    main()
