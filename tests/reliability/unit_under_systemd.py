#!/usr/bin/env python3
"""emtbd.service under a living systemd: ready, killed, hung, stopped; and from outside, what the reference did.

    tests/reliability/unit_under_systemd.py [--kills 10] [--bin build/release/bin]

Needs root and systemd installed; the machine need not be booted with it. A manager of our own (systemd --user) is started in a
control group and a mount namespace of its own. It takes the shipped unit without what only the system's manager may do: user,
groups, devices, sandbox, which unit_in_container.py looks at. What stands here are ExecStart, notify, watchdog, ExecStopPost,
Restart, the limit of starts, priorities.
The plant lives in a process of its own and logs what its reference is.
"""
import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SYSTEMD = "/lib/systemd/systemd"
KEPT = {"Description", "StartLimitIntervalSec", "StartLimitBurst", "Type", "ExecStart", "ExecStopPost", "Restart", "RestartSec",
        "WatchdogSec", "TimeoutStopSec", "UMask", "Nice", "LimitRTPRIO", "LimitMEMLOCK"}
PROFILE = "name: endless\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n"


def own_control_group():
    """Below the root of each hierarchy that a manager uses, before it starts: it takes every process of its group for its own.

    @return [(hierarchy, where we were in it)]"""
    name = f"emtb-unit-{os.getpid()}"
    top = "/sys/fs/cgroup"
    with open("/proc/self/cgroup", encoding="ascii") as file:
        were = {line.split(":")[1]: line.rstrip().split(":", 2)[2] for line in file}
    if os.path.exists(f"{top}/cgroup.procs"):
        hierarchies = [(top, were[""])]
    else:
        hierarchies = [(f"{top}/{folder}", were[controller]) for folder, controller in
                       (("unified", ""), ("systemd", "name=systemd"), ("pids", "pids"), ("memory", "memory")) if controller in were]
    for hierarchy, _ in hierarchies:
        os.mkdir(f"{hierarchy}/{name}")
        move(os.getpid(), f"{hierarchy}/{name}")
    with open("/proc/self/cgroup", encoding="ascii") as file:
        ours = [line for line in file if re.match(r"(\d+:name=systemd|0:):", line)]
    if not all(line.rstrip().endswith(f"/{name}") for line in ours):
        leave_control_group(hierarchies)
        sys.exit("unit_under_systemd: no control group of our own can be had here: " + " ".join(ours))
    return hierarchies


def move(pid, group):
    with open(f"{group}/cgroup.procs", "w", encoding="ascii") as file:
        file.write(str(pid))


def leave_control_group(hierarchies):
    for hierarchy, before in hierarchies:
        group = f"{hierarchy}/emtb-unit-{os.getpid()}"
        for folder in sorted((folder for folder, _, _ in os.walk(group)), key=len, reverse=True):
            with open(f"{folder}/cgroup.procs", encoding="ascii") as file:
                pids = file.read().split()
            for pid in pids:
                try:
                    move(pid, hierarchy + before)
                except OSError:  # it has gone
                    pass
            try:
                os.rmdir(folder)
            except OSError as error:
                print(f"unit_under_systemd: {folder} stays behind: {error}")


def unit(folder, programs):
    """The shipped unit, as far as a user's manager takes it."""
    with open(os.path.join(ROOT, "systemd/emtbd.service"), encoding="utf-8") as file:
        lines = file.read().splitlines()
    kept = [line for line in lines if line in ("[Unit]", "[Service]") or line.split("=")[0] in KEPT]
    text = "\n".join(kept) + f"\nStandardOutput=append:{folder}/log\nStandardError=append:{folder}/log\n"
    for installed, here in (("/usr/bin", programs), ("/etc/emtb", folder), ("/run/emtb/emtb.sock", f"{folder}/s"),
                            ("/var/lib/emtb", folder)):
        text = text.replace(installed, here)
    return text


