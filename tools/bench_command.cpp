#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/estimate/first_spin.h"
#include "config/bench.h"
#include "hal/error.h"
#include "server/client.h"
#include "session/spec.h"
#include "tools/bench_inputs.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/offered_words.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double rest = 2;     // [s] before and after each level: five readings of a slow meter
constexpr double first = 0.5;  // of spin.u_ref: the level of the first attempt

struct BenchOptions {
  std::string what;
  CalibrateOptions calibrate;  // its file is check's, too
  std::shared_ptr<const std::string> socket;
  bool reset = false, yes = false;
};

/// One level, held. @return the session's path
std::string turn(Client& daemon, const BenchConfig& bench, double level) {
  const double at_rest = bench.reference.limits.safe;
  json profile = {{"name", "spin"},          {"kind", "step"}, {"level", level}, {"before", rest},
                  {"hold", bench.spin.hold}, {"after", rest},  {"rest", at_rest}};
  const json ended = run_on_bench(daemon, {{"profile", profile.dump(1)}, {"note", "first spin"}});
  if (ended["outcome"] == "done") return ended["session"];
  throw Error("the spin ended early: " + why_it_ended(ended));
}

int spin(Client& daemon, const BenchOptions& options) {
  const json config = daemon.call("config", json::object());
  const BenchConfig bench = parse_bench(config["text"], config["file"].get<std::string>());
  const std::string question = bench.name + ": the motor turns, at " + json(first * bench.spin.u_ref).dump() +
                               " V and at " + json(bench.spin.u_ref).dump() + " V of the reference, for " +
                               json(bench.spin.hold).dump() + " s each. Is it safe?";
  if (!motor_may_move(question, options.yes)) return 1;
  if (options.reset) daemon.call("reset", json::object());
  daemon.call("subscribe", {{"rate", 10}});
  catch_interrupt();
  for (const double share : {first, 1.0}) {
    const double level = share * bench.spin.u_ref;
    std::cout << "u_ref " << json(level).dump() << " V:" << std::endl;
    const Session session = read_session(turn(daemon, bench, level));
    const SpinVerdict verdict = judge_first_spin(session.runs.at(0), {.u_ref = level,
                                                                      .from = rest,
                                                                      .to = rest + bench.spin.hold,
                                                                      .R_a = bench.motor.R_a,
                                                                      .K_b = bench.motor.K_b,
                                                                      .driver_gain = bench.motor.driver_gain,
                                                                      .tolerance = bench.spin.tolerance});
    for (const std::string& line : verdict.measured) std::cout << "  " << line << "\n";
    for (const std::string& line : verdict.unknown) std::cout << "  not checked: " << line << "\n";
    for (const std::string& line : verdict.wrong) std::cout << "  WRONG: " << line << "\n";
    if (!verdict.wrong.empty()) {
      std::cout << "Nothing larger was tried. Switch the driver off before you touch a wire, then spin again.\n";
      return 1;
    }
  }
  std::cout << "Signs and scales agree with the bench file.\n";
  return 0;
}

int bench_command(const BenchOptions& options) {
  const bool on_file = options.what == "check" || options.what == "calibrate";
  if (on_file && options.calibrate.file.empty()) throw Error("emtb bench " + options.what + ": which bench FILE?");
  if (options.what == "check") return check_bench(options.calibrate.file);
  if (options.what == "calibrate") {
    if (options.calibrate.signal.empty()) throw Error("emtb bench calibrate: which SIGNAL? omega, torque ...");
    return calibrate_channel(options.calibrate);
  }
  Client daemon = daemon_at(*options.socket);
  return spin(daemon, options);
}

}  // namespace

void add_bench_command(CommandLine& line, const std::shared_ptr<const std::string>& socket) {
  const auto options = std::make_shared<BenchOptions>();
  options->socket = socket;
  line.command("bench",
               "check: reads each signal once and moves nothing; calibrate: fits a sensor's scale and offset to "
               "references; spin: the guided first turn at a low voltage, which checks signs and scales")
      .argument("WHAT", options->what, "check, calibrate or spin")
      .one_of({"check", "calibrate", "spin"})
      .optional_argument("FILE", options->calibrate.file,
                         "check, calibrate: the bench file; no daemon may have it open")
      .optional_argument("SIGNAL", options->calibrate.signal, "calibrate: omega, torque ...")
      .offers(signal_names)
      .option("--seconds", options->calibrate.seconds, "calibrate: [s] each point is read")
      .option("--arm", options->calibrate.arm, "calibrate torque: [m] the lever of weights, for references in kg")
      .option("--tolerance", options->calibrate.share, "calibrate: share of the span that a point may be off the line")
      .flag("--reset", options->reset, "arms the bench first; see that it is safe")
      .flag("--yes", options->yes, "spin: moves the motor without asking")
      .action([options] { return bench_command(*options); });
}

}  // namespace emtb
