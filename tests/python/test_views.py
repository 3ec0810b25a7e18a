"""Views of the C-arm as arrays."""

import json
import subprocess

import numpy as np
import pytest

import seldinger as sd


def test_are_those_of_the_program(program, cache):
    made = sd.views("s_bend", branch="tube", from_mm=20, to_mm=60, cache=cache)
    assert made["lao_deg"].shape == (49,) and made["cranial_deg"].shape == (19,)
    for name in ("foreshortening", "overlap", "ostium_deg", "cost"):
        assert made[name].shape == (19, 49) and made[name].dtype == np.float64
    assert made["free"].shape == (19, 49) and made["free"].dtype == bool
    assert made["best_deg"].shape == (3, 2)
    said = subprocess.run([program, "views", "s_bend", "--branch", "tube", "--from-mm", "20", "--to-mm", "60", "--json",
                           "--cache", str(cache)], check=True, capture_output=True, text=True).stdout
    step = json.loads(said)["steps"][0]
    assert made["target"] == step["target"]
    for (lao, cranial), best in zip(made["best_deg"], step["best"]):
        assert (lao, cranial) == pytest.approx((best["lao_deg"], best["cranial_deg"]), abs=1e-3)
        at = np.argmin(abs(made["cranial_deg"] - cranial)), np.argmin(abs(made["lao_deg"] - lao))
        assert made["cost"][at] == pytest.approx(best["cost"], abs=1e-5)
        assert made["foreshortening"][at] == pytest.approx(best["foreshortening"], abs=1e-5)
        assert made["free"][at]


def test_rows_are_cranial_angles(cache):
    # A straight tube along x: end on from the side, whatever the other angle is not.
    made = sd.views("straight", branch="tube", from_mm=20, to_mm=60, step_deg=15, cache=cache)
    lao, cranial = np.meshgrid(np.deg2rad(made["lao_deg"]), np.deg2rad(made["cranial_deg"]))
    along = np.sin(lao) * np.cos(cranial)
    np.testing.assert_allclose(made["foreshortening"], 1 - np.sqrt(1 - along ** 2), atol=1e-6)


@pytest.mark.parametrize("wrong, said", [
    ({"branch": "tub", "from_mm": 0, "to_mm": 9}, "expected a branch of"),
    ({"branch": "tube", "from_mm": 9, "to_mm": 9}, "at least 1 mm long"),
    ({"branch": "tube", "from_mm": 9, "to_mm": 9e9}, "from the origin of tube"),
    ({"branch": "tube", "from_mm": float("nan"), "to_mm": 9}, "from the origin of tube, found nan"),
    ({"branch": "tube"}, "expected branch, from_mm and to_mm together"),
    ({"from_mm": 3}, "expected branch, from_mm and to_mm together"),
    ({"side": "tube"}, "side: expected a branch with it"),
    ({"contrast": "x"}, "contrast: expected a branch of"),
    ({"branch": 3}, "branch: 3 was given"),
    ({"step_deg": 0}, "expected a step of"),
    ({"apart_deg": 0}, "apart_deg: 0 was given"),
    ({"cache": 3}, "cache: 3 was given"),
])
def test_refuse_what_is_no_stretch(cache, wrong, said):
    with pytest.raises(sd.InputError, match=said):
        sd.views("straight", **{"cache": cache, **wrong})
