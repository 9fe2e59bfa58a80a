#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "config/model.h"
#include "export/equations.h"
#include "model/catalogue.h"
#include "session/spec.h"
#include "tests/export/models.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

/// What `emtb export-model` writes, run by the compiler or the program that it is written for, beside what `emtb
/// simulate` says of the same model and profile.
class ExportCommand : public CommandCaller {
 protected:
  struct Motion {
    std::vector<double> t, u, omega, i_a, e_a;
  };

  Motion simulated(const std::string& model, const std::string& profile, const std::string& rate) {
    EXPECT_EQ(call({"simulate", model, profile, "--out", path("simulated.csv"), "--rate", rate}), 0) << last->err();
    const Run run = read_runs(path("simulated.csv").string()).front();
    const auto of = [&](Signal s) { return run.at(s).value; };
    return {run.at(Signal::u_ref).t, of(Signal::u_ref), of(Signal::omega), of(Signal::i_a), of(Signal::e_a)};
  }

  /// Other programs: `cc`, `octave`.
  void run_program(std::vector<std::string> words) {
    words.insert(words.begin(), "/usr/bin/env");  // which looks along the path
    Process program(words, path("program" + std::to_string(++programs_)));
    ASSERT_EQ(program.wait(120), 0) << words[1] << ": " << program.err();
    program_said_ = program.out();
  }

  /// Lines of `omega i_a e_a`.
  Motion said() const {
    Motion m;
    std::istringstream in(program_said_);
    for (double omega = 0, i = 0, e = 0; in >> omega >> i >> e;) {
      m.omega.push_back(omega);
      m.i_a.push_back(i);
      m.e_a.push_back(e);
    }
    return m;
  }

  /// References as lines `t u` for a program to read.
  std::string inputs(const Motion& m) {
    std::ofstream file(path("inputs.txt"));
    file.precision(17);
    for (std::size_t k = 0; k < m.t.size(); ++k) file << m.t[k] << " " << m.u[k] << "\n";
    return path("inputs.txt");
  }

  /// The header in a program that plays the references.
  Motion by_the_compiler(const Motion& m) {
    write("main.c", R"(#include <stdio.h>
#include "motor.h"
int main(int argc, char **argv) {
  FILE *in = fopen(argv[argc - 1], "r");
  emtb_state s = {0};
  double t, u, before = 0, last = 0;
  int first = 1;
  while (fscanf(in, "%lf %lf", &t, &u) == 2) {
    if (first) emtb_start(&s, &emtb_model, u);
    else emtb_step(&s, &emtb_model, last, 0.0, t - before);
    printf("%.12g %.12g %.12g\n", s.omega, s.i_a, s.e_a);
    first = 0, before = t, last = u;
  }
  fclose(in);
  return 0;
}
)");
    run_program({"cc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-o", path("program"),
                 path("main.c"), "-lm"});
    run_program({path("program"), inputs(m)});
    return said();
  }

  /// An FMU in a program that knows the standard alone.
  Motion by_an_importer(const std::string& model, const Motion& m) {
    EXPECT_EQ(call({"export-model", model, "--to", "fmu", "--out", path("motor.fmu")}), 0) << last->err();
    run_program({"python3", EMTB_SOURCE_DIR "/tests/export/fmu_player.py", path("motor.fmu"), inputs(m)});
    return said();
  }

  static void agree(const Motion& a, const Motion& b, double share, const std::string& what) {
    ASSERT_EQ(a.omega.size(), b.omega.size()) << what;
    const auto apart = [&](const std::vector<double>& x, const std::vector<double>& y) {
      double most = 0, largest = 0;
      for (std::size_t k = 0; k < x.size(); ++k) {
        most = std::max(most, std::abs(x[k] - y[k]));
        largest = std::max(largest, std::abs(x[k]));
      }
      return most / largest;
    };
    EXPECT_LT(apart(a.omega, b.omega), share) << what << ": omega";
    EXPECT_LT(apart(a.i_a, b.i_a), share) << what << ": i_a";
    EXPECT_LT(apart(a.e_a, b.e_a), share) << what << ": e_a";
  }

  std::string saved(const Model& model) {
    write_model(path("model.yaml"), model);
    return path("model.yaml");
  }

 private:
  std::string program_said_;
  int programs_ = 0;
};

// The header solves the same equations in the same steps: what is left is the numbers' own digits, and of a torque that
// repeats with the angle its mean over a step.
constexpr double like_the_model = 1e-4;

TEST_F(ExportCommand, EachEffectInCMovesAsSimulateSays) {
  for (const WrittenEffect& e : written_effects()) {
    const std::string model = saved(with(linear_model(), std::string(e.id)));
    const Motion m = simulated(model, "fh2_step_mid", "1000");
    ASSERT_EQ(call({"export-model", model, "--to", "c", "--out", path("motor.h")}), 0) << last->err();
    agree(m, by_the_compiler(m), like_the_model, std::string(e.id));
  }
}

