"""Objects before they are made and after they are closed, threads when Python ends, forks, handlers of signals and
finalisers: exceptions, never an abort or a hang."""

import json
import random
import subprocess
import sys

import numpy as np
import pytest

import seldinger as sd
from seldinger import _core


def run(text, *arguments):
    return subprocess.run([sys.executable, "-c", text, *arguments], capture_output=True, text=True, timeout=300)


def unmade_simulations():
    for one in (sd.Simulation, _core.Simulation):
        yield one.__new__(one)


def unmade_vectors():
    for several in (sd.VectorSimulation, _core.VectorSimulation):
        yield several.__new__(several)


def public(thing):
    return [name for name in dir(type(thing)) if not name.startswith("__")]


def use_every_member(thing, bend, but=()):
    """Each public member, which must raise an error; how many there were."""
    given = {"apply": ["beam on"], "restore": [bend.snapshot()], "project": [[[0, 0, 0]]], "save": ["x.gw"],
             "path_from": [[0, 0, 0]], "step": [np.zeros((1, 1, 2))], "route": [3, 1.0], "assign": [0, bend], "aim": [0, "LRA"],
             "images": [64], "masks": [64], "image": [64]}
    of_many = isinstance(thing, _core.VectorSimulation)
    if of_many:
        given["_assign"] = given["assign"]
        for name in ("apply", "restore", "save", "path_from", "branch_name", "_score", "score", "snapshot", "panel", "show_tip",
                     "_target"):
            given[name] = [0, *given.get(name, [])]
    else:
        given["step"] = [1.0]
    tried = 0
    for name in public(thing):
        if name in ("_open", "_open_like", "_arguments", "close", *but):
            continue
        with pytest.raises((sd.InputError, AttributeError)):
            value = getattr(thing, name)
            if callable(value):
                value(*given.get(name, []))
            pytest.fail(f"{name} raised nothing")
        tried += 1
    assert "Simulation" in repr(thing)
    return tried


@pytest.mark.parametrize("thing", [*unmade_simulations(), *unmade_vectors()])
def test_every_member_of_an_object_before_its_init_raises_an_error(bend, thing):
    assert use_every_member(thing, bend) > 15
    if isinstance(thing, _core.VectorSimulation):
        with pytest.raises(sd.InputError, match="__init__"):
            len(thing)
    thing.close()  # of what was never made nothing is left


@pytest.mark.parametrize("n", [None, 2])
def test_every_member_of_a_closed_object_raises_an_error(cache, bend, n):
    thing = sd.Simulation("s_bend", cache=cache) if n is None else sd.VectorSimulation("s_bend", n, cache=cache)
    thing.close()
    assert thing.closed
    # Its arrays stay as they are.
    assert use_every_member(thing, bend, but=("closed", "threads", "_arrays", "_states", "turned_rad")) > 10
    thing.close()


@pytest.mark.parametrize("make", [lambda: _core.State.__new__(_core.State), lambda: _core.Snapshot.__new__(_core.Snapshot),
                                  _core.State, _core.Snapshot, lambda: _core.State.__new__(_core.State).wire_mm,
                                  lambda: _core.Simulation.__new__(int)])
def test_states_and_snapshots_come_from_simulations_alone(make):
    with pytest.raises(TypeError):
        make()


def test_a_class_that_reads_its_state_too_early_is_told(cache):
    class Early(sd.Simulation):
        def __init__(self):
            self.start = self.state
            super().__init__("s_bend", cache=cache)

    class Never(sd.Simulation):
        def __init__(self):
            pass

    class Twice(sd.Simulation):
        def __init__(self):
            super().__init__("s_bend", cache=cache)
            super().__init__("s_bend", cache=cache)

    with pytest.raises(sd.InputError, match=r"super\(\).__init__\(\) first"):
        Early()
    with pytest.raises(sd.InputError, match=r"super\(\).__init__\(\) first"):
        Never().step()
    with pytest.raises(sd.InputError, match="expected one call"):
        Twice()


