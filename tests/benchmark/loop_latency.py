#!/usr/bin/env python3
"""How punctual emtbd's loop is beside cyclictest, of the same priority and period, on the same processor.

    tests/benchmark/loop_latency.py [--pairs 10] [--seconds 30] [--rates 1000 10000] [--bin build/release/bin]

The daemon runs an experiment on a simulated bench with its recorder on and three subscribers at 50 Hz, SCHED_FIFO 80; then
cyclictest takes its place; then the other way round, and so on. All other processors are kept busy the whole time. What counts
is the ratio of the percentiles of each pair, and of these ratios the median: a machine that stalls does so in both. Needs root
(or the limits of systemd/emtbd.service) and cyclictest (Debian: apt-get install rt-tests), and a machine that does nothing else.
"""
import argparse
import json
import os
import re
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

PRIORITY = 80  # the loop's
SETTLE = 1.0  # [s] from the start of a run until it counts
PROFILE = "name: latency\nkind: step\nlevel: 2\nbefore: 0\nhold: {hold}\nafter: 0\n"


class Daemon:
    """A client of emtbd's socket."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r", encoding="utf-8")

    def call(self, method, **params):
        request = {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}
        self.socket.sendall((json.dumps(request) + "\n").encode())
        for line in self.lines:
            answer = json.loads(line)
            if "id" in answer:
                if "error" in answer:
                    sys.exit(f"loop_latency: emtbd: {answer['error']['message']}")
                return answer["result"]
        sys.exit("loop_latency: emtbd is gone")

    def drain(self):
        try:
            for _ in self.lines:
                pass
        except (OSError, ValueError):
            pass


def bin_edge(us):
    """The upper edge [us] of emtbd's histogram bin (daemon/lateness.h): eight an octave. cyclictest is held against the same."""
    if us < 8:
        return us + 1
    octave = us.bit_length() - 1
    return ((us >> (octave - 3)) + 1) << (octave - 3)


def percentile(histogram, share):
    """[us] of {upper edge [us]: count}, the counts of a bin spread evenly over it."""
    wanted = share * sum(histogram.values())
    below = 0
    for edge in sorted(histogram):
        width = 1 << max(0, (edge - 1).bit_length() - 4)
        if below + histogram[edge] >= wanted:
            return edge - width * (1 - (wanted - below) / histogram[edge])
        below += histogram[edge]
    return float("nan")


def measure_emtbd(folder, programs, rate, seconds, benches):
    with open(os.path.join(benches, "desk-simulated.yaml"), encoding="utf-8") as file:
        bench = file.read()
    bench = re.sub(r"(?m)^rate: \d+", f"rate: {rate}", bench)
    bench = re.sub(r"(?m)^realtime: \w+", "realtime: require", bench)
    bench = re.sub(r"(?m)^  time: 120 ", f"  time: {seconds + 60} ", bench)
    config, path = os.path.join(folder, "bench.yaml"), os.path.join(folder, "s")
    with open(config, "w", encoding="utf-8") as file:
        file.write(bench)
    with open(os.path.join(folder, "log"), "w", encoding="utf-8") as log:
        emtbd = subprocess.Popen([os.path.join(programs, "emtbd"), "--config", config, "--socket", path,
                                  "--data", os.path.join(folder, "data")], stderr=log)
    try:
        daemon = None
        while daemon is None:
            try:
                daemon = Daemon(path)
            except OSError:  # not yet
                if emtbd.poll() is not None:
                    with open(os.path.join(folder, "log"), encoding="utf-8") as log:
                        sys.exit(log.read().strip())
                time.sleep(0.05)
        for _ in range(3):
            subscriber = Daemon(path)
            subscriber.call("subscribe", rate=50)
            threading.Thread(target=subscriber.drain, daemon=True).start()
        daemon.call("reset")
        daemon.call("run", profile=PROFILE.format(hold=seconds + 30))
        time.sleep(SETTLE)
        before = daemon.call("status")
        time.sleep(seconds)
        after = daemon.call("status")
        if after["run"] is None:
            sys.exit(f"loop_latency: the run ended: {after['last_run']}")
        daemon.call("stop")
        while daemon.call("status")["run"] is not None:
            time.sleep(0.05)
    finally:
        emtbd.terminate()
        emtbd.wait()
    shutil.rmtree(os.path.join(folder, "data"))
    histogram = dict(after["loop"]["late_histogram"])
    for edge, count in before["loop"]["late_histogram"]:
        histogram[edge] -= count
    histogram = {edge: count for edge, count in histogram.items() if count > 0}
    return histogram, after["loop"]["missed"] - before["loop"]["missed"]


