import os
import subprocess
import sys
import zipfile
from pathlib import Path

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