def test_simulations_that_could_not_be_made_say_so(cache):
    sim = sd.Simulation.__new__(sd.Simulation)
    with pytest.raises(sd.InputError, match="no such scenario"):
        sim.__init__("kidney")
    with pytest.raises(sd.InputError, match="__init__"):
        sim.step()
    sim.__init__("s_bend", cache=cache)
    assert sim.step().frame == 0 and not sim.closed


DAEMON = """
import sys, threading, time
import numpy as np
import seldinger as sd
what, cache = sys.argv[1:]
one = sd.Simulation("s_bend", cache=cache)
many = sd.VectorSimulation("s_bend", 4, threads=2, cache=cache)
work = {"step": lambda: one.step(0.01), "image": lambda: one.image(128), "vec": lambda: many.step(np.full((4, 1, 2), 0.01)),
        "new": lambda: sd.Simulation("s_bend", cache=cache), "state": lambda: one.state, "frames": lambda: one.step(frames=50)}
work["env"] = lambda: env.step(env.action_space.sample())
env = sd.gym.make("seldinger/Renal-v1", cache=cache) if what == "env" else None
if env:
    env.reset(seed=1)
work["mixed"] = lambda: [call() for name, call in work.items() if name not in ("mixed", "frames", "env")]
begun = threading.Semaphore(0)

def loop():
    while True:
        work[what]()
        begun.release()

for _ in range(3):
    threading.Thread(target=loop, daemon=True).start()
for _ in range(4):
    begun.acquire()
"""


@pytest.mark.parametrize("what", ["step", "image", "vec", "new", "state", "frames", "env", "mixed"])
def test_python_ends_while_daemon_threads_work(cache, what):
    for _ in range(8):
        ended = run(DAEMON, what, str(cache))
        assert (ended.stderr, ended.returncode) == ("", 0)


def test_what_is_freed_while_python_ends_is_freed(cache):
    ended = run("""
import sys, atexit
import seldinger as sd
class Last:
    def __init__(self):
        self.sim = sd.Simulation("s_bend", cache=sys.argv[1])
    def __del__(self):
        self.sim.step(1)
        self.sim.close()
        print("freed")
kept = Last()
""", str(cache))
    assert (ended.stderr, ended.stdout, ended.returncode) == ("", "freed\n", 0)


# What a thread of the parent, a forked child, a signal's handler and a finaliser do, by name.
CALLS = """
import gc, json, os, random, signal, sys, tempfile, threading, time
import numpy as np
import seldinger as sd
cache = sys.argv[1]
one = sd.Simulation("s_bend", cache=cache)
many = sd.VectorSimulation("s_bend", 4, threads=2, cache=cache)
mark = one.snapshot()
folder = tempfile.mkdtemp()
calls = {
    "step": lambda: one.step(0.01), "frames": lambda: one.step(frames=40), "state": lambda: one.state,
    "snapshot": lambda: one.snapshot(), "restore": lambda: one.restore(mark), "reset": lambda: one.reset(),
    "aim": lambda: one.reset(target=[0, 0, 1]), "apply": lambda: one.apply("beam on"), "score": lambda: one.score(),
    "save": lambda: one.save(os.path.join(folder, f"{threading.get_ident()}-{os.getpid()}.gw")),
    "project": lambda: one.project([[0, 0, 0]]), "anatomy": lambda: one.anatomy(), "about": lambda: one.about(),
    "path": lambda: one.path_from([0, 0, 0]), "image": lambda: one.image(64), "masks": lambda: one.masks(64),
    "panel": lambda: one.panel(640, 512), "new": lambda: sd.Simulation("s_bend", cache=cache),
    "other": lambda: sd.Simulation("straight", cache=cache),
    "vector": lambda: sd.VectorSimulation("s_bend", 3, threads=2, cache=cache),
    "steps": lambda: many.step(np.full((4, 1, 2), 0.01)), "images": lambda: many.images(64),
    "route": lambda: many.route(3, 1.0), "resets": lambda: many.reset(), "hashes": lambda: many.hashes(),
    "assign": lambda: many.assign(0, one), "png": lambda: sd.write_png(os.path.join(folder, "a.png"), np.zeros((9, 9), bool)),
    "wrong": lambda: sd.Simulation("kidney"), "shut": lambda: sd.Simulation("s_bend", cache=cache).close(),
}
names = sorted(calls)
refused = (sd.InputError, RuntimeError)
"""

