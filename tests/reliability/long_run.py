#!/usr/bin/env python3
"""A bench that works for hours: runs with pauses, and what becomes of memory, descriptors and lateness.

    tests/reliability/long_run.py --hours 24 --pace max [--csv FILE] [--bin build/release/bin]     a simulated day
    tests/reliability/long_run.py --hours 1 [--csv FILE]                                           an hour of real time
    tests/reliability/long_run.py --plot FILE.csv... --svg FILE.svg                                draws them

A run takes a minute of the bench's time, a pause six seconds; at --pace max pauses count with them, as idle time passes at
the pace of people. Live estimates, a subscriber and the recorder are on. Of the recordings the last twenty are kept. One line of
CSV for each run: hours of bench time, seconds of the wall, resident and locked memory, descriptors, threads, lateness.
"""
import argparse
import csv
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
RUN, PAUSE = 60, 6  # [s] of the bench's time
PROFILE = """name: minute
kind: random_steps
low: 0.5
high: 6
shortest: 1.5
longest: 5
before: 1
total: 53
after: 6
seed: 2011
"""
COLUMNS = ["hours", "wall_s", "resident_MB", "locked_MB", "descriptors", "threads", "late_p50_us", "late_p99_us", "missed", "outcome"]


class Daemon:
    """A client of the socket: a line of JSON each way."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(600)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r", encoding="utf-8")
        self.number = 0

    def call(self, method, **params):
        self.number += 1
        self.socket.sendall((json.dumps({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params}) + "\n").encode())
        for line in self.lines:
            answer = json.loads(line)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
        raise RuntimeError("emtbd has gone")

    def end_of_run(self):
        for line in self.lines:
            message = json.loads(line)
            if message.get("method") == "ended":
                return message["params"]
        raise RuntimeError("emtbd has gone")


def of_process(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as file:
        status = dict(line.split(":", 1) for line in file if ":" in line)
    size = {key: int(status[key].split()[0]) / 1024 for key in ("VmRSS", "VmLck")}
    return size["VmRSS"], size["VmLck"], len(os.listdir(f"/proc/{pid}/fd")), int(status["Threads"])


def connected(path, emtbd):
    for _ in range(600):
        try:
            return Daemon(path)
        except OSError:
            if emtbd.poll() is not None:
                break
            time.sleep(0.1)
    sys.exit("long_run: emtbd does not answer")


def armed(daemon):
    for _ in range(20):  # a machine that stalls may need a second attempt
        try:
            return daemon.call("reset")
        except RuntimeError:
            time.sleep(1)
    return sys.exit("long_run: the bench is not armed")


def live(options, folder, out):
    bench = (ROOT / "config/benches/fh2-simulated.yaml").read_text(encoding="utf-8")
    bench = bench.replace("../models", str(ROOT / "config/models")).replace("rate: 1000 ", f"rate: {options.rate} ")
    pathlib.Path(f"{folder}/bench.yaml").write_text(bench, encoding="utf-8")
    words = [f"{options.bin}/emtbd", "--config", f"{folder}/bench.yaml", "--socket", f"{folder}/s", "--data", f"{folder}/data"]
    with open(f"{folder}/log", "w", encoding="utf-8") as log, \
            subprocess.Popen(words + ["--pace", options.pace], stderr=log, stdout=log) as emtbd:
        try:
            daemon = connected(f"{folder}/s", emtbd)
            daemon.call("subscribe", rate=5)
            begun, hours, ends = time.monotonic(), 0.0, {}
            while hours < options.hours and time.monotonic() - begun < options.at_most * 3600:
                if daemon.call("status")["state"] != "armed":
                    armed(daemon)
                daemon.call("run", profile=PROFILE)
                end = daemon.end_of_run()
                time.sleep(PAUSE if options.pace == "1" else 0.2)
                hours += (RUN + PAUSE) / 3600
                status = daemon.call("status")
                late = status["loop"]["late_us"] if options.pace == "1" else None  # simulated time knows none
                ends[end["outcome"]] = ends.get(end["outcome"], 0) + 1
                out.writerow([f"{hours:.4f}", f"{time.monotonic() - begun:.1f}", *(f"{x:.2f}" if isinstance(x, float) else x
                              for x in of_process(emtbd.pid)), *((f"{late['p50']:.0f}", f"{late['p99']:.0f}") if late else ("", "")),
                              status["loop"]["missed"], end["outcome"] + (": " + end.get("text", "") if end["outcome"] != "done" else "")])
                options.file.flush()
                for old in sorted(pathlib.Path(f"{folder}/data").glob("*.h5"))[:-20]:
                    old.unlink()
            print(f"{hours:.2f} h of bench time in {time.monotonic() - begun:.0f} s; runs: {ends}")
        finally:
            emtbd.send_signal(signal.SIGTERM)
            print("emtbd ended with", emtbd.wait(60))


def panel(rows, key, top, title):
    """One curve over hours, as lines of SVG 640 wide and 90 high."""
    points = [(float(r["hours"]), float(r[key])) for r in rows if r[key] != ""]
    if not points:
        return []
    right, high = points[-1][0], max(v for _, v in points) * 1.1 or 1
    line = " ".join(f"{60 + 560 * t / right:.1f},{top + 80 - 70 * v / high:.1f}" for t, v in points)
    return [f'<text x="60" y="{top + 4}" font-size="11">{title}: {points[0][1]:g} at first, {points[-1][1]:g} at last, '
            f'{max(v for _, v in points):g} at most</text>',
            f'<path d="M60 {top + 10}V{top + 80}H620" fill="none" stroke="#7f7f7f"/>',
            f'<polyline points="{line}" fill="none" stroke="#1f77b4"/>',
            f'<text x="54" y="{top + 80}" font-size="10" text-anchor="end">0</text>',
            f'<text x="54" y="{top + 18}" font-size="10" text-anchor="end">{high / 1.1:g}</text>',
            f'<text x="620" y="{top + 92}" font-size="10" text-anchor="end">{right:.2g} h</text>']


def plot(files, svg):
    lines, top = [], 20
    for name in files:
        with open(name, encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for key, title in (("resident_MB", "resident memory [MB]"), ("descriptors", "descriptors"), ("late_p99_us", "lateness, 99 % [us]")):
            drawn = panel(rows, key, top, f"{pathlib.Path(name).stem}, {title}")
            lines += drawn
            top += 105 if drawn else 0
    body = "\n".join(lines)
    pathlib.Path(svg).write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 {top}" font-family="sans-serif">\n'
                                 f'<rect width="640" height="{top}" fill="white"/>\n{body}\n</svg>\n', encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=1)
    parser.add_argument("--pace", default="1")
    parser.add_argument("--rate", type=int, default=1000, help="[Hz] of the loop")
    parser.add_argument("--at-most", type=float, default=1e9, help="[h] of the wall")
    parser.add_argument("--csv", default="long_run.csv")
    parser.add_argument("--bin", default=str(ROOT / "build/release/bin"))
    parser.add_argument("--plot", nargs="+")
    parser.add_argument("--svg", default="long_run.svg")
    options = parser.parse_args()
    if options.plot:
        return plot(options.plot, options.svg)
    with tempfile.TemporaryDirectory(prefix="emtb_long_") as folder, open(options.csv, "w", encoding="utf-8", newline="") as options.file:
        out = csv.writer(options.file)
        out.writerow(COLUMNS)
        live(options, folder, out)
    return None


if __name__ == "__main__":
    main()