TEST_F(ExportCommand, ADriverThatTakesNoneBackMovesBothWaysAsSimulateSays) {
  const Model desk = read_model(EMTB_SOURCE_DIR "/config/models/desk.yaml");
  const Model none_back = with(desk, "one_quadrant_driver");
  for (const Model& machine : {none_back, with(none_back, "armature_inductance"), with(desk, "coasting_driver")}) {
    const std::string model = saved(machine);
    const Motion m = simulated(model, "desk_random", "1000");
    ASSERT_EQ(call({"export-model", model, "--to", "c", "--out", path("motor.h")}), 0) << last->err();
    agree(m, by_the_compiler(m), like_the_model, std::to_string(machine.effects.size()) + " effects");
  }
}

TEST_F(ExportCommand, AModelWithManyEffectsMovesAsSimulateSaysInCAndInOctave) {
  Model all = linear_model();
  for (const char* id : {"driver_dead_zone", "driver_lag", "armature_inductance", "brush_drop", "armature_reaction",
                         "stribeck_friction", "windage", "eddy_brake", "tacho_offset"}) {
    all = with(all, id);
  }
  const std::string model = saved(all);
  all.exclude(effect_index("tacho_offset"));  // an instrument's: the texts leave it out
  write_model(path("machine.yaml"), all);
  const Motion m = simulated(path("machine.yaml"), "fh2_staircase", "1000");
  ASSERT_EQ(call({"export-model", model, "--to", "c", "--out", path("motor.h")}), 0) << last->err();
  agree(m, by_the_compiler(m), like_the_model, "C");

  const Motion coarse = simulated(path("machine.yaml"), "fh2_step_low", "1000");
  ASSERT_EQ(call({"export-model", model, "--to", "octave", "--out", path("motor.m")}), 0) << last->err();
  run_program({"octave", "--no-gui", "--norc", "--quiet", "--eval",
               "cd('" + path("").string() + "'); x = load('" + inputs(coarse) +
                   "'); y = motor(x(:,1), x(:,2)); printf('%.12g %.12g %.12g\\n', [y.omega y.i_a y.e_a]');"});
  agree(coarse, said(), like_the_model, "Octave");
}

TEST_F(ExportCommand, AnFmuPlayedByAnImporterMovesAsSimulateSays) {
  const std::string file =
      saved(with(with(with(linear_model(), "coulomb_friction"), "armature_inductance"), "windage"));
  const Motion m = simulated(file, "fh2_step_mid", "1000");
  agree(m, by_an_importer(file, m), like_the_model, "FMU");
}

TEST_F(ExportCommand, AnFmuThatAVoltageOrACurrentDrivesMovesAsTheHeaderDoes) {
  for (const auto& [input, unit] : {std::pair{"e_a", 40.0}, std::pair{"i_a", 1.0}}) {  // [V], [A]
    Model model = with(linear_model(), "coulomb_friction");
    model.input = *signal_named(input);
    const std::string file = saved(model);
    Motion m;  // steps of 3.7 ms, longer than those of the model
    for (int k = 0; k < 400; ++k) {
      m.t.push_back(0.0037 * k);
      m.u.push_back(unit * (k < 20 ? 0 : k < 200 ? 1.5 : 0.4));
    }
    ASSERT_EQ(call({"export-model", file, "--to", "c", "--out", path("motor.h")}), 0) << last->err();
    agree(by_the_compiler(m), by_an_importer(file, m), 2e-3, std::string("FMU driven by ") + input);
  }
}

TEST_F(ExportCommand, AnFmuIsTheSameTwice) {
  for (const char* name : {"a/motor.fmu", "b/motor.fmu"}) {
    std::filesystem::create_directories(path(name).parent_path());
    ASSERT_EQ(call({"export-model", saved(linear_model()), "--to", "fmu", "--out", path(name)}), 0) << last->err();
  }
  EXPECT_TRUE(read(path("a/motor.fmu")) == read(path("b/motor.fmu")));
}

