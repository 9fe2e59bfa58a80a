#!/usr/bin/env python3
"""What `cmake --install` puts into a folder that is not /usr belongs together.

    prefix.py --build DIR [--cmake CMAKE]

The unit starts the programs of that folder, and a bench that is copied out of it still finds what it names.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from checks import check, run, wrong


def installed(cmake, build, prefix, cwd=None):
    result = run(cmake, "--install", build, "--prefix", prefix, cwd=cwd)
    if result.returncode != 0:
        sys.exit(f"cmake --install ended with {result.returncode}:\n{result.stdout}")


def check_unit(prefix):
    unit = (prefix / "lib/systemd/system/emtbd.service").read_text()
    programs = re.findall(r"^Exec\w+=-?(\S+)", unit, flags=re.M)
    check(len(programs) >= 3, f"the unit starts only {programs}")
    for program in programs:
        check(program.startswith(f"{prefix}/bin/") and pathlib.Path(program).exists(), f"the unit of {prefix} starts {program}")
    check("/usr/" not in unit.replace(str(prefix), ""), "the unit names files of /usr")


def check_manual(prefix):
    text = subprocess.run(["gzip", "-dc", prefix / "share/man/man1/emtb.1.gz"], capture_output=True, text=True).stdout
    check(".SS emtb diagnose" in text, "the manual page is not there")


def check_bench(prefix, folder):
    """As /etc/emtb/bench.yaml is: away from the models and programs beside it."""
    for name in ("fh2-simulated", "desk-program"):
        bench = folder / "etc" / f"{name}.yaml"
        bench.parent.mkdir(exist_ok=True)
        shutil.copy(prefix / "share/emtb/benches" / f"{name}.yaml", bench)
        said = run(prefix / "bin/emtb", "bench", "check", bench)
        check(said.returncode == 0 and "Every signal reads" in said.stdout, f"a copy of {name} does not read: {said.stdout}")
        if name == "desk-program":  # the sources have one as well: without ours there is none that works
            ours = prefix / "share/emtb/devices/toy_motor.py"
            ours.write_text("raise SystemExit('of this folder')\n")
            said = run(prefix / "bin/emtb", "bench", "check", bench)
            check("of this folder" in said.stdout, f"a copy of {name} starts another program than that of its folder: {said.stdout}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--cmake", default="cmake")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="emtb-prefix-") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)  # root's programs become nobody
        build = given.build.resolve()
        installed(given.cmake, build, folder / "emtb")
        check_unit(folder / "emtb")
        check_manual(folder / "emtb")
        check_bench(folder / "emtb", folder)
        installed(given.cmake, build, "beside", cwd=folder)
        check_unit(folder / "beside")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
