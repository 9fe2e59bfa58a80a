#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <sstream>

#include "analysis/estimate/sensor_fit.h"
#include "config/edit.h"
#include "hal/error.h"
#include "report/text.h"
#include "tools/bench_inputs.h"
#include "tools/rewrite.h"

namespace emtb {
namespace {

constexpr double gravity = 9.80665;             // [m/s2] standard; a place's own differs by 0.3 % at most
constexpr const char* usual_of_meters = "i_a";  // that say nothing else
constexpr double much = 1.25;                   // a scale that changes by more than this is worth a word

/// The device that measures the signal, and the keys that lead to its scale and offset.
struct Place {
  std::string device;
  std::vector<std::string> path;
};

Place place_of(const BenchConfig& bench, Signal signal) {
  const std::string name(info(signal).name);
  for (const BenchConfig::Device& device : bench.devices) {
    bool has_lists = false;
    for (const char* list : {"channels", "registers"}) {
      if (!device.yaml.has(list) || !device.yaml.node()[list].IsMap()) continue;
      has_lists = true;
      if (device.yaml.map(list).has(name)) return {device.name, {"devices", device.name, list, name}};
    }
    if (!has_lists && device.yaml.text_or("signal", usual_of_meters) == name) {
      return {device.name, {"devices", device.name}};
    }
  }
  throw Error(bench.file.string() + ": no device has a channel " + name + ", and no meter measures it");
}

/// scale and offset as the file has them.
std::array<KeyedNumber, 2> as_in_file(const SensorFit& fit, const Conversion& conversion) {
  return {KeyedNumber{"scale", fit.scale / conversion.file_unit},
          KeyedNumber{std::string(conversion.offset_key), (fit.offset - conversion.file_zero) / conversion.file_unit}};
}

/// `157`, `1500 rpm`, `0.5 kg` (with an arm), or the signal's own unit behind the number.
double reference_of(const std::string& line, Signal signal, double arm) {
  std::istringstream words(line);
  std::string number;
  words >> number;
  std::string unit;
  std::getline(words >> std::ws, unit);
  unit.erase(unit.find_last_not_of(" \t\r") + 1);
  if (number.starts_with('+')) number.erase(0, 1);
  double value = 0;
  const char* const end = number.data() + number.size();
  const auto [stop, error] = std::from_chars(number.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    throw Error("`" + line + "` is no number. Write one, in " + std::string(info(signal).unit));
  }
  if (unit.empty() || unit == info(signal).unit) return value;
  if (signal == Signal::omega && unit == "rpm") return value * 2 * std::numbers::pi / 60;
  if (signal == Signal::torque && unit == "kg") {
    if (arm <= 0) throw Error("a weight needs its lever: --arm METRES");
    return value * gravity * arm;
  }
  throw Error("`" + unit + "` is not known here. Write the number in " + std::string(info(signal).unit) +
              (signal == Signal::omega    ? " or rpm"
               : signal == Signal::torque ? ", or in kg with --arm METRES"
                                          : ""));
}

/// One point, or why it cannot be used.
SensorPoint point_at(double reference, const ChannelSeen& seen) {
  if (seen.fault != Fault::none) throw Error(std::string(text(seen.fault)));
  if (seen.count < 2 || !seen.finite) throw Error("nothing comes from " + seen.channel.source);
  if (const ChannelSeen::Rail rail = seen.rail();
      rail == ChannelSeen::Rail::upper || rail == ChannelSeen::Rail::lower) {
    throw Error("the input is at its rail: it may see more than it can tell");
  }
  return {
      .value = reference,
      .raw = seen.raw(seen.mean),
      .scatter = seen.scatter / std::abs(seen.channel.conversion.scale) / std::sqrt(static_cast<double>(seen.count))};
}

std::string today() {
  const std::chrono::year_month_day date{std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now())};
  std::ostringstream text;
  text << static_cast<int>(date.year()) << (static_cast<unsigned>(date.month()) < 10 ? "-0" : "-")
       << static_cast<unsigned>(date.month()) << (static_cast<unsigned>(date.day()) < 10 ? "-0" : "-")
       << static_cast<unsigned>(date.day());
  return text.str();
}

/// The one device, opened and nothing else.
BenchInputs open_one(BenchConfig bench, const std::string& device) {
  std::erase_if(bench.devices, [&](const BenchConfig::Device& one) { return one.name != device; });
  BenchInputs inputs = open_inputs(bench);
  if (!inputs.devices.front().input) throw DeviceError(inputs.devices.front().why_not);
  return inputs;
}

/// What the channel sees over some seconds.
ChannelSeen seen_on(BenchInputs& inputs, Signal signal, double seconds) {
  for (ChannelSeen& seen : look_at(inputs, seconds)) {
    if (seen.channel.signal == signal) return std::move(seen);
  }
  throw Error("the device does not measure it");
}

/// Asks for references until an empty line, and reads the channel at each. What cannot be taken is said, and goes on.
std::vector<SensorPoint> ask_for_points(BenchInputs& inputs, Signal signal, std::string_view raw_unit,
                                        const CalibrateOptions& o) {
  const auto& hold = inputs.devices.front().hold;
  const std::string unit(info(signal).unit);
  std::vector<SensorPoint> points;
  std::string line;
  while (std::cout << points.size() + 1 << "> " << std::flush, std::getline(std::cin, line)) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) break;
    try {
      const double reference = reference_of(line, signal, o.arm);
      if (hold) hold(signal, reference);
      points.push_back(point_at(reference, seen_on(inputs, signal, o.seconds)));
      std::cout << "   " << pretty(reference, 6) << " " << unit << " at " << pretty(points.back().raw, 6) << " +- "
                << pretty(points.back().scatter, 2) << " " << raw_unit << "\n";
    } catch (const Error& e) {
      std::cout << "   not taken: " << e.what() << "\n";
    }
  }
  std::cout << "\n";
  return points;
}