TEST_F(ExportCommand, AStateSpaceMovesAsSimulateSaysWithinTheDriversLimits) {
  Model model = with(with(linear_model(), "armature_inductance"), "driver_lag");
  model.driver = DriverModel{.gain = 18};
  const Motion m = simulated(saved(model), "fh2_step_mid", "1000");
  ASSERT_EQ(call({"export-model", path("model.yaml"), "--to", "state-space"}), 0) << last->err();
  const json s = json::parse(last->out());
  const std::size_t n = s["states"].size();
  std::vector<double> x(n, 0);
  Motion moved;
  const auto derivative = [&](const std::vector<double>& at, double u) {
    std::vector<double> d(n);
    for (std::size_t r = 0; r < n; ++r) {
      d[r] = s["B"][r][0].get<double>() * u;
      for (std::size_t c = 0; c < n; ++c) d[r] += s["A"][r][c].get<double>() * at[c];
    }
    return d;
  };
  for (std::size_t k = 0; k < m.t.size(); ++k) {
    moved.omega.push_back(x[n - 1]);
    moved.i_a.push_back(x[1]);
    moved.e_a.push_back(x[0]);
    if (k + 1 == m.t.size()) break;
    const double h = m.t[k + 1] - m.t[k], u = m.u[k];  // Heun's step; a millisecond is short beside all of it
    const std::vector<double> first = derivative(x, u);
    std::vector<double> ahead = x;
    for (std::size_t r = 0; r < n; ++r) ahead[r] += h * first[r];
    const std::vector<double> second = derivative(ahead, u);
    for (std::size_t r = 0; r < n; ++r) x[r] += 0.5 * h * (first[r] + second[r]);
  }
  agree(m, moved, 1e-3, "state space");
}

TEST_F(ExportCommand, ALinearTextSettlesWhereTheWholeModelDoes) {
  const std::string model = saved(with(with(linear_model(), "coulomb_friction"), "brush_drop"));
  const Motion m = simulated(model, "fh2_step_mid", "1000");
  const auto settled = static_cast<std::size_t>(11.5 * 1000);  // at 4 V
  ASSERT_EQ(call({"export-model", model, "--to", "c", "--linear", "--at", std::to_string(m.omega[settled]), "--out",
                  path("motor.h")}),
            0)
      << last->err();
  const Motion c = by_the_compiler(m);
  EXPECT_NEAR(c.omega[settled], m.omega[settled], 1e-3 * m.omega[settled]);
  EXPECT_NEAR(c.i_a[settled], m.i_a[settled], 1e-3 * m.i_a[settled]);
}

TEST_F(ExportCommand, RefusesWithOneLine) {
  const auto complaint = [&](const std::vector<std::string>& words) {
    EXPECT_EQ(call(words), 2);
    EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
    return last->err();
  };
  const std::string rubs = saved(with(linear_model(), "coulomb_friction"));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "state-space"}),
              AllOf(HasSubstr("coulomb_friction"), HasSubstr("--at")));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "c", "--linear"}), HasSubstr("--at RAD_S"));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "fortran"}), HasSubstr("Known: c, octave"));
  EXPECT_THAT(complaint({"export-model", rubs}), HasSubstr("--to is missing"));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "octave", "--out", path("my-motor.m")}),
              HasSubstr("letters, digits"));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "fmu"}), HasSubstr("--out FILE.fmu is missing"));
  EXPECT_THAT(complaint({"export-model", rubs, "--to", "fmu", "--out", path("my-motor.fmu")}),
              HasSubstr("letters, digits"));
  write_model(path("springs.yaml"), with(linear_model(), "shaft_compliance"));
  EXPECT_THAT(complaint({"export-model", path("springs.yaml"), "--to", "c"}), HasSubstr("shaft_compliance"));
  EXPECT_THAT(complaint({"gains", rubs, "--bandwidth", "-3"}), HasSubstr("more than 0 Hz"));
}

TEST_F(ExportCommand, GainsAreDesignedAndTriedForEachBandwidth) {
  Model model = with(linear_model(), "coulomb_friction");
  model.at(base::J).std_error = 2e-5;
  ASSERT_EQ(call({"gains", saved(model), "--bandwidth", "1", "4", "--json", path("g.json")}), 0) << last->err();
  EXPECT_THAT(last->out(),
              AllOf(HasSubstr("speed loop 1 Hz"), HasSubstr("speed loop 4 Hz"), HasSubstr("feed-forward")));
  const json g = json::parse(read(path("g.json")));
  ASSERT_EQ(g["designs"].size(), 2U);
  for (const json& d : g["designs"]) {
    for (const char* loop : {"cascade", "direct"}) {
      EXPECT_GT(d[loop]["phase_margin_deg"].get<double>(), 45) << loop;
      EXPECT_LE(d[loop]["least_phase_margin_deg"].get<double>(), d[loop]["phase_margin_deg"].get<double>()) << loop;
      EXPECT_LT(std::abs(d[loop]["step"]["left_rad_s"].get<double>()), 0.5) << loop;
    }
  }
  EXPECT_GT(g["designs"][1]["gains"]["speed"]["kp"].get<double>(),
            g["designs"][0]["gains"]["speed"]["kp"].get<double>());
}

}  // namespace
}  // namespace emtb
