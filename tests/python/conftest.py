"""Tests of the Python module as a user meets it. Run by ctest, label `python`."""

import os
from pathlib import Path

import pytest

import seldinger as sd

SOURCE = Path(__file__).resolve().parents[2]
CACHE = Path(os.environ.get("SELDINGER_TEST_CACHE", SOURCE / "build" / "python" / "cache"))
PROGRAM = os.environ.get("SELDINGER_PROGRAM", str(SOURCE / "build" / "release" / "bin" / "seldinger"))


@pytest.fixture(scope="session")
def cache():
    CACHE.mkdir(parents=True, exist_ok=True)
    return CACHE


@pytest.fixture(scope="session")
def program():
    if not os.access(PROGRAM, os.X_OK):
        pytest.skip(f"{PROGRAM} is not built")
    return PROGRAM


@pytest.fixture
def bend(cache):
    """A small exercise: a wire in an S-shaped tube."""
    with sd.Simulation("s_bend", cache=cache) as sim:
        yield sim


@pytest.fixture
def renal(cache):
    with sd.Simulation("renal", cache=cache) as sim:
        yield sim


@pytest.fixture
def cobra(cache):
    """With a catheter."""
    with sd.Simulation("renal_cobra", cache=cache) as sim:
        yield sim
