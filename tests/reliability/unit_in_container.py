#!/usr/bin/env python3
"""emtbd.service as it is shipped, sandbox included, in a machine of its own that systemd has booted.

    tests/reliability/unit_in_container.py [--kills 10] [--bin build/release/bin]

Needs root and systemd-nspawn (apt-get install systemd-container dbus). The container has this machine's /usr, read-only, and
otherwise only what the unit needs: its user, a bench with a plant in a process of its own, the programs. Every line of the shipped
unit counts but the paths of the programs. Asked is what unit_under_systemd.py asks, and what the sandbox really refuses.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile

import unit_under_systemd as proof

HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAMS, TESTS = "/opt/emtb/bin", "/opt/emtb/reliability"
JOB = f"""[Unit]
Description=asks the unit
After=dbus.service
[Service]
Type=oneshot
Environment=EMTB_KILLS=%KILLS%
ExecStart=/usr/bin/python3 -B {TESTS}/unit_in_container.py --inside
ExecStopPost=/bin/sh -c 'systemctl exit $$(cat /result 2>/dev/null || echo 2)'
StandardOutput=append:/told
StandardError=append:/told
"""


def write(path, text, mode=0o644):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    os.chmod(path, mode)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def root_folder(folder, kills):
    """What the container finds at /, but for /usr and the programs."""
    os.chmod(folder, 0o755)
    for name in ("bin", "sbin", "lib", "lib64"):
        os.symlink(f"usr/{name}", f"{folder}/{name}")
    for name in ("usr", "proc", "sys", "dev", "run", "tmp", "var/lib", "opt/emtb/bin", "opt/emtb/reliability", "opt/emtb/config", "root"):
        os.makedirs(f"{folder}/{name}")
    shutil.copy("/usr/lib/os-release", f"{folder}/etc-os-release")
    write(f"{folder}/etc/os-release", read("/usr/lib/os-release"))
    os.unlink(f"{folder}/etc-os-release")
    write(f"{folder}/etc/passwd", "root:x:0:0:root:/root:/bin/sh\nmessagebus:x:100:100::/:/bin/false\n"
                                  "emtb:x:990:990::/var/lib/emtb:/bin/false\n")
    write(f"{folder}/etc/group", "root:x:0:\nmessagebus:x:100:\nemtb:x:990:\ndialout:x:20:\nplugdev:x:46:\ntty:x:5:\nkmem:x:15:\n"
                                 "disk:x:6:\nlp:x:7:\ncdrom:x:24:\naudio:x:29:\nvideo:x:44:\ninput:x:101:\nsgx:x:102:\nkvm:x:103:\n"
                                 "render:x:104:\nutmp:x:43:\ntape:x:26:\nsystemd-journal:x:105:\n")
    bench = read(os.path.join(proof.ROOT, "config/benches/desk-simulated.yaml"))
    write(f"{folder}/etc/emtb/bench.yaml", bench.replace("\nsimulation:\n", "\nsimulation:\n  process: emtb-unit\n"))
    unit = read(os.path.join(proof.ROOT, "systemd/emtbd.service")).replace("/usr/bin/emtb", f"{PROGRAMS}/emtb")
    write(f"{folder}/etc/systemd/system/emtbd.service",
          unit.replace("[Service]\n", "[Service]\nStandardOutput=append:/emtbd.log\nStandardError=append:/emtbd.log\n"))
    write(f"{folder}/etc/systemd/system/ask.service", JOB.replace("%KILLS%", str(kills)))
    write(f"{folder}/etc/systemd/system/ask.target", "[Unit]\nDescription=all there is\nRequires=basic.target ask.service\n"
                                                     "After=basic.target\nAllowIsolate=yes\n")
    os.symlink("ask.target", f"{folder}/etc/systemd/system/default.target")


class ContainersBench(proof.Bench):
    """The same bench, with the system's own manager."""

    def __init__(self):  # pylint: disable=super-init-not-called
        self.folder, self.programs = "/root", PROGRAMS
        self.write("endless.yaml", proof.PROFILE)
        # The unit's RemoveIPC removes what user emtb leaves behind: the plant belongs to root, and lets the unit in.
        self.plant = subprocess.Popen([f"{PROGRAMS}/emtb-plant", "--config", "/etc/emtb/bench.yaml", "--log", "/root/reference"],
                                      stdout=subprocess.DEVNULL)
        proof.eventually("the plant lives", lambda: os.path.exists("/dev/shm/emtb-unit"))
        os.chmod("/dev/shm/emtb-unit", 0o666)

    def systemctl(self, *words):
        return subprocess.run(["systemctl", *words], capture_output=True, text=True, check=False)

    def emtb(self, *words):
        return subprocess.run([f"{PROGRAMS}/emtb", "--socket", "/run/emtb/emtb.sock", *words], capture_output=True, text=True,
                              check=False)

    def client_words(self):
        return [f"{PROGRAMS}/emtb", "--socket", "/run/emtb/emtb.sock", "run", "--reset", "/root/endless.yaml"]

    def end(self):
        self.systemctl("stop", "emtbd")
        self.plant.terminate()
        self.plant.wait()


