#!/usr/bin/python3
"""Measures emtb beside its peers and writes the ratios as JSON: see docs/performance.md.

What cannot be measured is null, and `reasons` says why. Peers run in the same run, in turn with emtb; of repeats the least
counts. Prints what it does to the standard error.
"""
import argparse
import ctypes
import json
import os
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BIN = os.path.join(ROOT, "build", "release", "bin")
WORK = os.path.join(ROOT, "build", "benchmark")
MODEL = os.path.join(ROOT, "config", "models", "desk.yaml")
BENCH = os.path.join(ROOT, "config", "benches", "desk-simulated.yaml")
RUNS = ["random", "staircase", "step_low", "step_high", "ramp", "slow_random"]
SIGMA = {"omega_rad_s": 0.3, "i_a_A": 0.0025}  # of the bench file


class NotMeasured(Exception):
    pass


def say(*words):
    print(*words, file=sys.stderr, flush=True)


def emtb(*arguments, limit=None, environment=None):
    """Runs emtb, which keeps no answer unless the environment says where. @return seconds"""
    environment = environment or {"XDG_CACHE_HOME": "/dev/null"}
    before = time.perf_counter()
    process = subprocess.Popen([os.path.join(BIN, "emtb"), *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True, env={**os.environ, **environment})
    try:
        _, complaint = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise NotMeasured(f"emtb {arguments[0]}: not done after {limit} s") from None
    seconds = time.perf_counter() - before
    if process.returncode not in (0, 1):
        raise NotMeasured(f"emtb {arguments[0]}: {complaint.strip().splitlines()[-1] if complaint else process.returncode}")
    return seconds


def sessions(hide="nothing"):
    folder = os.path.join(WORK, hide)
    paths = [os.path.join(folder, run + ".csv") for run in RUNS]
    if not all(os.path.exists(p) for p in paths):
        say(f"recording {folder}")
        subprocess.run([os.path.join(BIN, "benchmark_runs"), BENCH, folder, "--hide", hide], check=True)
    return paths


def least(works, repeats):
    """The least seconds of each, in turn."""
    best = [float("inf")] * len(works)
    for _ in range(repeats):
        for i, work in enumerate(works):
            best[i] = min(best[i], work())
    return best


def timed(work):
    def run():
        before = time.perf_counter()
        work()
        return time.perf_counter() - before
    return run


def fit_time(model, paths, repeats):
    done = subprocess.run([os.path.join(BIN, "fit_time"), model, str(repeats), *paths], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def read_with_pandas(paths):
    import pandas
    return [pandas.read_csv(path, engine="c") for path in paths]


# ---- the peers' fits


def fit_by_lfilter(frames):
    """R_a, K, B, J by scipy's least_squares (trf) over the exact recursion of the linear motor."""
    import numpy as np
    from scipy.optimize import least_squares
    from scipy.signal import lfilter, lfiltic
    data = [(f["e_a_V"].to_numpy(), f["i_a_A"].to_numpy(), f["omega_rad_s"].to_numpy()) for f in frames]
    h = float(frames[0]["t_s"].iloc[1] - frames[0]["t_s"].iloc[0])

    def residuals(p):
        R, K, B, J = p
        rate, gain = (K * K / R + B) / J, K / R / J
        a = np.exp(-rate * h)
        mean = (1 - a) / (rate * h)
        b1, b0 = gain / rate * (1 - mean), gain / rate * (mean - a)
        out = []
        for e, i, omega in data:
            drive = b0 * e[:-1] + b1 * e[1:]
            speed = np.concatenate(([0.0], lfilter([1.0], [1.0, -a], drive)))
            out.append((speed - omega) / SIGMA["omega_rad_s"])
            out.append(((e - K * speed) / R - i) / SIGMA["i_a_A"])
        return np.concatenate(out)

    return least_squares(residuals, [1.0, 0.04, 2e-5, 5e-5], bounds=([0.2, 0.005, 0, 5e-6], [6, 0.3, 1e-3, 1e-3]),
                         method="trf", x_scale=[1, 0.04, 1e-5, 5e-5])


def compiled_loop():
    library = os.path.join(WORK, "compiled_loop.so")
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", os.path.join(HERE, "compiled_loop.c"), "-o", library, "-lm"],
                   check=True)
    simulate = ctypes.CDLL(library).simulate
    pointer = ctypes.POINTER(ctypes.c_double)
    simulate.argtypes = [pointer, ctypes.c_long, ctypes.c_double, ctypes.c_double, pointer, pointer]
    return simulate


def fit_by_compiled_loop(frames, simulate):
    import numpy as np
    from scipy.optimize import least_squares
    pointer = ctypes.POINTER(ctypes.c_double)
    data = [(np.ascontiguousarray(f["e_a_V"]), f["i_a_A"].to_numpy(), f["omega_rad_s"].to_numpy()) for f in frames]
    h = float(frames[0]["t_s"].iloc[1] - frames[0]["t_s"].iloc[0])

    def residuals(p):
        p = np.ascontiguousarray(p, dtype=float)
        out = []
        for e, i, omega in data:
            y = np.empty((2, len(e)))
            simulate(e.ctypes.data_as(pointer), len(e), h, 0.0, p.ctypes.data_as(pointer), y.ctypes.data_as(pointer))
            out.append((y[0] - omega) / SIGMA["omega_rad_s"])
            out.append((y[1] - i) / SIGMA["i_a_A"])
        return np.concatenate(out)

    return least_squares(residuals, [1.0, 0.04, 2e-5, 5e-5, 1e-3],
                         bounds=([0.2, 0.005, 0, 5e-6, 0], [6, 0.3, 1e-3, 1e-3, 0.1]), method="trf",
                         x_scale=[1, 0.04, 1e-5, 5e-5, 1e-3])


WHOLE_SCIPY = """
import sys
sys.path.insert(0, {here!r})
import peers
fit = peers.fit_by_lfilter(peers.read_with_pandas(sys.argv[1:]))
print(fit.x)
"""

# ---- the entries


def innermost(options, cache={}):
    if not cache:
        program = os.path.join(WORK, "peers")
        os.makedirs(WORK, exist_ok=True)
        libraries = ["sundials_cvodes", "sundials_nvecserial", "sundials_sunlinsoldense", "sundials_sunmatrixdense"]
        build = subprocess.run(["g++", "-O2", "-std=c++20", "-Wno-psabi", "-I.", "tests/benchmark/peers.cpp",
                                "build/release/model/libemtb_model.a", "build/release/hal/libemtb_hal.a",
                                *["-l" + name for name in libraries], "-o", program], cwd=ROOT, capture_output=True, text=True)
        if build.returncode != 0:
            raise NotMeasured("peers.cpp: " + build.stderr.strip().splitlines()[0])
        cache.update(json.loads(subprocess.run([program], check=True, capture_output=True, text=True).stdout))
    return cache


def simulate_vs_boost_odeint(options):
    s = innermost(options)["simulate"]
    return s["odeint"] / s["emtb"], s


def simulate_vs_recursion(options):
    s = innermost(options)["simulate"]
    return s["emtb"] / s["recursion"], s


def sensitivities_vs_cvodes(options):
    s = innermost(options)["sensitivities"]
    return s["cvodes"] / s["emtb"], s


def calibrate_vs_scipy_trf(options):
    paths = sessions()
    frames = read_with_pandas(paths)
    repeats = 2 if options.quick else 5
    ours, theirs = float("inf"), float("inf")
    for _ in range(repeats):
        ours = min(ours, fit_time(MODEL, paths, 3)["fit"])
        theirs = min(theirs, timed(lambda: fit_by_lfilter(frames))())
    script = WHOLE_SCIPY.format(here=HERE)
    whole = least([lambda: emtb("calibrate", MODEL, *paths),
                   timed(lambda: subprocess.run(["/usr/bin/python3", "-c", script, *paths], check=True, capture_output=True))],
                  repeats)
    cache = {"XDG_CACHE_HOME": os.path.join(WORK, "cache")}
    shutil.rmtree(cache["XDG_CACHE_HOME"], ignore_errors=True)
    again = lambda: emtb("calibrate", MODEL, *paths, environment=cache)
    again()
    second = least([again], repeats)[0]
    return ({"fit_only": theirs / ours, "whole_process": whole[1] / whole[0], "second_call": whole[1] / second},
            {"emtb_fit": ours, "scipy_fit": theirs, "emtb_process": whole[0], "scipy_process": whole[1],
             "emtb_second_call": second,
             "emtb_values": fit_time(MODEL, paths, 1)["values"], "scipy_values": list(fit_by_lfilter(frames).x)})


def calibrate_vs_compiled_loop(options):
    paths = sessions("friction")
    model = os.path.join(WORK, "with_friction.yaml")
    with open(MODEL, encoding="utf-8") as given, open(model, "w", encoding="utf-8") as out:
        out.write(given.read().replace(
            "effects: {}", "effects: {coulomb_friction: {T_c: {value: 0.001, min: 0, max: 0.1, unit: N m}}}"))
    frames = read_with_pandas(paths)
    simulate = compiled_loop()
    ours, theirs = float("inf"), float("inf")
    for _ in range(1 if options.quick else 3):
        ours = min(ours, fit_time(model, paths, 3)["fit"])
        theirs = min(theirs, timed(lambda: fit_by_compiled_loop(frames, simulate))())
    return theirs / ours, {"emtb_fit": ours, "scipy_fit": theirs}


def diagnose_seconds(options):
    out, reasons = {}, {}
    for key, hide in (("one_effect", "friction"), ("two_effects", "two"), ("periodic", "periodic")):
        paths = sessions(hide)
        try:
            out[key] = emtb("diagnose", MODEL, *paths[:4], "--held-out", *paths[4:], limit=120 if options.quick else 900)
        except NotMeasured as why:
            out[key], reasons[key] = None, str(why)
        say(f"diagnose {key}: {out[key]}")
    return out, reasons


def batch_efficiency_2_ranks(options):
    """Two ranks that share a folder beside two processes that know nothing of each other, each with half of the work."""
    motors = 200 if options.quick else 1000
    line = os.path.join(WORK, f"line{motors}")
    if not os.path.exists(os.path.join(line, f"motor_{motors - 1:04d}.csv")):
        say(f"recording {motors} motors")
        subprocess.run([os.path.join(BIN, "benchmark_runs"), BENCH, line, "--motors", str(motors)], check=True)
    names = sorted(os.listdir(line))

    def manifest(name, part):
        path = os.path.join(WORK, name + ".yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(f"model: {MODEL}\nitems:\n")
            file.writelines(f"  - {{serial: {n}, session: {os.path.join(line, n)}}}\n" for n in part)
        return path

    def seconds(calls):
        for _, folder, _ in calls:
            shutil.rmtree(folder, ignore_errors=True)
        begin = time.perf_counter()
        running = [subprocess.Popen([os.path.join(BIN, "emtb"), "batch", m, "--out", folder, "--jobs", "1", *more],
                                    stdout=subprocess.DEVNULL) for m, folder, more in calls]
        for process in running:
            if process.wait() not in (0, 1):
                raise NotMeasured("emtb batch failed")
        return time.perf_counter() - begin

    out = os.path.join(WORK, "batch")
    whole, halves = manifest("whole", names), [manifest("half1", names[::2]), manifest("half2", names[1::2])]
    shared = lambda: seconds([(whole, out, ["--shard", f"{k}/2"]) for k in (1, 2)])
    apart = lambda: seconds([(half, out + str(k), []) for k, half in enumerate(halves)])
    together, independent = least([shared, apart], 2 if options.quick else 3)
    return independent / together, {"two_ranks": together, "two_processes": independent, "sessions": motors}


def hour():
    path = os.path.join(WORK, "hour", "hour.h5")
    if not os.path.exists(path):
        say("recording an hour")
        subprocess.run([os.path.join(BIN, "benchmark_runs"), BENCH, os.path.dirname(path), "--hour", "3600"], check=True)
    return path


def measured_hour(options, cache={}):
    if not cache:
        limit = 60 if options.quick else 1800
        path = hour()
        script = ("import resource, subprocess, sys, time\nb = time.perf_counter()\n"
                  "try:\n    subprocess.run(sys.argv[2:], stdout=subprocess.DEVNULL, timeout=float(sys.argv[1]), check=True)\n    late = 0\n"
                  "except subprocess.TimeoutExpired:\n    late = 1\n"
                  "print(time.perf_counter() - b, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024, late)")
        done = subprocess.run(["/usr/bin/python3", "-c", script, str(limit), os.path.join(BIN, "emtb"), "diagnose", "--no-cache",
                               MODEL, path],
                              check=True, capture_output=True, text=True).stdout.split()
        cache.update(seconds=float(done[0]), peak_mib=float(done[1]), late=done[2] == "1", limit=limit)
    return cache


def diagnose_hour_seconds(options):
    m = measured_hour(options)
    if m["late"]:
        raise NotMeasured(f"not done after {m['limit']} s, at {m['peak_mib']:.0f} MiB")
    return m["seconds"], m


def diagnose_hour_peak_mib(options):
    m = measured_hour(options)
    if m["late"]:
        raise NotMeasured(f"not done after {m['limit']} s, at {m['peak_mib']:.0f} MiB")
    return m["peak_mib"], m


def csv_read_vs_pandas(options):
    paths = sessions()
    ours, theirs = float("inf"), float("inf")
    for _ in range(3 if options.quick else 8):
        done = subprocess.run([os.path.join(BIN, "fit_time"), "--read", *paths], check=True, capture_output=True, text=True)
        ours = min(ours, json.loads(done.stdout)["read"])
        theirs = min(theirs, timed(lambda: read_with_pandas(paths))())
    size = sum(os.path.getsize(p) for p in paths) / 1e6
    return theirs / ours, {"emtb": ours, "pandas": theirs, "megabytes": size}


ENTRIES = [simulate_vs_boost_odeint, simulate_vs_recursion, sensitivities_vs_cvodes, calibrate_vs_scipy_trf,
           calibrate_vs_compiled_loop, diagnose_seconds, batch_efficiency_2_ranks, diagnose_hour_seconds,
           diagnose_hour_peak_mib, csv_read_vs_pandas]


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        return next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "unknown")


def main():
    parser = argparse.ArgumentParser(prog="run.sh")
    parser.add_argument("--json", help="writes the results to this file; else to the standard output")
    parser.add_argument("--only", action="append", choices=[e.__name__ for e in ENTRIES], help="this entry alone; may be repeated")
    parser.add_argument("--quick", action="store_true", help="fewer repeats, and what lasts over two minutes is null")
    parser.add_argument("--list", action="store_true", help="prints the keys")
    options = parser.parse_args()
    if options.list:
        print("\n".join(e.__name__ for e in ENTRIES))
        return
    os.makedirs(WORK, exist_ok=True)
    result, details, reasons = {}, {}, {}
    for entry in ENTRIES:
        key = entry.__name__
        if options.only and key not in options.only:
            continue
        say(f"-- {key}")
        try:
            result[key], details[key] = entry(options)
        except NotMeasured as why:
            result[key], reasons[key] = None, str(why)
        except (ImportError, subprocess.CalledProcessError, OSError) as why:
            result[key], reasons[key] = None, f"{type(why).__name__}: {why}"
        say(f"   {result[key]} {reasons.get(key, '')}")
    out = {**result, "reasons": reasons, "details": details,
           "machine": {"processor": processor(), "cores": os.cpu_count(), "load": os.getloadavg()[0]}}
    text = json.dumps(out, indent=2)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            file.write(text + "\n")
    else:
        print(text)


if __name__ == "__main__":
    main()
