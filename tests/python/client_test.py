#!/usr/bin/env python3
"""The Python client beside a daemon of its own: client_test.py FOLDER_OF_THE_PROGRAMS"""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
import emtb  # noqa: E402

PROGRAMS = pathlib.Path(sys.argv.pop(1))
os.environ["EMTB"] = str(PROGRAMS / "emtb")
MODEL = ROOT / "config/models/fh2.yaml"


class Client(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="emtb-py-")
        cls.path = pathlib.Path(cls.folder.name)
        cls.socket = cls.path / "s"
        cls.daemon = subprocess.Popen([PROGRAMS / "emtbd", "--config", ROOT / "config/benches/fh2-simulated.yaml", "--socket", cls.socket,
                                       "--data", cls.path / "sessions", "--pace", "max"], stderr=subprocess.DEVNULL)
        for _ in range(200):
            if cls.socket.exists():
                break
            time.sleep(0.05)

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        cls.daemon.wait(20)
        cls.folder.cleanup()

    def test_drives_diagnoses_and_adds(self):
        with emtb.Bench(self.socket) as bench:
            bench.reset()
            self.assertEqual(bench.status()["state"], "armed")
            names = ["fh2_step_low", "fh2_step_high", "fh2_random", "fh2_staircase"]
            runs = [bench.run(name, note="by Python") for name in names]
        self.assertTrue(all(pathlib.Path(run).exists() for run in runs))
        answer = emtb.diagnose(MODEL, runs[:3], held_out=runs[3:])
        self.assertIn("verdict", answer)
        self.assertLess(answer["error"]["final"]["held_out"], answer["error"]["base"]["held_out"])
        found = answer["missing"][0]["id"]
        self.assertEqual(found, "coulomb_friction")
        better = self.path / "better.yaml"
        fit = emtb.add(found, MODEL, runs[:3], held_out=runs[3:], out=better)
        self.assertEqual(fit["added"], found)
        self.assertIn(found, better.read_text())
        read = emtb.read(runs[0])[0]
        times, omega = read["omega"]
        self.assertEqual(len(times), len(omega))
        self.assertGreater(max(omega), 40)  # 2 V are 54 rad/s, less the friction
        self.assertFalse([f for f in emtb.check(runs[:1]) if f["stops"]])

    def test_says_what_was_refused(self):
        with emtb.Bench(self.socket) as bench:
            bench.reset()
            with self.assertRaises(emtb.BenchError) as refused:
                bench.run("nowhere")
            self.assertEqual(refused.exception.code, 3)
            self.assertIn("nowhere", str(refused.exception))
            with self.assertRaises(emtb.BenchError):
                bench.run("name: far\nkind: step\nlevel: 60\nbefore: 0.1\nhold: 0.1\nafter: 0.1\n")
        with self.assertRaisesRegex(emtb.BenchError, "no daemon answers"):
            emtb.Bench(self.path / "nobody")
        with self.assertRaisesRegex(emtb.EmtbError, "absent.yaml"):
            emtb.diagnose(self.path / "absent.yaml", ["x.csv"])

    def test_stops_and_watches(self):
        with emtb.Bench(self.socket) as bench:
            self.assertIn("omega", next(bench.live(rate=50)))
            self.assertTrue(bench.stop()["reference_safe"])

    def test_the_example_for_plotjuggler_sends_json(self):
        listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(20)
        example = subprocess.Popen([sys.executable, ROOT / "docs/examples/plotjuggler.py", self.socket,
                                    str(listening.getsockname()[1])])
        try:
            first, second = (json.loads(listening.recv(65536)) for _ in range(2))
        finally:
            example.kill()
            example.wait()
            listening.close()
        self.assertGreater(second["timestamp"], first["timestamp"])
        self.assertIsInstance(second["bench"]["omega"], float)

    def test_moves_nothing_where_the_daemon_is_newer(self):
        with emtb.Bench(self.socket) as bench:
            answer, asked = bench.status() | {"protocol": 2}, []
            bench.ask = lambda method, **_: asked.append(method) or answer
            for moving in (bench.reset, lambda: bench.run("fh2_step_low")):
                with self.assertRaisesRegex(emtb.BenchError, "made by a newer emtb"):
                    moving()
            self.assertEqual(asked, ["status", "status"])

    def test_reads_csv_spans_and_lists_profiles(self):
        out = emtb.simulate(MODEL, "fh2_step_low", self.path / "simulated.csv")
        whole, part = emtb.read(out)[0], emtb.read(f"{out}@2:3")[0]
        self.assertGreater(len(whole["omega"][0]), len(part["omega"][0]))
        self.assertIn("desk_chirp", [p["name"] for p in emtb.profiles()])

    def test_a_picture_needs_matplotlib_and_says_so(self):
        run = emtb.Run("made up", {"omega": ([0, 1], [0, 5])})
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            with self.assertRaisesRegex(emtb.EmtbError, "python3-matplotlib"):
                emtb.plot(run, self.path / "p.png")
            return
        self.assertTrue(pathlib.Path(emtb.plot(run, self.path / "p.png")).stat().st_size > 0)


if __name__ == "__main__":
    unittest.main()
