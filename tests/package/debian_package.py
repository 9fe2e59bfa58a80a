#!/usr/bin/env python3
"""The Debian package, as far as a folder can stand for a machine.

    debian_package.py --build DIR [--cpack CPACK]

Made twice it is the same. Installing starts nothing, an upgrade restarts nothing, a run that is on goes to its end under it,
sessions and what was edited stay. Programs that would act on this machine are put aside by others that note how they were called;
that in the place of systemctl ends emtbd where systemd would.
"""
import argparse
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from checks import check, run, wrong

STOOD_IN_FOR = ["systemctl", "systemd-sysusers", "systemd-tmpfiles", "udevadm"]


def made(build, cpack, folder):
    environment = os.environ | {"SOURCE_DATE_EPOCH": "1767225600"}
    result = run(cpack, "-G", "DEB", "-B", folder, cwd=build, env=environment)
    packages = list(folder.glob("*.deb"))
    if result.returncode != 0 or len(packages) != 1:
        sys.exit(f"cpack -G DEB ended with {result.returncode}:\n{result.stdout}")
    return packages[0]


def dead_links(folder):
    """Of the pages to files; the sources of tests are not in the package."""
    dead = []
    for page in folder.rglob("*.md"):
        for link in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
            if "://" in link or "../tests/" in link or link.startswith("tests/"):
                continue
            if not (page.parent / link).exists():
                dead.append(f"{page.relative_to(folder)}: {link}")
    return dead


def check_contents(package, root):
    run("dpkg-deb", "-x", package, root)
    files = {p.relative_to(root).as_posix() for p in root.rglob("*") if p.is_file()}
    for needed in ["usr/bin/emtb", "usr/bin/emtbd", "usr/bin/emtb-safe", "usr/bin/emtb-plant", "usr/lib/systemd/system/emtbd.service",
                   "usr/lib/sysusers.d/emtb.conf", "usr/lib/tmpfiles.d/emtb.conf", "usr/lib/udev/rules.d/60-emtb.rules",
                   "usr/share/emtb/bench.schema.json", "usr/share/emtb/benches/fh2-simulated.yaml", "usr/share/emtb/profiles/fh2_step_low.yaml",
                   "usr/share/emtb/models/fh2.yaml", "usr/share/man/man1/emtb.1.gz", "usr/share/man/man8/emtbd.8.gz",
                   "usr/share/man/man8/emtb-safe.8.gz", "usr/share/bash-completion/completions/emtb",
                   "usr/share/zsh/vendor-completions/_emtb", "usr/share/doc/emtb/copyright", "usr/share/doc/emtb/NOTICE",
                   "usr/share/doc/emtb/changelog.gz", "etc/needrestart/conf.d/emtb.conf"]:
        check(needed in files, f"the package lacks {needed}")
    check((root / "etc/emtb").is_dir(), "the package lacks the folder etc/emtb")
    check(not [f for f in files if ".wants/" in f], "the package enables a unit")
    dead = dead_links(root / "usr/share/doc/emtb")
    check(not dead, f"pages of the package point at what it lacks: {', '.join(dead[:5])}")
    needs = run("readelf", "-d", root / "usr/bin/emtb").stdout
    check("cholmod" not in needs.lower(), "emtb is linked with CHOLMOD, which the package's licence does not say")
    check(not [f for f in files if f.startswith(("usr/local", "work", "home", "tmp"))], "the package has files in odd places")
    unit = (root / "usr/lib/systemd/system/emtbd.service").read_text()
    check("\nConditionPathExists=/etc/emtb/bench.yaml\n" in unit, "the unit starts without a bench")
    check("ExecStart=/usr/bin/emtbd " in unit, "the unit starts another emtbd")
    for folder, pages in (("man1", ["emtb"]), ("man8", ["emtbd", "emtb-safe", "emtb-plant"])):
        for page in pages:
            text = gzip.open(next((root / "usr/share/man" / folder).glob(page + ".[18].gz")), "rt").read()
            check(".SH NAME" in text and ".TH " + page in text, f"{page} has no manual page")
    check(".SS emtb diagnose MODEL SESSION" in gzip.open(root / "usr/share/man/man1/emtb.1.gz", "rt").read(),
          "the manual page of emtb does not know diagnose")


