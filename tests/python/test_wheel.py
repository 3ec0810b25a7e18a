import importlib.util
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2]


def test_a_wheel_works_where_nothing_of_the_source_is(tmp_path):
    package = Path(os.environ["PYTHONPATH"].split(":")[0]).resolve() / "seldinger"
    command = [sys.executable, SOURCE / "app" / "python" / "wheel.py", "--package", package, "--out"]
    made = [Path(subprocess.run([*command, tmp_path / name], capture_output=True, text=True, check=True).stdout.strip())
            for name in ("a", "b")]
    assert made[0].read_bytes() == made[1].read_bytes()
    assert made[0].name.startswith("seldinger-") and made[0].suffix == ".whl"
    with zipfile.ZipFile(made[0]) as wheel:
        names = wheel.namelist()
        record = wheel.read(next(name for name in names if name.endswith("/RECORD"))).decode()
        wheel.extractall(tmp_path / "site")
    assert {line.split(",")[0] for line in record.splitlines()} == set(names)
    for needed in ("seldinger/__init__.py", "seldinger/py.typed", "seldinger/_core.pyi", "seldinger/gym/batch.py",
                   "seldinger/assets/scenarios/renal.toml", "seldinger/assets/devices/glide035.toml"):
        assert needed in names
    text = ("import seldinger as sd; sim = sd.Simulation('s_bend', cache=''); "
            "print(sd.__file__, sim.step(advance_mm=1).frame, len(sd.scenarios()), sd.gym.KEYS[0])")
    environment = {key: value for key, value in os.environ.items() if key != "SELDINGER_ASSETS"}
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path,
                            env=dict(environment, PYTHONPATH=str(tmp_path / "site")))
    assert result.stdout.split()[1:] == ["0", "23", "tracking2d"], result.stderr
    assert result.stdout.startswith(str(tmp_path / "site"))


def test_a_bundled_package_takes_every_library_but_the_c_library_from_itself(tmp_path):
    if not shutil.which("patchelf"):
        pytest.skip("no patchelf")
    package = Path(os.environ["PYTHONPATH"].split(":")[0]).resolve() / "seldinger"
    spec = importlib.util.spec_from_file_location("wheel", SOURCE / "app" / "python" / "wheel.py")
    wheel = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(wheel)
    copy, libs, platform = wheel.bundled(package, tmp_path)
    assert re.fullmatch(r"manylinux_2_\d+_\w+", platform)
    text = ("import seldinger as sd; sim = sd.Simulation('s_bend', cache=''); sim.step(); sim.image(64); "
            "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line}, sep='\\n')")
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path,
                            env={**os.environ, "PYTHONPATH": str(tmp_path), "SELDINGER_ASSETS": str(SOURCE / "assets")})
    assert result.returncode == 0, result.stderr
    loaded = {Path(line) for line in result.stdout.splitlines()}
    of_us = {path.name for path in loaded if path.parent == libs}
    assert {"libOSMesa.so.8", "libassimp.so.5"} & of_us or "libEGL.so.1" in of_us
    # Nothing of ours comes from the system as well.
    assert not {path for path in loaded if path.parent != libs and path.name in {p.name for p in libs.iterdir()}}
    metadata = wheel.metadata("1.2.3")
    for line in ("Version: 1.2.3", "License: MIT License", "Requires-Dist: numpy"):
        assert line in metadata.splitlines()
