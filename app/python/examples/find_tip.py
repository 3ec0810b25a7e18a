#!/usr/bin/env python3
"""A data set of 1000 X-ray images with the truth of the wire's tip, and a linear model that finds the tip in new ones.

    PYTHONPATH=build/python /usr/bin/python3 app/python/examples/find_tip.py [--out tip]

Writes tip.npz (images, tips in pixels, masks of the wire as bits) and tip.png (tests: the tip green, what was found red).
The model is eight correlation filters (MOSSE, Bolme et al. 2010): linear maps from image to a peak at the tip, fitted in
closed form in the Fourier domain to the images without their mean, one for each look of the tip."""

import argparse
import time

import numpy as np

import seldinger as sd


def frames(count, pixels, seed, cache):
    """Images, tips [pixels] and masks of episodes with random hands, each from a view of its own noise."""
    rng = np.random.default_rng(seed)
    sim = sd.Simulation("renal", cache=cache)
    images, tips, masks, episode = [], [], [], []
    number = 0
    while len(images) < count:
        state = sim.reset()
        number += 1
        # Up into the picture, then back and forth; each episode turns the other way.
        state = sim.step(rotate_deg=rng.uniform(-180, 180))
        state = sim.step(advance_mm=2, frames=int(rng.integers(30, 90)))
        for _ in range(25):
            state = sim.step(advance_mm=rng.uniform(-3, 4), rotate_deg=rng.uniform(-40, 40), frames=2)
            tip = sim.project(state.tip_mm[None], pixels)[0]
            if state.settling or not (4 <= tip).all() or not (tip < pixels - 4).all():
                continue
            images.append(sim.image(pixels, seed=int(rng.integers(2 ** 31))))
            tips.append(tip)
            masks.append(sim.masks(pixels)["wire"] == 255)
            episode.append(number)
            if len(images) == count:
                break
    return np.array(images), np.array(tips), np.array(masks), np.array(episode)


class LinearTip:
    """Filters * (image - mean), each over its own spread; the highest peak is the tip. One filter for each look of the tip,
    as a bent tip that is turned looks different: looks are groups of similar surroundings (k-means)."""

    def __init__(self, images, tips, looks=8, width=1.0, ridge=0.01, seed=0):
        self.mean = images.mean(0)
        images = images - self.mean
        look = self._looks(images, tips, looks, seed)
        y, x = np.mgrid[:images.shape[1], :images.shape[2]] + 0.5
        seen = np.fft.rfft2(images)
        power = (abs(seen) ** 2).mean(0)
        wanted = np.exp(-((x - tips[:, 0, None, None]) ** 2 + (y - tips[:, 1, None, None]) ** 2) / (2 * width ** 2))
        self.filters = []
        for number in np.unique(look):
            of = look == number
            made = (np.fft.rfft2(wanted[of]) * seen[of].conj()).mean(0) / (power + ridge * power.mean())
            self.filters.append(made / np.fft.irfft2(made * seen[::20], images.shape[1:]).std())

    @staticmethod
    def _looks(images, tips, looks, seed, reach=8):
        around = []
        for image, tip in zip(images, tips):
            x, y = np.clip(tip.astype(int), reach, len(image) - 1 - reach)
            patch = image[y - reach:y + reach + 1, x - reach:x + reach + 1]
            around.append((patch - patch.mean()).ravel())
        around = np.array(around)
        centres = around[np.random.default_rng(seed).choice(len(around), looks, replace=False)]
        for _ in range(20):
            look = ((around[:, None] - centres) ** 2).sum(-1).argmin(1)
            centres = np.array([around[look == k].mean(0) if (look == k).any() else centres[k] for k in range(looks)])
        return look

    def find(self, image):
        seen = np.fft.rfft2(image - self.mean)
        answer = np.max([np.fft.irfft2(one * seen, image.shape) for one in self.filters], 0)
        row, column = np.unravel_index(answer.argmax(), answer.shape)
        return np.array([column + 0.5, row + 0.5])


def marked(image, *marks):
    picture = np.repeat(image[..., None], 3, -1)
    for (x, y), colour in marks:
        x, y = int(np.clip(x, 2, len(image) - 3)), int(np.clip(y, 2, len(image) - 3))
        picture[y, x - 2:x + 3] = picture[y - 2:y + 3, x] = colour
    return picture


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="tip")
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--pixels", type=int, default=128)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cache", default=None)
    options = parser.parse_args()
    start = time.process_time()
    images, tips, masks, episode = frames(options.frames, options.pixels, options.seed, options.cache)
    print(f"{len(images)} images of {options.pixels} pixels, {episode[-1]} episodes, "
          f"{time.process_time() - start:.1f} s of processor time")
    np.savez_compressed(options.out + ".npz", images=images, tips_px=tips, wire=np.packbits(masks, axis=-1))
    train = episode <= 0.8 * episode[-1]  # no episode is in both
    model = LinearTip(images[train].astype(float), tips[train])
    found = np.array([model.find(image.astype(float)) for image in images[~train]])
    error = np.linalg.norm(found - tips[~train], axis=1)
    guess = np.linalg.norm(tips[train].mean(0) - tips[~train], axis=1)
    print(f"{train.sum()} images to fit, {len(error)} to test: error of the tip {np.median(error):.2f} pixels (median), "
          f"{error.mean():.2f} (mean), within 3 pixels in {100 * (error <= 3).mean():.0f} %")
    print(f"always the mean place: {np.median(guess):.2f} pixels (median)")
    shown = np.linspace(0, len(error) - 1, 12).astype(int)
    tiles = [marked(images[~train][k], (tips[~train][k], (0, 255, 0)), (found[k], (255, 0, 0))) for k in shown]
    sd.write_png(options.out + ".png", np.vstack([np.hstack(tiles[r:r + 4]) for r in (0, 4, 8)]))
    print(f"{options.out}.npz, {options.out}.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