def sandbox(bench):
    """What the daemon may do, asked of the kernel: its own view of files, its rights, its filter of system calls."""
    pid = bench.show("MainPID")
    status = dict(re.findall(r"(\w+):\s*(.*)", read(f"/proc/{pid}/status")))
    assert status["Uid"].split()[0] == "990", f"runs as emtb: {status['Uid']}"
    assert status["NoNewPrivs"] == "1" and status["Seccomp"] == "2", status
    for rights in ("CapEff", "CapPrm", "CapBnd", "CapAmb"):
        assert int(status[rights], 16) == 0, f"no capability: {rights} {status[rights]}"
    mounts = {line.split()[4]: line.split()[5].split(",") for line in read(f"/proc/{pid}/mountinfo").splitlines()}
    assert "ro" in mounts["/"], f"nothing but its own folders can be written: {mounts['/']}"
    for own in ("/run/emtb", "/var/lib/emtb"):
        assert "rw" in mounts[own], f"{own}: {mounts.get(own)}"
    inside = ["nsenter", "-t", pid, "-m", "setpriv", "--reuid=990", "--regid=990", "--clear-groups", "--no-new-privs"]
    for what, words in (("/etc", ["touch", "/etc/x"]), ("/opt", ["touch", f"{PROGRAMS}/x"]), ("kernel settings", ["sh", "-c", "echo 1 > /proc/sys/vm/swappiness"])):
        asked = subprocess.run([*inside, *words], capture_output=True, check=False)
        assert asked.returncode != 0, f"{what} cannot be written"
    print("sandbox: user emtb, no capability, no new privileges, system calls filtered; all read-only but /run/emtb and /var/lib/emtb")
    print("limits: " + "; ".join(" ".join(line.split()) for line in read(f"/proc/{pid}/limits").splitlines() if re.match("Max (locked|realtime p)", line)))
    print("real time under it: " + "; ".join(re.findall(r"real time: (.*)", read("/emtbd.log"))))


def inside():
    good = False
    bench = ContainersBench()
    try:
        proof.eventually("the system is up", lambda: bench.systemctl("list-units").returncode == 0)
        proof.prove(bench, int(os.environ["EMTB_KILLS"]), and_then=sandbox)
        good = True
    except AssertionError as error:
        print(f"unit_in_container: {error}\n{bench.systemctl('status', '--no-pager', '-l', 'emtbd').stdout}")
    finally:
        bench.end()
    write("/result", "0" if good else "1")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--bin", default=os.path.join(proof.ROOT, "build/release/bin"), help="where emtbd is")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        return inside()
    if os.getuid() != 0:
        sys.exit("unit_in_container: needs root")
    if shutil.which("systemd-nspawn") is None:
        sys.exit("unit_in_container: systemd-nspawn is missing. Install it: apt-get install systemd-container dbus")
    folder = tempfile.mkdtemp(prefix="emtb_container_")
    try:
        root_folder(folder, options.kills)
        # LimitMEMLOCK and LimitRTPRIO raise limits, which a container's manager may only with these.
        ended = subprocess.run(["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", f"--directory={folder}",
                                "--capability=CAP_SYS_RESOURCE,CAP_SYS_NICE,CAP_IPC_LOCK", "--bind-ro=/usr", "--bind-ro=/etc/alternatives",
                                f"--bind-ro={os.path.abspath(options.bin)}:{PROGRAMS}", f"--bind-ro={HERE}:{TESTS}",
                                f"--machine=emtb-unit-{os.getpid()}", "--console=pipe"],
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=900)
        told = read(f"{folder}/told") if os.path.exists(f"{folder}/told") else ended.stdout[-3000:]
        print(told, end="")
        if ended.returncode != 0:
            log = f"{folder}/emtbd.log"
            print(f"unit_in_container: ended with {ended.returncode}; emtbd said:\n" + (read(log)[-3000:] if os.path.exists(log) else "nothing"))
        return ended.returncode
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