FORKS = CALLS + """
what = sys.argv[2]
calls["image"](); calls["images"]()  # the rasteriser's threads are there
begun = threading.Semaphore(0)
def loop():
    while True:
        calls[what]()
        begun.release()
for _ in range(2):
    threading.Thread(target=loop, daemon=True).start()
begun.acquire()
for name in names + ["leave"]:
    child = os.fork()
    if child == 0:
        if name == "leave":
            sys.exit(7)
        try:
            calls[name]()
            os._exit(0)
        except refused as error:
            os._exit(3 if "forked" in str(error) else 4)
    deadline = time.monotonic() + 60
    while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGABRT)
        time.sleep(0.001)
    print(name, os.waitstatus_to_exitcode(ended[1]))
"""


@pytest.mark.parametrize("what", ["step", "frames", "steps", "images", "image", "new", "masks", "state", "reset", "wrong"])
def test_a_forked_process_can_do_all_but_images_while_threads_of_its_parent_are_at_work(cache, what):
    loop = "try:\n            calls[what]()\n        except refused: pass" if what == "wrong" else "calls[what]()"
    ended = run(FORKS.replace("calls[what]()", loop), str(cache), what)
    assert (ended.stderr, ended.returncode) == ("", 0)
    codes = {name: int(code) for name, code in (line.split() for line in ended.stdout.splitlines())}
    assert len(codes) > 25
    # An image of what has not moved since the last one needs no rasteriser.
    assert all(codes.pop(name) in (0, 3) for name in ("image", "images", "masks"))
    expected = {name: 3 if name == "panel" else {"wrong": 4, "leave": 7}.get(name, 0) for name in codes}
    assert codes == expected


HANDLERS = CALLS + """
seed = int(sys.argv[2])
draw = random.Random(seed)
said = {"done": 0, "refused": 0, "raised": 0, "forked": 0}
class Told(Exception):
    pass
me = os.getpid()
def is_in_a_call(frame):
    while frame and frame.f_code is not attacked.__code__:
        frame = frame.f_back
    return frame is not None
def handler(number, frame):
    if os.getpid() != me:
        return
    name = draw.choice(names + ["raise", "fork", "close"])
    if name == "raise":
        if not is_in_a_call(frame):
            return
        said["raised"] += 1
        raise Told
    if name == "fork":
        child = os.fork()
        if child == 0:
            try:
                calls[draw.choice(names)]()
            except refused:
                pass
            os._exit(0)
        os.waitpid(child, 0)
        said["forked"] += 1
        return
    try:
        one.close() if name == "close" else calls[name]()
        said["done"] += 1
    except refused:
        said["refused"] += 1
signal.signal(signal.SIGALRM, handler)
if draw.random() < 0.5:
    def work():
        while True:
            try:
                calls[draw.choice(names)]()
            except refused:
                pass
    for _ in range(2):
        threading.Thread(target=work, daemon=True).start()
# Only what is in here is interrupted by an exception: Python's own shutil.rmtree closes a descriptor twice then.
def attacked(name, empty):
    signal.setitimer(signal.ITIMER_REAL, draw.choice([1e-5, 1e-4, 1e-3, 1e-2]), draw.choice([0, 1e-3]))
    if name == "grow":
        sd.Simulation("straight", cache=empty).image(64)
    else:
        calls[name]()
for _ in range(int(sys.argv[3])):
    with tempfile.TemporaryDirectory() as empty:
        try:
            attacked(draw.choice(names + ["grow"]), empty)
        except (Told, *refused):
            pass
        signal.setitimer(signal.ITIMER_REAL, 0)
    if one.closed:
        one = sd.Simulation("s_bend", cache=cache)
print(json.dumps(said))
"""