def check_unpacked(root):
    """The programs find what lies beside them, wherever that is."""
    listed = run(root / "usr/bin/emtb", "profiles", "--json", "-")
    profiles = json.loads(listed.stdout)["profiles"] if listed.returncode == 0 else []
    check(profiles and all(p["file"].startswith(str(root)) for p in profiles), "emtb does not find the profiles of the package")
    out = root / "simulated.csv"
    simulated = run(root / "usr/bin/emtb", "simulate", root / "usr/share/emtb/models/fh2.yaml", "fh2_step_low", "--out", out)
    check(simulated.returncode == 0 and out.exists(), f"emtb of the package does not simulate: {simulated.stdout}")
    version = run(root / "usr/bin/emtbd", "--version").stdout
    check("(commit " in version, f"emtbd does not name its commit: {version}")


def check_completion(root):
    script = f"""source {root}/usr/share/bash-completion/completions/emtb
for words in 'emtb diag' 'emtb diagnose --held' 'emtb help rep' 'emtb bench ca' 'emtb simulate m.yaml fh2_st'; do
  COMP_WORDS=($words); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMPREPLY=(); _emtb; echo "${{COMPREPLY[*]}}"
done"""
    said = run("bash", "-c", script).stdout
    wanted = ["diagnose", "--held-out", "replay report", "calibrate", "fh2_staircase fh2_step_high fh2_step_low fh2_step_mid"]
    check([" ".join(sorted(line.split())) for line in said.splitlines()] == wanted, f"bash completes: {said!r}")
    check("'*--held-out[" in (root / "usr/share/zsh/vendor-completions/_emtb").read_text(), "zsh does not know --held-out")


def check_needrestart(root):
    script = ('our %nrconf; do $ARGV[0]; my ($no) = grep { "emtbd.service" =~ $_ } keys %{$nrconf{override_rc}}; '
              'print defined $no && $nrconf{override_rc}{$no} == 0 ? "left alone" : "restarted";')
    said = run("perl", "-e", script, root / "etc/needrestart/conf.d/emtb.conf").stdout
    check(said == "left alone", f"needrestart would restart emtbd: {said}")


def check_lintian(package):
    if not shutil.which("lintian"):
        print("lintian is not here: the package is not looked at by it")
        return
    said = run("lintian", "--no-cfg", "--allow-root", "--fail-on", "error,warning", package)
    check(said.returncode == 0, f"lintian says: {said.stdout}")


class Machine:
    """A folder with a dpkg of its own."""

    def __init__(self, folder, runs):
        """@param runs whether systemd says that emtbd does"""
        self.root, self.calls, self.pid = folder / "root", folder / "calls", folder / "emtbd.pid"
        for path in ("var/lib/dpkg/info", "var/lib/dpkg/updates", "run/systemd/system"):
            (self.root / path).mkdir(parents=True)
        (self.root / "var/lib/dpkg/status").touch()
        (folder / "bin").mkdir()
        for name in STOOD_IN_FOR:
            stand_in = folder / "bin" / name
            stand_in.write_text(f'#!/bin/sh\necho {name} "$@" >>{self.calls}\n[ "$1" != is-active ] || exit {0 if runs else 3}\n'
                                f'case "$*" in *stop*|*restart*|*disable*|*kill*) if [ -e {self.pid} ]; then kill "$(cat {self.pid})"; fi ;; esac\n')
            stand_in.chmod(0o755)
        self.path = f"{folder / 'bin'}:{os.environ['PATH']}:/usr/sbin:/sbin"

    def dpkg(self, *words):
        """What it said, and how the programs that act on a machine were called."""
        self.calls.write_text("")
        result = run("dpkg", "--force-not-root", "--force-depends", "--force-script-chrootless", "--force-confold",
                     f"--root={self.root}", *words, env=os.environ | {"PATH": self.path, "DEBIAN_FRONTEND": "noninteractive"})
        check(result.returncode == 0, f"dpkg {words[0]} ended with {result.returncode}: {result.stdout}")
        return result.stdout, self.calls.read_text()


def check_fresh(package, folder):
    said, called = Machine(folder, runs=False).dpkg("-i", package)
    check("nothing was started" in said and "/etc/emtb/bench.yaml" in said, f"installing does not say what comes next: {said}")
    for word in ("start", "restart", "enable", "try-restart"):
        check(f"systemctl {word}" not in called, f"installing calls systemctl {word}")
    check("systemd-sysusers" in called and "systemctl daemon-reload" in called, f"installing calls only: {called}")


