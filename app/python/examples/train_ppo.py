#!/usr/bin/env python3
"""Trains PPO of Stable-Baselines3 on patients that are drawn for each episode, with a coarse model (sd.gym.COARSE), and tries it
on others that it has not met, in the exercise as it is.

    PYTHONPATH=build/python /usr/bin/python3 app/python/examples/train_ppo.py --minutes 60 --out train

Writes curve.csv (steps, processor time, success of the last 100 episodes), policy.zip with its normalisation, and
unseen.csv, a line for each patient. Their vessels are grown where they are new, or beforehand by
    SELDINGER_CACHE_MB=20000 seldinger bake renal --seeds 1:193 --without-bodies --set tissue.rigid=true --set chain.segment_length_mm=4.0
Needs gymnasium, stable-baselines3 and torch."""

import argparse
import csv
import time
from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper, VecMonitor, VecNormalize

import seldinger as sd
from seldinger.gym.sb3 import make_vec_env
from seldinger.simulation import facts

UNSEEN = range(1001, 1021)  # seeds of the vessels; those of training begin at 1


class FromTheTip(VecEnvWrapper):
    """Places are seen from the tip, so that what is learned in one patient holds in another."""

    @staticmethod
    def seen(observation):
        tip = observation["tracking3d"][..., :1, :]
        away = {key: points - tip for key, points in observation.items() if key.endswith(("tracking3d", "route3d"))}
        return {**observation, **away, "target3d": observation["target3d"] - tip[..., 0, :]}

    def reset(self):
        return self.seen(self.venv.reset())

    def step_wait(self):
        observations, rewards, ended, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self.seen(info["terminal_observation"])
        return self.seen(observations), rewards, ended, infos


class Curve(BaseCallback):
    """Writes how training goes, and ends it when its time is up."""

    def __init__(self, file, seconds):
        super().__init__()
        self.rows, self.seconds, self.start = csv.writer(file), seconds, time.process_time()
        self.rows.writerow(["steps", "processor_s", "success", "mean_return"])

    def _on_rollout_end(self):
        ended = self.model.ep_info_buffer
        if ended:
            reached = [one["success"] for one in ended]
            self.rows.writerow([self.num_timesteps, round(time.process_time() - self.start, 1),
                                round(sum(reached) / len(reached), 3), round(sum(one["r"] for one in ended) / len(ended), 3)])

    def _on_step(self):
        return time.process_time() - self.start < self.seconds


def envs(arguments, count, seeds, seed, model=None):
    own = sd.gym.ENVIRONMENTS[arguments.env]
    devices = facts(own["scenario"])["device_names"]
    observed = ["tracking3d", "route3d", "target3d", "rotation", "inserted_length"]
    made = make_vec_env(arguments.env, count, seed=seed, frame_skip=2, max_episode_steps=200, threads=1, set=model,
                        obs=observed + [f"{device}_tracking3d" for device in devices if len(devices) > 1],
                        randomize={**own.get("randomize", {}), "anatomy.seed": seeds}, pool_size=256, hashes=False,
                        cache=arguments.cache)
    return VecMonitor(FromTheTip(made), info_keywords=("success",))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="seldinger/Renal-v1")
    parser.add_argument("--minutes", type=float, default=60, help="of processor time")
    parser.add_argument("--patients", type=int, default=192, help="whom it trains on")
    parser.add_argument("--unseen", type=int, default=len(UNSEEN), help="how many others it is tried on")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", default=None)
    parser.add_argument("--out", type=Path, default=Path("train"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    training = VecNormalize(envs(arguments, 16, (1, 1 + arguments.patients), arguments.seed, sd.gym.COARSE), clip_reward=20)
    model = PPO("MultiInputPolicy", training, n_steps=128, batch_size=256, ent_coef=0.003, seed=arguments.seed, device="cpu",
                policy_kwargs={"net_arch": [128, 128]})
    with open(arguments.out / "curve.csv", "w", newline="", buffering=1) as file:
        model.learn(10 ** 9, callback=Curve(file, 60 * arguments.minutes))
    model.save(arguments.out / "policy.zip")
    training.save(str(arguments.out / "normalisation.pkl"))
    with open(arguments.out / "unseen.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["anatomy_seed", "reached", "steps", "largest_force_N"])
        for patient in UNSEEN[:arguments.unseen]:
            one = VecNormalize.load(str(arguments.out / "normalisation.pkl"), envs(arguments, 1, (patient, patient + 1), 0))
            one.training = False
            observation, steps, force, done = one.reset(), 0, 0.0, False
            while not done:
                observation, _, ended, infos = one.step(model.predict(observation, deterministic=True)[0])
                steps, force, done = steps + 1, max(force, float(infos[0]["wall_force_N"])), ended[0]
            rows.writerow([patient, infos[0]["success"], steps, round(force, 3)])
            one.close()


if __name__ == "__main__":
    main()