class Bench:
    def __init__(self, folder, programs):
        self.folder, self.programs = folder, programs
        with open(os.path.join(ROOT, "config/benches/desk-simulated.yaml"), encoding="utf-8") as file:
            bench = file.read()
        self.write("bench.yaml", bench.replace("\nsimulation:\n", f"\nsimulation:\n  process: emtb-unit-{os.getpid()}\n"))
        self.write("endless.yaml", PROFILE)
        self.plant = subprocess.Popen([f"{programs}/emtb-plant", "--config", f"{folder}/bench.yaml", "--log", f"{folder}/reference"],
                                      stdout=subprocess.DEVNULL)
        os.makedirs(f"{folder}/units")
        self.write("units/emtbd.service", unit(folder, programs))
        for target in ("default", "basic", "shutdown"):  # that every service wants
            self.write(f"units/{target}.target", "[Unit]\nDescription=nothing more\n")
        os.makedirs(f"{folder}/runtime", mode=0o700)
        self.surroundings = {"PATH": os.environ["PATH"], "HOME": folder, "XDG_RUNTIME_DIR": f"{folder}/runtime",
                             "SYSTEMD_UNIT_PATH": f"{folder}/units"}
        self.manager = subprocess.Popen([SYSTEMD, "--user", "--unit=default.target"], env=self.surroundings)

    def write(self, name, text):
        with open(f"{self.folder}/{name}", "w", encoding="utf-8") as file:
            file.write(text)

    def systemctl(self, *words):
        return subprocess.run(["systemctl", "--user", *words], env=self.surroundings, capture_output=True, text=True, check=False)

    def show(self, key):
        return self.systemctl("show", "emtbd", "-P", key).stdout.strip()

    def emtb(self, *words):
        return subprocess.run([f"{self.programs}/emtb", "--socket", f"{self.folder}/s", *words], capture_output=True, text=True, check=False)

    def references(self):
        """[(t, V)] as the plant saw them."""
        with open(f"{self.folder}/reference", encoding="ascii") as file:
            return [tuple(map(float, line.split(","))) for line in file.read().splitlines()[1:] if line.count(",") == 1]

    def client_words(self):
        return [f"{self.programs}/emtb", "--socket", f"{self.folder}/s", "run", "--reset", f"{self.folder}/endless.yaml"]

    def begin_run(self):
        """@return the client's process; the motor turns"""
        words = self.client_words()
        for _ in range(3):  # a machine that stalls may need a second attempt
            run = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            eventually("the motor turns", lambda: run.poll() is not None or (self.references() and self.references()[-1][1] == 3))
            if run.poll() is None:
                return run
        raise AssertionError("no run begins")

    def end(self):
        self.systemctl("stop", "emtbd")
        self.manager.kill()  # it would look for an exit.target
        self.manager.wait()
        self.plant.terminate()
        self.plant.wait()
        try:
            os.unlink(f"/dev/shm/emtb-unit-{os.getpid()}")
        except FileNotFoundError:
            pass


def eventually(what, is_so, seconds=30):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if is_so():
            return
        time.sleep(0.01)
    raise AssertionError(f"not within {seconds} s: {what}")


def safe_after(bench, since):
    """[s] from `since` until the plant's reference was 0 and stayed so."""
    eventually("the reference is safe", lambda: bench.references()[-1][1] == 0)
    return bench.references()[-1][0] - since


def back_again(bench, pid):
    def answers():
        return bench.show("MainPID") not in ("0", pid) and bench.show("ActiveState") == "active"
    eventually("systemd has started it again", answers)
    told = bench.emtb("status")
    assert told.returncode == 0 and ": latched" in told.stdout, f"it answers, latched: {told}"