def check_life(package, folder):
    machine = Machine(folder, runs=True)
    root = machine.root
    machine.dpkg("-i", package)
    bench, override = root / "etc/emtb/bench.yaml", root / "etc/needrestart/conf.d/emtb.conf"
    session = root / "var/lib/emtb/sessions/run.h5"
    bench.write_text("mine\n")
    session.parent.mkdir(parents=True, exist_ok=True)
    session.write_text("readings\n")
    override.write_text(override.read_text() + "# edited\n")

    said, called = machine.dpkg("-i", package)
    check("goes on as it was" in said and "systemctl restart emtbd" in said, f"an upgrade does not say that a restart is due: {said}")
    check("stop" not in called and "restart" not in called and "disable" not in called, f"an upgrade calls: {called}")
    check("# edited" in override.read_text(), "an upgrade overwrites what was edited")

    said, called = machine.dpkg("-r", "emtb")
    check("systemctl disable --now emtbd.service" in called, "removing leaves the daemon without its programs")
    check(not (root / "usr/bin/emtbd").exists(), "removing leaves emtbd")
    for kept in (bench, session, override):
        check(kept.exists(), f"removing takes {kept.relative_to(root)}")
    said, called = machine.dpkg("-P", "emtb")
    check(session.read_text() == "readings\n" and bench.exists(), "purging takes sessions or the bench")
    check("sessions stay" in said and not override.exists(), f"purging says: {said}")


def run_to_its_end(package, machine, took, folder):
    """Starts a run, puts the package over the programs that make it, and waits until it has ended."""
    root, socket = machine.root, folder / "emtb.sock"
    bench, profile = root / "etc/emtb/bench.yaml", folder / "turn.yaml"
    shutil.copy(root / "usr/share/emtb/benches/fh2-simulated.yaml", bench)
    profile.write_text(f"name: turn\nkind: step\nlevel: 3\nbefore: 0.5\nhold: {max(5, 3 * took):.0f}\nafter: 0.5\n")
    emtbd, emtb = root / "usr/bin/emtbd", [root / "usr/bin/emtb", "--socket", socket]
    with open(folder / "emtbd.log", "w") as log, open(folder / "run.json", "w+") as ended:
        daemon = subprocess.Popen([emtbd, "--config", bench, "--socket", socket, "--data", folder], stdout=log, stderr=log)
        machine.pid.write_text(str(daemon.pid))
        turning = None
        try:
            for _ in range(200):
                if socket.exists() or daemon.poll() is not None:
                    break
                time.sleep(0.05)
            turning = subprocess.Popen([*emtb, "run", profile, "--reset", "--json", folder / "ended.json"], stdout=ended, stderr=ended)
            state = lambda: json.loads(run(*emtb, "status", "--json", "-").stdout or "{}").get("state")
            for _ in range(200):
                if state() == "running" or turning.poll() is not None:
                    break
                time.sleep(0.05)
            before = state()
            said, called = machine.dpkg("-i", package)
            check(before == state() == "running", f"no run is on before and after the upgrade, but {before} and {state()}")
            check("goes on as it was" in said, f"an upgrade with a run on says: {said}")
            check(daemon.poll() is None, f"an upgrade ends the emtbd that makes a run: {called}")
            check(os.stat(f"/proc/{daemon.pid}/exe").st_ino != emtbd.stat().st_ino, "the upgrade did not replace the programs")
            turning.wait(120)
        finally:
            for process in (turning, daemon):
                if process is not None and process.poll() is None:
                    process.terminate()
                    process.wait(30)
        ended.seek(0)
        outcome = json.loads((folder / "ended.json").read_text())["outcome"] if (folder / "ended.json").exists() else ended.read()
        check(turning.returncode == 0 and outcome == "done", f"a run that was on during an upgrade ended: {outcome}")


def check_upgrade_with_a_run_on(package, folder):
    machine = Machine(folder, runs=True)
    begin = time.monotonic()
    machine.dpkg("-i", package)
    run_to_its_end(package, machine, time.monotonic() - begin, folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--cpack", default="cpack")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="emtb-package-") as name:
        folder = pathlib.Path(name)
        for part in ("first", "second", "files", "fresh", "machine", "turning"):
            (folder / part).mkdir()
        package = made(given.build, given.cpack, folder / "first")
        again = made(given.build, given.cpack, folder / "second")
        check(package.read_bytes() == again.read_bytes(), "made twice, the package is not the same")
        check_contents(package, folder / "files")
        check_lintian(package)
        check_unpacked(folder / "files")
        check_completion(folder / "files")
        check_needrestart(folder / "files")
        check_fresh(package, folder / "fresh")
        check_life(package, folder / "machine")
        check_upgrade_with_a_run_on(package, folder / "turning")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
