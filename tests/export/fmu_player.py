#!/usr/bin/env python3
"""A small importer of FMUs 2.0 for co-simulation: fmu_player.py FILE.fmu INPUTS

Reads modelDescription.xml, loads the library, plays lines of `t u` as its first input (each held until the next) and
prints `omega i_a e_a` at each. Every answer of the FMU must be fmi2OK. Uses nothing of emtb.
"""
import ctypes as c
import pathlib
import sys
import tempfile
import xml.etree.ElementTree as xml
import zipfile

OK, CO_SIMULATION = 0, 1


class Callbacks(c.Structure):
    LOGGER = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p, c.c_char_p)
    _fields_ = [("logger", LOGGER), ("allocate", c.c_void_p), ("free", c.c_void_p), ("finished", c.c_void_p),
                ("environment", c.c_void_p)]


class Fmu:
    def __init__(self, path, folder):
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None, "the archive is damaged"
            archive.extractall(folder)
        about = xml.parse(folder / "modelDescription.xml").getroot()
        assert about.get("fmiVersion") == "2.0"
        self.variables = {v.get("name"): v for v in about.iter("ScalarVariable")}
        outputs = {n for n, v in self.variables.items() if v.get("causality") == "output"}
        names = list(self.variables)
        assert {names[int(u.get("index")) - 1] for u in about.find("ModelStructure/Outputs")} == outputs
        units = {u.get("name") for u in about.find("UnitDefinitions")}
        assert all(v.find("Real").get("unit") in units for v in self.variables.values())
        identifier = about.find("CoSimulation").get("modelIdentifier")
        self.library = c.CDLL(str(folder / f"binaries/linux64/{identifier}.so"))
        self.library.fmi2Instantiate.restype = c.c_void_p
        self.library.fmi2GetVersion.restype = c.c_char_p
        self.said = []
        self.callbacks = Callbacks(Callbacks.LOGGER(lambda *_: self.said.append(_[-1])), None, None, None, None)
        assert self.library.fmi2GetVersion() == b"2.0"
        assert not self.instance(b"{of another}"), "a wrong guid must be refused"
        assert self.said, "and said"
        self.me = c.c_void_p(self.instance(about.get("guid").encode()))
        assert self.me

    def instance(self, guid):
        return self.library.fmi2Instantiate(b"motor", CO_SIMULATION, guid, b"", c.byref(self.callbacks), 0, 0)

    def call(self, name, *arguments, answer=OK):
        got = getattr(self.library, name)(self.me, *arguments)
        assert got == answer, f"{name} answered {got}: {self.said}"

    def reference(self, name):
        return (c.c_uint * 1)(int(self.variables[name].get("valueReference")))

    def set(self, name, value, **expected):
        self.call("fmi2SetReal", self.reference(name), c.c_size_t(1), (c.c_double * 1)(value), **expected)

    def get(self, name):
        value = (c.c_double * 1)()
        self.call("fmi2GetReal", self.reference(name), c.c_size_t(1), value)
        return value[0]

    def begin(self, source, value):
        self.call("fmi2SetupExperiment", 0, c.c_double(0), c.c_double(0), 0, c.c_double(0))
        self.call("fmi2EnterInitializationMode")
        self.set(source, value)
        self.call("fmi2ExitInitializationMode")

    def step(self, at, size, **expected):
        self.call("fmi2DoStep", c.c_double(at), c.c_double(size), 1, **expected)


def play(fmu, lines):
    source = next(n for n, v in fmu.variables.items() if v.get("causality") == "input")
    fmu.begin(source, lines[0][1])
    for k, (t, u) in enumerate(lines):
        yield fmu.get("omega"), fmu.get("i_a"), fmu.get("e_a")
        fmu.set(source, u)
        if k + 1 < len(lines):
            fmu.step(t, lines[k + 1][0] - t)


def main():
    lines = [tuple(map(float, line.split())) for line in open(sys.argv[2])]
    with tempfile.TemporaryDirectory() as folder:
        fmu = Fmu(sys.argv[1], pathlib.Path(folder))
        for reading in play(fmu, lines):
            print(*map(repr, reading))
        # A state that was kept comes back, a reset starts anew, and parameters are those of the description.
        here, kept = fmu.get("omega"), c.c_void_p()
        fmu.call("fmi2GetFMUstate", c.byref(kept))
        fmu.set("load", 10.0)
        fmu.step(lines[-1][0], 0.0137)
        assert fmu.get("omega") != here
        fmu.call("fmi2SetFMUstate", kept)
        assert fmu.get("omega") == here
        fmu.call("fmi2FreeFMUstate", c.byref(kept))
        fmu.set("J", 1.0)
        fmu.call("fmi2Reset")
        assert fmu.get("J") == float(fmu.variables["J"].find("Real").get("start"))
        fmu.set("omega", 1.0, answer=3)
        fmu.step(0, 0.01, answer=3)
        fmu.library.fmi2FreeInstance(fmu.me)


if __name__ == "__main__":
    main()
