"""Recordings and models, by the program `emtb`."""
import csv
import json
import os
import pathlib
import subprocess
import tempfile


class EmtbError(RuntimeError):
    """What `emtb` complained about: one line, what, where, and what would be right."""


class Run(dict):
    """One run: {signal: (times [s], values)}, SI units; a slow meter has fewer readings than the others."""

    def __init__(self, name, signals):
        super().__init__(signals)
        self.name = name


def call(*words, accept=(0, 1)):
    """Runs `emtb WORDS`, or the program that EMTB names. Returns what it printed; 1 is an answer, too: no."""
    program = os.environ.get("EMTB", "emtb")
    try:
        done = subprocess.run([program, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
    except FileNotFoundError:
        raise EmtbError(f"no program `{program}`: install emtb, or set EMTB to where it is") from None
    if done.returncode not in accept:
        raise EmtbError(done.stderr.strip() or f"emtb {words[0]} ended with {done.returncode}")
    return done.stdout


def _on_files(command, model, sessions, held_out=(), map=None, out=None, options=()):  # noqa: A002: as the option is called
    words = [*command, model, *sessions]
    if held_out:
        words += ["--held-out", *held_out]
    if map:
        words += ["--map", map]
    if out:
        words += ["--out", out]
    with tempfile.TemporaryDirectory(prefix="emtb-") as folder:
        answer = pathlib.Path(folder, "answer.json")  # standard output is for people
        said = call(*words, *options, "--json", answer)
        if not answer.exists():
            raise EmtbError(said.strip() or f"emtb {command[0]} gave no answer")
        return json.loads(answer.read_text())


def diagnose(model, sessions, held_out=(), **more):
    """What the model is missing, as `emtb diagnose --json` writes it: `verdict`, `missing`, `error` and so on."""
    return _on_files(["diagnose"], model, sessions, held_out, **more)


def compare(model, sessions, **more):
    return _on_files(["compare"], model, sessions, **more)


def add(effect, model, sessions, held_out=(), **more):
    """Adds an effect to a model and fits it; `out` names the file of the new model."""
    return _on_files(["add", effect], model, sessions, held_out, **more)


def check(sessions):
    """The findings of `emtb check`: an empty list where the recordings are what they say."""
    with tempfile.TemporaryDirectory(prefix="emtb-") as folder:
        answer = pathlib.Path(folder, "findings.json")
        call("check", *sessions, "--json", answer)
        return json.loads(answer.read_text())["findings"]


def profiles():
    return json.loads(call("profiles", "--json", "-"))["profiles"]


def simulate(model, profile, out, rate=1000):
    """Writes what a model says of a profile as a session."""
    call("simulate", model, profile, "--out", out, "--rate", rate, accept=(0,))
    return out


def _units(column):
    """`omega_rad_s`, `i_a_A` -> the signal; None for the time and for what describes an instrument."""
    if column.endswith(("_lsb_V", "_lsb_A")) or "_lsb_" in column or "_window_" in column:
        return None
    known = ("u_ref", "e_a", "i_a", "omega", "theta", "torque", "i_f", "temperature", "armature_open")
    return next((signal for signal in known if column == signal or column.startswith(signal + "_")), None)


def _read_csv(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    signals = {}
    for column in rows[0] if rows else ():
        signal = _units(column)
        if signal:
            readings = [(float(row["t_s"]), float(row[column])) for row in rows if row[column]]
            signals[signal] = tuple(map(list, zip(*readings))) if readings else ([], [])
    return Run(pathlib.Path(path).name, signals)


def _read_hdf5(path):
    import h5py

    with h5py.File(path, "r") as file:
        signals = {name: (group["t"][()].tolist(), group["value"][()].tolist()) for name, group in file["signals"].items()}
    return Run(pathlib.Path(path).name, signals)


def read(session):
    """The runs of a session, PATH[#RUN][@T0:T1]. HDF5 without h5py, spans and runs go through `emtb export`."""
    text = str(session)
    if text.endswith(".h5"):
        try:
            return [_read_hdf5(text)]
        except (ImportError, KeyError):
            pass
    with tempfile.TemporaryDirectory(prefix="emtb-") as folder:
        out = pathlib.Path(folder, "session.csv")
        call("export", text, "--out", out, accept=(0,))
        run = _read_csv(out)
    run.name = pathlib.Path(text).name
    return [run]
