#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>

#include "config/bench.h"
#include "drivers/registry.h"
#include "tests/session/scratch.h"

namespace emtb::program {

/// Whom a program under test becomes: root must name somebody.
inline std::string its_user() { return geteuid() == 0 ? ", user: nobody" : ""; }

/// A folder with programs in Python that whoever they become can read and write.
class PythonFolder : public Scratch {
 protected:
  PythonFolder() { chmod(path("").c_str(), 0777); }

  /// A program that begins with a few helpers. @return its path
  std::string python(const std::string& body) const {
    return write("device.py",
                 "import os, select, sys, time\n"
                 "def say(line): print(line, flush=True)\n"
                 "def hello(): say('emtb 1 test')\n"
                 "def now(): return time.monotonic()\n" +
                     body)
        .string();
  }
  /// An output with a watchdog, that writes what it is at into the file `output`. @param told what it does with `volts`
  std::string mover(const std::string& told = "put(volts)") const {
    return python(
        "def put(volts):\n  global out\n  out = volts\n  open('new', 'w').write(str(volts))\n"
        "  os.rename('new', 'output')\n"
        "put(0.0)\nhello()\nbegun = b''\nwhile True:\n"
        "  if not select.select([0], [], [], 0.2)[0]:\n    put(0.0)\n    continue\n"
        "  got = os.read(0, 4096)\n  if not got: put(0.0); break\n"
        "  *lines, begun = (begun + got).split(b'\\n')\n"
        "  for line in lines:\n    if line.startswith(b'set '):\n      volts = float(line[4:])\n      " +
        told + "\n      say(f'out={out}')\n");
  }
  double at_the_pins() const { return std::stod(read(path("output"))); }
  /// One of config/devices, where whoever it becomes can read it.
  std::string shipped(const std::string& name) const {
    return write(name, read(EMTB_SOURCE_DIR "/config/devices/" + name)).string();
  }
  /// config/benches/desk-program.yaml with its program here. The periods are said longer than they are: a busy machine
  /// may keep an interpreter waiting.
  std::string desk() const {
    std::string text = read(EMTB_SOURCE_DIR "/config/benches/desk-program.yaml");
    const auto change = [&](const std::string& from, const std::string& to) {
      for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
        text.replace(at, from.size(), to);
      }
    };
    change("../devices/toy_motor.py", shipped("toy_motor.py"));
    change("period: 0.01", "period: 0.2");
    if (geteuid() == 0) change("# user: nobody", "user: nobody");
    return text;
  }
  /// A bench whose device `cell`, on its line 5, is such a program and nothing else. @param more its other keys
  std::filesystem::path bench_of(const std::string& program, const std::string& more,
                                 const std::string& rest = "") const {
    return write("bench.yaml",
                 "name: b\nrate: 200\nreference: {device: cell, min: 0, max: 6, safe: 0}\ndevices:\n  cell: "
                 "{driver: program, command: [python3, " +
                     program + "]" + its_user() + more + "}\n" + rest);
  }
};

}  // namespace emtb::program
