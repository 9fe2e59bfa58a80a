#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "config/bench.h"
#include "config/formula.h"
#include "config/model.h"
#include "config/profile.h"
#include "drivers/registry.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

/// All of it is in this process: no port, no card and no other program is opened for a fuzzer.
bool only_simulated(const BenchConfig& bench) {
  if (!bench.simulation || bench.simulation->has("process")) return false;
  for (const BenchConfig::Device& device : bench.devices) {
    if (!device.driver.starts_with("simulated_")) return false;
  }
  return true;
}

}  // namespace

void bench(std::string_view bytes) {
  read_or_refused([&] {
    const BenchConfig config = parse_bench(std::string(bytes), "b.yaml");
    must(config.rate > 0 && std::isfinite(config.rate), "the loop has a rate");
    must(config.reference.limits.min <= config.reference.limits.safe &&
             config.reference.limits.safe <= config.reference.limits.max,
         "the safe value is allowed");
    if (only_simulated(config)) open_bench(config);
  });
}

void profile(std::string_view bytes) {
  read_or_refused([&] {
    const YamlMap yaml = YamlMap::parse(std::string(bytes), "p.yaml");
    const Experiment experiment = read_experiment(yaml);
    const double length = experiment.profile.duration();
    must(std::isfinite(length) && length >= 0, "a profile ends");
    for (const double share : {0.0, 0.3, 1.0}) {
      must(std::isfinite(experiment.profile.reference(share * length)), "a reference is a voltage");
    }
    if (experiment.profile.knots().size() > 1000) return;
    const Experiment again = read_experiment(YamlMap::parse(self_contained(yaml), "again.yaml"));
    must(again.profile.knots().size() == experiment.profile.knots().size(), "what is sent is the same profile");
  });
}

void model(std::string_view bytes) {
  Model read;
  if (!read_or_refused([&] { read = read_model(YamlMap::parse(std::string(bytes), "m.yaml")); })) return;
  std::string written;
  if (!read_or_refused([&] { written = to_yaml(read); })) return;  // what is not finite is never written
  try {
    read_model(YamlMap::parse(written, "written.yaml"));
  } catch (const Error& e) {
    throw Broken(std::string("a model that was written can be read: ") + e.what());
  }
}

void formula(std::string_view bytes) {
  static const std::vector<std::string> parameters{"a", "b"};
  read_or_refused([&] {
    const auto term = parse_formula(std::string(bytes), parameters);
    const std::array values{0.3, -2.0};
    std::array<double, 2> by_parameter{};
    TermInput by_input;
    for (const double x : {0.0, 1.5, -40.0}) {
      term->evaluate({.omega = x, .i_a = x / 2, .theta = 3 * x, .u_ref = x, .t = x * x}, values, by_input,
                     by_parameter);
    }
  });
}

}  // namespace emtb::fuzz
