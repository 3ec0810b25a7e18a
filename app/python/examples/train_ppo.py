#!/usr/bin/env python3
"""Trains PPO of Stable-Baselines3 on patients that are drawn for each episode, with a coarse model (sd.gym.COARSE), and tries it on others, in the exercise as it is.

    PYTHONPATH=build/python /usr/bin/python3 app/python/examples/train_ppo.py --minutes 60 --out train

Writes curve.csv (steps, processor time, success of the last 100 episodes), policy.zip with its normalisation, and unseen.csv, a line for each patient.
Vessels are grown where they are new, or beforehand by  SELDINGER_CACHE_MB=20000 seldinger bake renal --seeds 1:193 --without-bodies
--set tissue.rigid=true --set chain.segment_length_mm=4.0. Needs gymnasium, stable-baselines3 and torch."""

import argparse
import csv
import time
from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import seldinger as sd
from seldinger.gym.sb3 import FromTheTip, make_vec_env
from seldinger.simulation import facts

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--env", default="seldinger/Renal-v1")
parser.add_argument("--minutes", type=float, default=60, help="of processor time")
parser.add_argument("--patients", type=int, default=192, help="whom it trains on: vessels of the seeds from 1 on")
parser.add_argument("--unseen", type=int, default=20, help="how many others it is tried on: those from 1001 on")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--cache")
parser.add_argument("--out", type=Path, default=Path("train"))


def environments(asked, count, seeds, seed, model=None):
    own = sd.gym.ENVIRONMENTS[asked.env]
    devices = facts(own["scenario"])["device_names"]
    observed = ["tracking3d", "route3d", "target3d", "rotation", "inserted_length", *(f"{device}_tracking3d" for device in devices if len(devices) > 1)]
    made = make_vec_env(asked.env, count, seed=seed, frame_skip=2, max_episode_steps=200, threads=1, set=model, obs=observed, pool_size=256,
                        randomize={**own.get("randomize", {}), "anatomy.seed": seeds}, hashes=False, cache=asked.cache)
    return VecMonitor(FromTheTip(made), info_keywords=("success",))


def train(asked, file):
    training = VecNormalize(environments(asked, 16, (1, 1 + asked.patients), asked.seed, sd.gym.COARSE), clip_reward=20)
    model = PPO("MultiInputPolicy", training, n_steps=128, batch_size=256, ent_coef=0.003, seed=asked.seed, device="cpu", policy_kwargs={"net_arch": [128, 128]})
    start, rows = time.process_time(), csv.writer(file)
    rows.writerow(["steps", "processor_s", "success", "mean_return"])

    def on_step(local, _):
        spent, ended = time.process_time() - start, local["self"].ep_info_buffer
        if local["n_steps"] == local["n_rollout_steps"] - 1 and ended:
            success, returned = (round(sum(one[key] for one in ended) / len(ended), 3) for key in ("success", "r"))
            rows.writerow([local["self"].num_timesteps, round(spent, 1), success, returned])
        return spent < 60 * asked.minutes

    model.learn(10 ** 9, callback=on_step)
    model.save(asked.out / "policy.zip")
    training.save(str(asked.out / "normalisation.pkl"))
    return model


def episode(asked, model, patient):
    one = VecNormalize.load(str(asked.out / "normalisation.pkl"), environments(asked, 1, (patient, patient + 1), 0))
    one.training = False
    observation, steps, force, done = one.reset(), 0, 0.0, False
    while not done:
        observation, _, ended, infos = one.step(model.predict(observation, deterministic=True)[0])
        steps, force, done = steps + 1, max(force, float(infos[0]["wall_force_N"])), ended[0]
    one.close()
    return [patient, infos[0]["success"], steps, round(force, 3)]


if __name__ == "__main__":
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    with open(asked.out / "curve.csv", "w", newline="", buffering=1) as file:
        model = train(asked, file)
    with open(asked.out / "unseen.csv", "w", newline="") as file:
        csv.writer(file).writerows([["anatomy_seed", "reached", "steps", "largest_force_N"],
                                    *(episode(asked, model, patient) for patient in range(1001, 1001 + asked.unseen))])