def prove(bench, kills, and_then=lambda bench: None):
    """@param and_then what else is asked of a daemon that has just started"""
    eventually("the manager answers", lambda: bench.systemctl("list-units").returncode == 0)
    started = bench.systemctl("start", "emtbd")  # returns when READY=1 was seen, or not at all
    assert started.returncode == 0, started.stderr
    told = bench.emtb("status")
    assert bench.show("StatusErrno") == "0" and told.returncode == 0, f"it answers: {told}"
    print("ready: systemctl start returned with READY=1, and the socket answers")
    and_then(bench)

    took = []
    for _ in range(kills):
        bench.systemctl("reset-failed", "emtbd")  # the unit's limit of five starts a minute is not what is asked here
        client, pid = bench.begin_run(), bench.show("MainPID")
        at = time.monotonic()
        os.kill(int(pid), signal.SIGKILL)
        took.append(safe_after(bench, at))
        client.wait()
        back_again(bench, pid)
    took.sort()
    print(f"kill -9 in a run, {kills} times: reference safe after {1e3 * took[len(took) // 2]:.0f} ms (median), "
          f"{1e3 * took[-1]:.0f} ms at most, by ExecStopPost; started again by systemd, latched, each time")

    bench.systemctl("reset-failed", "emtbd")
    client, pid = bench.begin_run(), bench.show("MainPID")
    at = time.monotonic()
    os.kill(int(pid), signal.SIGSTOP)
    took = safe_after(bench, at)
    client.wait()
    back_again(bench, pid)
    print(f"stopped for good (SIGSTOP) in a run: the watchdog ended it, reference safe after {took:.1f} s; started again, latched")

    client = bench.begin_run()
    stopped = bench.systemctl("stop", "emtbd")
    client.wait()
    assert stopped.returncode == 0 and bench.show("ActiveState") == "inactive" and bench.show("Result") == "success", stopped
    assert bench.references()[-1][1] == 0
    print("systemctl stop in a run: ended well, reference safe")

    bench.systemctl("reset-failed", "emtbd")
    bench.systemctl("start", "emtbd")
    deaths = 0
    while bench.show("ActiveState") != "failed" and deaths < 10:
        pid = bench.show("MainPID")
        os.kill(int(pid), signal.SIGKILL)
        deaths += 1
        eventually("it is up again, or given up",
                   lambda: bench.show("ActiveState") == "failed"
                   or (bench.show("ActiveState") == "active" and bench.show("MainPID") not in ("0", pid)))  # pylint: disable=cell-var-from-loop
    assert deaths == 5 and bench.systemctl("start", "emtbd").returncode != 0, f"it stays down after {deaths} deaths"
    print("killed five times in a minute: it stays down, until a person says otherwise")


def inside(options):
    hierarchies = own_control_group()
    bench, good = None, False
    folder = tempfile.mkdtemp(prefix="emtb_unit_")
    try:
        subprocess.run(["mount", "-t", "tmpfs", "none", "/run"], check=True)  # of this mount namespace alone
        os.makedirs("/run/systemd/system")  # what tells systemd's programs that it is there
        bench = Bench(folder, os.path.abspath(options.bin))
        prove(bench, options.kills)
        good = True
    except AssertionError as error:
        print(f"unit_under_systemd: {error}")
        if os.path.exists(f"{folder}/log"):
            with open(f"{folder}/log", encoding="utf-8") as log:
                print(log.read()[-2000:])
    finally:
        if bench is not None:
            bench.end()
        leave_control_group(hierarchies)
        shutil.rmtree(folder)
    return 0 if good else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--bin", default=os.path.join(ROOT, "build/release/bin"), help="where emtbd is")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        return inside(options)
    if os.getuid() != 0:
        sys.exit("unit_under_systemd: needs root: control groups and mounts of its own")
    if not os.path.exists(SYSTEMD) or shutil.which("systemctl") is None:
        sys.exit("unit_under_systemd: systemd is missing. Install it: apt-get install systemd")
    return subprocess.run(["unshare", "--mount", "--propagation", "private", sys.executable, os.path.abspath(__file__), "--inside",
                           "--kills", str(options.kills), "--bin", options.bin], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
