// Where the time of `emtb calibrate` goes, without the process around it: the least of several repeats of reading,
// preparing and fitting. One line of JSON.
//
//     build/release/bin/fit_time MODEL REPEATS SESSION...
//     build/release/bin/fit_time --read SESSION...             reading alone, once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include "analysis/fit/timing.h"
#include "analysis/record/dataset.h"
#include "config/model.h"
#include "session/spec.h"

namespace emtb {
namespace {

double least_seconds(int repeats, const std::function<void()>& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return least;
}

int read_alone(const std::vector<std::string>& sessions) {
  std::vector<Run> runs;
  std::cout << "{\"read\": " << least_seconds(1, [&] { runs = read_runs(sessions, {}); }) << "}\n";
  return 0;
}

int run(const std::vector<std::string>& words) {
  if (words.at(1) == "--read") return read_alone({words.begin() + 2, words.end()});
  const Model model = read_model(words.at(1));
  const int repeats = std::max(1, std::atoi(words.at(2).c_str()));
  const std::vector<std::string> sessions(words.begin() + 3, words.end());
  std::vector<Run> runs;
  const double read = least_seconds(repeats, [&] { runs = read_runs(sessions, {}); });
  Dataset data;
  const double prepared = least_seconds(repeats, [&] { data = prepare(runs, {}, model); });
  Calibration fitted;
  const double fit = least_seconds(repeats, [&] { fitted = calibrate(std::span<const Record>(data.train), model); });
  std::cout.precision(10);
  std::cout << "{\"read\": " << read << ", \"prepare\": " << prepared << ", \"fit\": " << fit << ", \"values\": {";
  for (std::size_t i = 0; i < fitted.model.base.size(); ++i) {
    const Parameter& p = fitted.model.base[i];
    std::cout << (i > 0 ? ", " : "") << "\"" << p.symbol << "\": " << p.value;
  }
  std::cout << "}}\n";
  return 0;
}

}  // namespace
}  // namespace emtb

int main(int count, char** words) try {
  if (count < 3) {
    std::cerr << "fit_time MODEL REPEATS SESSION...\n";
    return 2;
  }
  return emtb::run({words, words + count});
} catch (const std::exception& e) {
  std::cerr << e.what() << "\n";
  return 2;
}
