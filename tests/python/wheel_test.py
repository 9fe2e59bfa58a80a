#!/usr/bin/env python3
"""The Python client as a wheel: made without a network, installed from the file alone, imported from there."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def able(python):
    return subprocess.run([python, "-c", "import setuptools, wheel, pip, build"], stderr=subprocess.DEVNULL).returncode == 0


def main():
    python = next((p for p in (sys.executable, "/usr/bin/python3") if pathlib.Path(p).exists() and able(p)), None)
    if not python:
        print("skipped: build, pip, setuptools or wheel is missing (python3-build, python3-pip, python3-setuptools, python3-wheel)")
        return 77
    with tempfile.TemporaryDirectory(prefix="emtb-wheel-") as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "python", folder / "source", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "build"))
        pip = [python, "-m", "pip", "--disable-pip-version-check", "--no-input", "-q"]
        subprocess.run([python, "-m", "build", "--wheel", "--no-isolation", "-o", folder, folder / "source"], check=True, stdout=subprocess.DEVNULL)
        wheel = next(folder.glob("emtb-*-py3-none-any.whl"))
        subprocess.run([*pip, "install", "--no-index", "--no-deps", "--target", folder / "site", wheel], check=True)
        said = subprocess.run([python, "-c", "import emtb; print(emtb.__version__, emtb.__file__)"], cwd=folder, check=True, text=True,
                              stdout=subprocess.PIPE, env={"PYTHONPATH": str(folder / "site"), "PATH": "/usr/bin:/bin"}).stdout
    version, file = said.split()
    print(wheel.name, file)
    return 0 if version == "0.1.0" and str(folder / "site") in file else 1


if __name__ == "__main__":
    sys.exit(main())
