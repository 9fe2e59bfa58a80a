"""A DC-motor test bench from Python: the daemon by its socket, recordings and models by the program `emtb`.

    import emtb
    with emtb.Bench() as bench:
        bench.reset()
        low, high, stairs = (bench.run(p) for p in ("fh2_step_low", "fh2_step_high", "fh2_staircase"))
    answer = emtb.diagnose("fh2.yaml", [low, high], held_out=[stairs])
    found = answer["missing"][0]["id"]
    emtb.add(found, "fh2.yaml", [low, high], held_out=[stairs], out="better.yaml")
    emtb.plot(emtb.read(stairs)[0], "stairs.png")

Plain Python. h5py makes reading HDF5 quicker, matplotlib is for plot() alone; neither is needed for the rest.
"""
from .bench import Bench, BenchError
from .files import EmtbError, Run, add, call, check, compare, diagnose, profiles, read, simulate
from .plots import plot

__all__ = ["Bench", "BenchError", "EmtbError", "Run", "add", "call", "check", "compare", "diagnose", "plot", "profiles",
           "read", "simulate"]
__version__ = "0.1.0"
