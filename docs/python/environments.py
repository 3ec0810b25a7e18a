#!/usr/bin/env python3
"""Writes docs/python/environments: a page and a picture for each environment, from what the module says about it.

    PYTHONPATH=build/python /usr/bin/python3 docs/python/environments.py [--cache FOLDER]
    PYTHONPATH=build/python /usr/bin/python3 docs/python/environments.py --check      # texts only; exit code 1 if out of date
"""

import argparse
import sys
from pathlib import Path

import numpy as np

import seldinger as sd

PAGES = Path(__file__).resolve().parent / "environments"
MARK = "<!-- Made by docs/python/environments.py. -->\n\n"
# What the module cannot say: the task, and what makes it hard for a policy.
ABOUT = {
    "Renal": ("A wire goes from the left groin up the aorta and into the left renal artery.",
              "The wire must turn before it passes the ostium: the push decides when, the turn decides where. A policy that only "
              "pushes passes the ostium and goes on up the aorta."),
    "Carotid": ("A catheter over a wire goes from the arch into the left common carotid artery. The catheter's tip must reach "
                "the target.",
                "The order matters: turn the catheter up, draw both back until it springs into the ostium, send the wire ahead, let "
                "the catheter follow. Reward is measured at the catheter's tip, so that sending the wire ahead earns nothing by itself."),
    "Coronary": ("A wire from the right wrist goes down the ascending aorta into the left main coronary artery.",
                 "The heart beats and the patient breathes: the target moves by 7 mm with each beat and by 6 mm with each breath. The "
                 "ostium is as wide as the tip's bend is long."),
    "Crossover": ("A wire goes from the right groin over the bifurcation of the aorta into the left external iliac artery, out of a "
                  "flush catheter with a loop at its end.",
                  "The loop must hang on the bifurcation before the wire leaves it. Pushed out at once, the wire goes back down."),
    "ArchVariety": ("The task of Carotid in an arch of type I, II or III, drawn at each reset.",
                    "Each arch has its own catheter, target and start. A course that works in one fails in the others: the policy "
                    "must look."),
    "DualDevice": ("A Cobra catheter over a wire goes from the left groin into the right renal artery. The catheter's tip must "
                   "reach the target.",
                   "Both devices must act: the catheter's bend aims, the wire leads, the catheter follows. The catheter alone springs "
                   "back into the aorta."),
}
KEYS = {
    "tracking2d": "points of the {target_by} from its tip backward [pixels of an image of `image_size`]",
    "wire_tracking2d": "the same of the wire",
    "catheter_tracking2d": "the same of the catheter",
    "target2d": "the target [pixels]",
    "rotation": "sine and cosine of each hub's turn",
}


def short(name):
    return name.split("/")[1].split("-")[0]


def box(space):
    low, high = (f"{space.low.min():g}", f"{space.high.max():g}")
    return f"`{space.shape}` {space.dtype}, {low} to {high}"