def measure_cyclictest(rate, seconds, processor):
    done = subprocess.run(["cyclictest", "--quiet", "--mlockall", "--threads=1", f"--affinity={processor}",
                           f"--priority={PRIORITY}", "--policy=fifo", f"--interval={round(1e6 / rate)}",
                           f"--duration={seconds:.0f}", "--histogram=1000000"],
                          capture_output=True, text=True, check=False)
    histogram = {}
    for line in done.stdout.splitlines():
        found = re.fullmatch(r"(\d+) (\d+)", line.strip())
        if found and int(found[2]) > 0:
            edge = bin_edge(int(found[1]))
            histogram[edge] = histogram.get(edge, 0) + int(found[2])
    if not histogram:
        sys.exit(f"loop_latency: cyclictest: {done.stderr.strip() or done.stdout.strip()}")
    return histogram


def main():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=30, help="of each measurement")
    parser.add_argument("--rates", type=int, nargs="+", default=[1000, 10000], help="[Hz]")
    parser.add_argument("--bin", default=os.path.join(root, "build/release/bin"), help="where emtbd is")
    options = parser.parse_args()
    if shutil.which("cyclictest") is None:
        sys.exit("loop_latency: cyclictest is missing. Install it: apt-get install rt-tests")
    processors = sorted(os.sched_getaffinity(0))
    if len(processors) < 2:
        sys.exit("loop_latency: there is but one processor, and that cannot be both idle and busy")
    loop_processor = processors[-1]  # as emtbd chooses
    load = [subprocess.Popen(["sh", "-c", "while :; do :; done"], preexec_fn=lambda p=p: os.sched_setaffinity(0, {p}))
            for p in processors[:-1]]
    worst = 0
    try:
        for rate in options.rates:
            ratios = {0.5: [], 0.99: []}
            print(f"{rate} Hz, {options.seconds:.0f} s each, wake-up latency [us]\n"
                  f"{'pair':>5} {'emtbd p50':>10} {'p99':>6} {'cyclictest p50':>15} {'p99':>6} {'ratio p50':>10} {'p99':>6}  missed")
            for pair in range(options.pairs):
                with tempfile.TemporaryDirectory() as folder:
                    ours = lambda: measure_emtbd(folder, options.bin, rate, options.seconds, os.path.join(root, "config/benches"))
                    theirs = lambda: measure_cyclictest(rate, options.seconds, loop_processor)
                    if pair % 2 == 0:
                        (mine, missed), other = ours(), theirs()
                    else:
                        other, (mine, missed) = theirs(), ours()
                p = {share: (percentile(mine, share), percentile(other, share)) for share in ratios}
                for share, (a, b) in p.items():
                    ratios[share].append(a / b)
                print(f"{pair + 1:>5} {p[0.5][0]:>10.1f} {p[0.99][0]:>6.0f} {p[0.5][1]:>15.1f} {p[0.99][1]:>6.0f} "
                      f"{ratios[0.5][-1]:>10.2f} {ratios[0.99][-1]:>6.2f}  {missed}", flush=True)
            medians = [statistics.median(ratios[share]) for share in (0.5, 0.99)]
            worst = max(worst, *medians)
            print(f"median ratio: p50 {medians[0]:.2f}, p99 {medians[1]:.2f}\n")
    finally:
        for process in load:
            process.kill()
            process.wait()
    return 0 if worst <= 1.2 else 1


if __name__ == "__main__":
    sys.exit(main())