def test_handlers_of_signals_in_the_middle_of_hundreds_of_calls_get_results_or_errors(cache):
    all_of = dict.fromkeys(("done", "refused", "raised", "forked"), 0)
    # No more than 4: once in about 70 000 calls a handler began with an exception set, in CPython 3.11's os.lstat, for a
    # reason that is not known; the more calls, the more often the suite fails of it.
    for seed in (random.randrange(10**6) for _ in range(4)):
        ended = run(HANDLERS, str(cache), str(seed), "100")
        assert (ended.stderr, ended.returncode) == ("", 0), f"seed {seed}"
        for what, count in json.loads(ended.stdout).items():
            all_of[what] += count
    assert min(all_of.values()) > 0, all_of


def test_finalisers_that_run_in_the_middle_of_any_call_get_results_or_errors(cache):
    ended = run(CALLS + """
kept = {"run": 0}
class Cycle:
    def __init__(self, name):
        self.me, self.name = self, name
    def __del__(self):
        kept["run"] += 1
        try:
            calls[self.name]()
        except refused:
            pass
names.remove("frames")
for name in names:
    gc.set_threshold(1)
    for within in ("state", "masks", "anatomy", "about", "snapshot", "step", "steps", "images", "new", "score", "wrong"):
        Cycle(name)
        try:
            calls[within]()
        except refused:
            pass
    gc.set_threshold(700)
gc.collect()
print(kept["run"])
""", str(cache))
    assert (ended.stderr, ended.returncode) == ("", 0)
    assert int(ended.stdout) > 250


def test_an_object_that_two_threads_make_is_made_once(cache):
    ended = run(CALLS + """
for kind, arguments in ((sd.Simulation, ("s_bend",)), (sd.VectorSimulation, ("s_bend", 3))):
    for _ in range(100):
        thing = kind.__new__(kind)
        told = []
        def make():
            try:
                thing.__init__(*arguments, cache=cache)
            except sd.InputError as error:
                told.append(str(error))
        threads = [threading.Thread(target=make) for _ in range(3)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
        assert len(told) == 2 and all("expected one call" in text for text in told), told
        thing.close()
""", str(cache))
    assert (ended.stderr, ended.returncode) == ("", 0)


def test_a_thread_that_closes_what_others_use_leaves_them_errors(cache):
    ended = run(CALLS + """
seed = random.randrange(10**6)
draw = random.Random(seed)
for _ in range(60):
    one = sd.Simulation("s_bend", cache=cache)
    many = sd.VectorSimulation("s_bend", 4, threads=2, cache=cache)
    def use(names):
        for name in names:
            try:
                calls[name]()
            except refused:
                pass
    threads = [threading.Thread(target=use, args=([draw.choice(names) for _ in range(8)],)) for _ in range(3)]
    for thread in threads: thread.start()
    time.sleep(draw.choice([0, 1e-3, 1e-2]))
    one.close(); many.close()
    for thread in threads: thread.join()
""", str(cache))
    assert (ended.stderr, ended.returncode) == ("", 0)


@pytest.mark.parametrize("raised", [KeyboardInterrupt, ZeroDivisionError, MemoryError])
def test_exceptions_in_the_conversion_of_an_argument_reach_the_caller(cache, raised):
    class Number:
        def __float__(self):
            raise raised

    one = sd.Simulation("s_bend", cache=cache)
    many = sd.VectorSimulation("s_bend", 1, cache=cache)
    given = np.array([[Number(), 0, 0]], object)
    for call in (lambda: one.project(given), lambda: many.step(np.array([[[Number(), 0]]], object))):
        with pytest.raises(raised):
            call()