def page(name, env):
    key = short(name)
    task, hard = ABOUT[key]
    own = sd.gym.ENVIRONMENTS[name]
    observation, info = env.reset(seed=0)
    batch = env._batch
    about = batch.about
    devices = about["device_names"]
    state = env.simulation
    scenarios = own.get("randomize", {}).get("scenario", (own["scenario"],))
    rows = " ".join(f"row {i}: {device};" for i, device in enumerate(devices)).rstrip(";")
    out = [f"# {name}", "", task, "", f"![The start: wire, target and vessels]({key.lower()}.png)", "",
           f"*The start. Blue: vessels, which the policy sees only if it asks for `phantom`. {shown(env, devices)} Red: the "
           "target with its radius.*", "",
           "```python", "import seldinger as sd", f'env = sd.gym.make("{name}")', "observation, info = env.reset(seed=7)",
           "observation, reward, terminated, truncated, info = env.step(env.action_space.sample())", "```", "",
           f"**What is hard.** {hard}", "", "## Action", "",
           f"{box(env.action_space)}. {rows[0].upper() + rows[1:]}. Column 0 is the feed, column 1 the turn of the hub. ±1 is ±35 mm/s "
           "and ±3.14 rad/s; with `action=\"physical\"` the numbers are mm/s and rad/s. "
           f"A step is one frame, 1/{about['frame_rate_hz']:g} s.", "",
           "## Observation", "", "A dict of arrays. These are given unless `obs` says otherwise:", "",
           "| key | | |", "| --- | --- | --- |"]
    for item, space in env.observation_space.spaces.items():
        out.append(f"| `{item}` | {box(space)} | {KEYS[item].format(**about)} |")
    out += ["", "`obs=(…)` takes any of " + ", ".join(f"`{item}`" for item in sd.gym.KEYS)
            + "".join(f", `{device}_tracking2d`, `{device}_tracking3d`, `{device}_mask`" for device in devices) + "; [all keys](../environments.md#observations) are described together.", "",
            "## Reward and end", "",
            "0.01 a millimetre nearer along the vessels, 1 at the target, -0.001 a step; `reward=` takes another.", "",
            "| | |", "| --- | --- |",
            f"| exercise | {', '.join(f'[`{one}`](../../exercises/{one}.md)' for one in scenarios)} |",
            f"| target | the tip of the {about['target_by']} within {state.target_radius_mm[0]:g} mm |",
            f"| way at the start, seed 0 | {info['path_to_target_mm']:.0f} mm |",
            f"| `truncated` | after {batch.most_steps} steps, at the exercise's limit of time, past an end of the vessels, or after "
            f"{batch.patience} steps without equilibrium |"]
    if "randomize" in own:
        out += ["", "## What a reset draws", "", f"One of {len(scenarios)} scenarios: " +
                ", ".join(f"`{one}`" for one in scenarios) + ". `randomize={…}` adds more: vessels, targets, friction, the C-arm's angle."]
    else:
        out += ["", "## What a reset draws", "", "Nothing but the noise of images. `randomize={…}` adds vessels, targets, friction, "
                "the C-arm's angle and all else that [a scenario states](../environments.md#what-a-reset-draws)."]
    return MARK + "\n".join(out) + "\n"


def shown(env, devices):
    masks = env.simulation.masks(128)
    seen = any(masks[device].any() for device in devices if device in masks)
    return f"Orange: {' and '.join(devices)}." if seen else f"The {devices[-1]} is not in the image yet."


def picture(env, path, size=288):
    """The image with vessels, devices and target drawn over it."""
    sim = env.simulation
    # The mean of a few: less noise to store.
    image = np.mean([sim.images(size, seeds=[seed])[0] for seed in range(16)], axis=0)
    image = np.repeat(np.round(image)[..., None], 3, -1)
    masks = sim.masks(size)
    vessels = masks["vessels"][0] == 255
    image[vessels] = 0.75 * image[vessels] + 0.25 * np.array([60, 130, 255])
    for device in ("catheter", "wire"):
        if device in masks:
            image[masks[device][0] == 255] = (255, 150, 0) if device == "wire" else (255, 200, 90)
    scale = size / env._batch.about["pixels"]
    x, y = sim.target_px[0] * scale
    away = np.hypot(*(np.mgrid[:size, :size][::-1] + 0.5 - np.array([x, y])[:, None, None]))
    radius = sim.target_radius_mm[0] * size / env._batch.about["field_mm"]
    image[abs(away - max(radius, 4)) < 1.2] = (255, 30, 30)
    sd.write_png(str(path), image.astype(np.uint8))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--cache", default=None)
    options = parser.parse_args()
    if set(ABOUT) != {short(name) for name in sd.gym.ENVIRONMENTS}:
        raise SystemExit("ABOUT and sd.gym.ENVIRONMENTS name different environments")
    wrong = []
    for name in sd.gym.ENVIRONMENTS:
        env = sd.gym.make(name, cache=options.cache)
        path, text = PAGES / f"{short(name).lower()}.md", page(name, env)
        if not path.exists() or path.read_text() != text:
            wrong.append(path.name)
        if not options.check:
            path.write_text(text)
            picture(env, path.with_suffix(".png"))
        env.close()
    print(f"docs/python/environments: {', '.join(wrong) or 'nothing'} {'is out of date' if options.check else 'changed'}")
    return 1 if options.check and wrong else 0


if __name__ == "__main__":
    sys.exit(main())
