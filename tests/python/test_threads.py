"""Images of several threads, and of forked processes."""

import multiprocessing
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import seldinger as sd


def test_images_of_a_pool_of_threads_are_those_of_one(cache):
    # Each simulation is used by whichever thread comes next.
    simulations = [sd.Simulation("straight", cache=cache) for _ in range(4)]
    locks = [threading.Lock() for _ in simulations]
    jobs = [(k % 4, -30 + 7 * (k % 9), 64 + 32 * (k % 3)) for k in range(60)]

    def image(job):
        which, lao, pixels = job
        with locks[which]:
            simulations[which].reset()
            simulations[which].apply(f"arm lao {lao} deg")
            simulations[which].step()
            return simulations[which].image(pixels)

    expected = [image(job) for job in jobs]
    with ThreadPoolExecutor(4) as pool:
        for job, one, other in zip(jobs, expected, pool.map(image, jobs)):
            np.testing.assert_array_equal(one, other, err_msg=str(job))


def test_panels_of_a_pool_of_threads_are_those_of_one(cache):
    vector = sd.VectorSimulation(sd.Simulation("straight", cache=cache, panel=True), 3, threads=2)
    for _ in range(3):
        vector.step(np.ones((3, 1, 2)))
    expected = [vector.panel(i) for i in range(3)]
    with ThreadPoolExecutor(3) as pool:
        for k, panel in enumerate(pool.map(lambda k: vector.panel(k % 3), range(12))):
            np.testing.assert_array_equal(panel, expected[k % 3])


def child_of(work, queue):
    try:
        queue.put(work())
    except Exception as error:  # noqa: BLE001: its text is what is asked
        queue.put(str(error))


def in_a_fork(work):
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    process = context.Process(target=child_of, args=(work, queue))
    process.start()
    said = queue.get(timeout=120)
    process.join()
    assert process.exitcode == 0
    return said


@pytest.mark.filterwarnings("ignore")
def test_a_forked_process_steps_and_is_told_that_it_cannot_make_images(cache):
    vector = sd.VectorSimulation("straight", 4, threads=2, cache=cache)
    vector.step(np.ones((4, 1, 2)))
    sim = sd.Simulation("straight", cache=cache)
    sim.step(advance_mm=1)
    sim.image(64)

    def steps():
        vector.step(np.ones((4, 1, 2)))
        return [int(h) for h in vector.hashes()] + [sim.step(advance_mm=1).hash]

    def images():
        sim.apply("arm lao 20 deg")
        sim.step()
        return sim.image(96).sum()

    def new_images():
        return sd.Simulation("straight", cache=cache).image(32).sum()

    forked = in_a_fork(steps)
    assert "forked" in in_a_fork(images)
    assert "forked" in in_a_fork(new_images)
    assert forked == steps()
