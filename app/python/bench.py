#!/usr/bin/env python3
"""Measures what the module costs, in processor time: PYTHONPATH=build/python /usr/bin/python3 app/python/bench.py

Each line: what, figure, the gate it is held to. Processor time of this process alone is counted, so that other load on the
machine matters little. `--quick` makes everything shorter."""

import argparse
import itertools
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.pop(0)  # this folder, whose package lacks the built module
import seldinger as sd  # noqa: E402


def processor_time(work):
    start = time.process_time()
    work()
    return time.process_time() - start


def best(work, times=3):
    return min(processor_time(work) for _ in range(times))


def children_time(*command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def solution(name, only_motion=True):
    """Commands of the shipped script, a list for each frame."""
    frames = []
    for line in open(sd.assets() / "scripts" / (name + ".gw")):
        line = line.split("#")[0].strip()
        if not line:
            continue
        when, command = line.split(None, 1)
        first, last = (when.split("..") + [when])[:2] if ".." in when else (when, when)
        for frame in range(int(first), int(last) + 1):
            while len(frames) <= frame:
                frames.append([])
            if command != "end" and (not only_motion or re.match("advance|withdraw|rotate|remove|exchange", command)):
                frames[frame].append(command)
    return frames


def play(sim, frames, observe=lambda: None):
    sim.reset()
    for commands in frames:
        for command in commands:
            sim.apply(command)
        sim.step()
        observe()


def baked_resets(options, image):
    """Processor time and time by the clock of resets that each meet another baked patient [ms]."""
    count = 8 if options.quick else 64
    subprocess.run([options.program, "bake", "renal", "--seeds", f"1:{count + 3}", "--image", "128", "--cache", options.baked],
                   env={**os.environ, "SELDINGER_CACHE_MB": "100000"}, check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    seeds = itertools.count(1)
    env = sd.gym.make("seldinger/Renal-v1", cache=options.baked, image_size=128, pool_size=1,
                      obs=("tracking2d", "image") if image else None, randomize={"anatomy.seed": lambda rng: next(seeds)})
    env.reset(seed=0)
    spent = []
    while len(spent) < count:
        start, wall = time.process_time(), time.perf_counter()
        env.reset()
        spent.append((1e3 * (time.process_time() - start), 1e3 * (time.perf_counter() - wall)))
    env.close()
    return np.array(spent)


def row(what, figure, gate=""):
    print(f"{what:<64} {figure:>16}   {gate}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--cache", default=None)
    parser.add_argument("--program", default="build/release/bin/seldinger")
    parser.add_argument("--baked", help="cache of the patients that resets meet; made in a temporary one without it")
    options = parser.parse_args()
    cache = options.cache or str(sd.default_cache())
    row("load of the machine in the last minute", f"{os.getloadavg()[0]:.1f}")

    text = "import time; t = time.process_time(); import numpy; u = time.process_time(); import seldinger; " \
           "print(time.process_time() - t, time.process_time() - u)"
    both = [subprocess.run([sys.executable, "-c", text], capture_output=True, text=True).stdout.split() for _ in range(5)]
    row("import seldinger, NumPy included [s]", f"{min(float(b[0]) for b in both):.3f}", "< 0.2")
    row("import seldinger, NumPy there already [s]", f"{min(float(b[1]) for b in both):.3f}")

    sim = sd.Simulation("renal", cache=cache)
    frames = solution("renal")
    repeats = 1 if options.quick else 3
    python_step = best(lambda: play(sim, frames), repeats) / len(frames)
    with tempfile.TemporaryDirectory() as folder:
        short, long = Path(folder) / "short.gw", Path(folder) / "long.gw"
        short.write_text("0 end\n")
        long.write_text("".join(f"{k} {c}\n" for k, commands in enumerate(frames) for c in commands)
                        + f"{len(frames) - 1} end\n")
        run = lambda script: children_time(options.program, "run", "renal", "--commands", str(script), "--out",
                                           folder + "/out", "--frames", "none", "--cache", cache)
        cpp = [min(run(script) for _ in range(repeats)) for script in (short, long)]
    cpp_step = (cpp[1] - cpp[0]) / (len(frames) - 1)
    row("C++ step, renal, shipped solution [ms]", f"{1e3 * cpp_step:.3f}")
    row("step + State, the same commands [ms]", f"{1e3 * python_step:.3f}")
    row("ratio", f"{python_step / cpp_step:.2f}", "<= 1.1")
    row("steps a core-second, renal, shipped solution", f"{1 / python_step:.0f}", ">= 1000 (CathSim: 846)")
    for scenario, goal in (("renal", 2500), ("renal_cobra", 1000)):
        coarse, its = sd.Simulation(scenario, set=sd.gym.COARSE, cache=cache, images=False), solution(scenario)
        coarse_step = best(lambda: play(coarse, its, lambda: coarse.state), repeats) / len(its)
        row(f"the same with sd.gym.COARSE, {scenario}", f"{1 / coarse_step:.0f}", f">= {goal}")

    reset = best(lambda: [sim.reset() for _ in range(500)], repeats) / 500
    row("reset [ms]", f"{1e3 * reset:.3f}", "<= 1")
    snapshot = sim.snapshot()
    row("snapshot and restore [ms]", f"{1e3 * best(lambda: [sim.restore(sim.snapshot()) for _ in range(500)]) / 500:.3f}")
    row("size of a snapshot [kB]", f"{len(snapshot) / 1e3:.0f}")
    env = sd.gym.make("seldinger/Renal-v1", cache=cache)
    row("reset of an environment [ms]", f"{1e3 * best(lambda: [env.reset(seed=k) for k in range(200)]) / 200:.3f}", "<= 1")

    with tempfile.TemporaryDirectory() as folder:
        options.baked = options.baked or folder
        for image in (False, True):
            processor, wall = np.median(baked_resets(options, image), axis=0)
            row(f"reset with a new baked patient, {'with' if image else 'without'} image [ms]", f"{processor:.1f}",
                "<= 20" if image else "<= 2")
            row("    by the clock (other load counts)", f"{wall:.1f}")

    def episode():
        env.reset(seed=1)
        rng = np.random.default_rng(0)
        for _ in range(100):
            _, _, terminated, truncated, _ = env.step(rng.uniform([[0.2, -1]], [[1, 1]]))
            if terminated or truncated:
                env.reset()
    row("steps a core-second, environment, random actions", f"{100 / best(episode, repeats):.0f}")

    every = frames[40:] if not options.quick else frames[40:100]
    for pixels in (0, 128, 256, 512):
        for masks in (False, True):
            if pixels == 0 and masks:
                continue

            def observe():
                if pixels:
                    sim.image(pixels)
                if masks:
                    sim.masks(pixels)
            sim.reset()
            observe()
            spent = best(lambda: play(sim, every, observe), repeats) / len(every)
            gate = ">= 400" if pixels == 128 and not masks else ""
            row(f"frames a core-second, image {pixels}{' and masks' if masks else ''}", f"{1 / spent:.0f}", gate)
    for pixels in (128, 512):
        sim.masks(pixels)
        row(f"masks, geometry stands still, {pixels} [ms]",
            f"{1e3 * best(lambda: [sim.masks(pixels) for _ in range(100)]) / 100:.3f}", "<= 1")

    n = 16
    for threads in (1, 2):
        many = sd.VectorSimulation(sim, n, threads=threads)
        rng = np.random.default_rng(1)
        motions = rng.uniform([0, -0.2], [2.3, 0.2], (60, n, 1, 2))
        start, wall = time.process_time(), time.perf_counter()
        for m in motions:
            many.step(m)
        row(f"VectorSimulation of {n}, {threads} threads: steps a core-second",
            f"{n * len(motions) / (time.process_time() - start):.0f}")
        row(f"    and a second by the clock (other load counts)", f"{n * len(motions) / (time.perf_counter() - wall):.0f}")
        many.close()

    def resident():
        with open("/proc/self/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
    sim.image(84)
    before, others = resident(), []
    spent = processor_time(lambda: others.extend(sd.gym.make("seldinger/Renal-v1", cache=cache) for _ in range(100))) / 100
    row("another environment of the same scenario [ms]", f"{1e3 * spent:.2f}", "<= 5")
    row("    its memory [MB]", f"{(resident() - before) / 1e5:.2f}", "<= 2")
    one = sd.Simulation("renal", cache=cache)
    row("first image of another simulation of it, 84 [ms]", f"{1e3 * processor_time(lambda: one.image(84)):.1f}", "<= 50")
    row("first masks, 84 [ms]", f"{1e3 * processor_time(lambda: sd.Simulation('renal', cache=cache).masks(84)):.1f}", "<= 50")
    for other in others:
        other.close()
    count = 10_000 if options.quick else 100_000
    for _ in range(1000):
        sim.reset()
    before = resident()
    for _ in range(count):
        sim.reset()
    row(f"growth of memory in {count} resets [kB]", f"{resident() - before}", "0, within the allocator's noise")


main()
