#include <algorithm>
#include <cmath>
#include <iostream>

#include "config/guards.h"
#include "figures/terminal.h"
#include "hal/unit.h"
#include "report/text.h"
#include "tools/bench_inputs.h"

namespace emtb {
namespace {

constexpr double looked = 1;       // [s]
constexpr double stale_least = 1;  // [s] younger than this nothing is stale: this is no real-time program

struct Remark {
  std::string text;
  bool wrong = false;  ///< or only worth a look
};

std::string with_unit(double value, Signal signal) { return pretty(value) + with_space(info(signal).unit); }

/// What a reading itself says.
std::vector<Remark> remarks_of(const ChannelSeen& seen) {
  const Channel& c = seen.channel;
  std::vector<Remark> remarks;
  if (seen.fault != Fault::none) remarks.push_back({std::string(text(seen.fault)), true});
  if (seen.count == 0) {
    remarks.push_back({"nothing came in " + pretty(seen.age, 2) + " s", true});
    return remarks;
  }
  if (!seen.finite) remarks.push_back({"not a number", true});
  if (seen.age > std::max(stale_least, 3 * c.period + c.window)) {
    remarks.push_back({"stale: the last reading is " + pretty(seen.age, 2) + " s old", true});
  }
  const ChannelSeen::Rail rail = seen.rail();
  if (rail == ChannelSeen::Rail::upper) remarks.push_back({"at the upper rail", true});
  if (rail == ChannelSeen::Rail::lower) remarks.push_back({"at the lower rail", true});
  if (rail == ChannelSeen::Rail::zero) remarks.push_back({"at 0, the least that its input can tell: is it wired?"});
  return remarks;
}

/// What the bench file says of such a reading.
std::vector<Remark> remarks_of(const ChannelSeen& seen, const BenchConfig& bench) {
  std::vector<Remark> remarks;
  if (seen.count == 0) return remarks;
  const bool is_set_so = seen.channel.signal == Signal::u_ref && bench.reference.limits.safe == 0;
  if (seen.finite && seen.lowest == 0 && seen.highest == 0 && !is_set_so) {
    remarks.push_back({"exactly 0 in all " + std::to_string(seen.count) + " readings: is it wired?"});
  }
  const auto beyond = [&](std::string_view key, const std::optional<double>& limit) {
    if (limit && std::abs(seen.mean) > *limit) {
      remarks.push_back({"beyond limits." + std::string(key) + ", " + with_unit(*limit, seen.channel.signal), true});
    }
  };
  switch (seen.channel.signal) {
    case Signal::omega:
      beyond("omega", bench.limits.omega);
      break;
    case Signal::i_a:
      beyond("i_a", bench.limits.i_a);
      break;
    case Signal::torque:
      beyond("torque", bench.limits.torque);
      break;
    case Signal::i_f:
      if (bench.field_min && seen.mean < *bench.field_min) {
        remarks.push_back({"below field.min, " + with_unit(*bench.field_min, Signal::i_f) + ": nothing may turn yet"});
      }
      break;
    default:
      break;
  }
  return remarks;
}

std::string range_of(const Channel& channel) {
  if (!std::isfinite(channel.low) || !std::isfinite(channel.high)) return "-";
  return pretty(channel.low) + " to " + pretty(channel.high);
}

std::string raw_of(const ChannelSeen& seen) {
  if (seen.count == 0 || seen.channel.conversion.scale == 0) return "-";
  return pretty(seen.raw(seen.mean)) + " " + std::string(seen.channel.conversion.unit);
}

}  // namespace

int check_bench(const std::string& file) {
  const BenchConfig bench = read_bench(file);
  BenchInputs inputs = open_inputs(bench);
  bool wrong = false;
  std::cout << bench.name << ": each signal once; nothing is moved\n";
  for (const BenchInputs::Device& device : inputs.devices) {
    if (device.why_not.empty()) continue;
    std::cout << fitted("  WRONG: " + device.why_not, width_of_rows());
    wrong = true;
  }
  Table table({"signal", "reads", "scatter", "unit", "at the input", "range", "from"});
  std::vector<std::string> lines;
  const std::vector<ChannelSeen> seen_all = look_at(inputs, looked);
  for (const ChannelSeen& seen : seen_all) {
    const SignalInfo& signal = info(seen.channel.signal);
    const bool any = seen.count > 0;
    table.row({std::string(signal.name), any ? pretty(seen.mean) : "-", any ? pretty(seen.scatter, 2) : "-",
               shown_unit(signal.unit), raw_of(seen), range_of(seen.channel), seen.channel.source});
    std::vector<Remark> remarks = remarks_of(seen);
    std::ranges::move(remarks_of(seen, bench), std::back_inserter(remarks));
    for (const Remark& remark : remarks) {
      lines.push_back((remark.wrong ? "WRONG: " : "note: ") + std::string(signal.name) + ": " + remark.text);
      wrong = wrong || remark.wrong;
    }
  }
  if (!seen_all.empty()) std::cout << table.text("  ", width_of_rows());
  std::vector<Channel> channels;
  for (const ChannelSeen& seen : seen_all) channels.push_back(seen.channel);
  for (const Guard& guard : guards_of(bench, channels)) {
    lines.push_back((guard.wrong.empty() ? "guard: " : "WRONG: ") + guard.text);
    wrong = wrong || !guard.wrong.empty();
  }
  for (const std::string& line : lines) std::cout << fitted("  " + line, width_of_rows());
  if (!wrong) {
    std::cout << fitted("Every signal reads. Signs and scales are seen when it turns: emtb bench spin",
                        width_of_prose());
  }
  return wrong ? 1 : 0;
}

}  // namespace emtb