/// `residual 0.01 rad/s, 5 points`
std::string residual_in_words(const SensorFit& fit, std::size_t points, const std::string& unit) {
  return points > 2 ? "residual " + pretty(fit.residual, 2) + " " + unit + ", " + std::to_string(points) + " points"
                    : "residual unknown, 2 points";
}

/// Beside what stood in the file.
void tell_fit(const SensorFit& fit, const Conversion& old, std::size_t points, const std::string& unit) {
  std::cout << "scale " << pretty(fit.scale, 6) << " " << unit << " per " << old.unit << ", offset "
            << pretty(fit.offset, 6) << " " << unit << "; " << residual_in_words(fit, points, unit) << "\n";
  if (points == 2) std::cout << "Two points always lie on a line: a third would show whether the sensor does.\n";
  const double change = fit.scale / old.scale;
  if (change < 0) {
    std::cout << "The sign has changed: either it was wrong, or the references were typed without theirs.\n";
  } else if (change > much || change < 1 / much) {
    std::cout << "The scale has changed by a factor of " << pretty(change, 3) << ".\n";
  }
}

/// @throws Error where the file is no longer what was read.
std::filesystem::path write_conversion(const BenchConfig& bench, const std::vector<std::string>& path,
                                       const SensorFit& fit, const Conversion& old, const std::string& residual) {
  const std::array numbers = as_in_file(fit, old);
  const std::filesystem::path file = std::filesystem::canonical(bench.file);  // a link stays one
  if (YamlMap::read_text(file) != bench.text) {
    throw Error(file.string() + ": has changed meanwhile, and stays as it is. Write scale: " +
                pretty(numbers[0].second, 6) + ", " + numbers[1].first + ": " + pretty(numbers[1].second, 6));
  }
  const std::string text = edited(bench.text, file, path, numbers, "calibrated " + today() + ": " + residual);
  rewrite(file, text);
  return file;
}

}  // namespace

int calibrate_channel(const CalibrateOptions& o) {
  const auto signal = signal_named(o.signal);
  if (!signal) throw Error("`" + o.signal + "` is no signal. Signals are omega, torque, e_a, i_a, i_f ...");
  if (!(o.seconds > 0)) throw Error("--seconds must be above 0");
  if (!(o.share > 0 && o.share < 1)) throw Error("--tolerance must be between 0 and 1: a share of the span");
  const BenchConfig bench = read_bench(o.file);
  const Place place = place_of(bench, *signal);
  BenchInputs inputs = open_one(bench, place.device);
  const std::string unit(info(*signal).unit);

  const bool simulated = static_cast<bool>(inputs.devices.front().hold);
  Channel channel;
  for (const Channel& one : inputs.devices.front().input->channels()) {
    if (one.signal == *signal) channel = one;
  }
  const Conversion old = channel.conversion;
  if (!old.from_file) {
    throw Error(bench.file.string() + ": " + channel.source +
                " has no scale and offset in the bench file: its readings are taken as they come");
  }

  std::cout << o.signal << " is " << channel.source << ": scale " << pretty(old.scale, 6) << " " << unit << " per "
            << old.unit << ", offset " << pretty(old.offset, 6) << " " << unit
            << (simulated
                    ? ".\nThe machine is simulated: type a value, and it is held there. An empty line ends.\n"
                    : ".\nHold the machine at a known value, let it settle, type the value. An empty line ends.\n");
  const std::vector<SensorPoint> points = ask_for_points(inputs, *signal, old.unit, o);
  const SensorFit fit = fit_sensor(points, channel.lsb / std::abs(old.scale), o.share);
  tell_fit(fit, old, points.size(), unit);
  const auto file = write_conversion(bench, place.path, fit, old, residual_in_words(fit, points.size(), unit));
  std::cout << file.string() << ": written\n";
  return 0;
}

}  // namespace emtb
