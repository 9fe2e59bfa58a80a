#include "daemon/admission.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>

#include "config/profile_path.h"
#include "daemon/recorder.h"
#include "daemon/traffic.h"
#include "server/rpc.h"

namespace emtb {
namespace {

using nlohmann::json;
using rpc::Refusal;

bool is_inline(const std::string& profile) {
  return profile.find('\n') != std::string::npos || profile.find(": ") != std::string::npos;
}

/// [min] as the files' times have it, when the daemon starts; infinity where there is none. The file of a session is
/// written last when its run ends. A time that is yet to come says only that the clock was set: as if it were now.
double minutes_since_the_last_session(const std::filesystem::path& data) {
  using Time = std::filesystem::file_time_type;
  auto latest = Time::min();
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(data, error)) {
    if (entry.path().extension() == ".h5") latest = std::max(latest, entry.last_write_time(error));
  }
  if (latest == Time::min()) return std::numeric_limits<double>::infinity();
  return std::max(0.0, std::chrono::duration<double, std::ratio<60>>(Time::clock::now() - latest).count());
}

/// [min] of a clock that nobody sets, and that goes on while the computer sleeps.
double boot_minutes() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return (static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec)) / 60;
}

std::string volts(double value) { return json(value).dump() + " V"; }

/// @param value NaN: not measured
std::string but_reads(double value, const char* unit) {
  return std::isnan(value) ? std::string("which this bench does not measure")
                           : "but reads " + json(std::round(value * 100) / 100).dump() + " " + unit;
}

/// @param need the word of the profile file
[[noreturn]] void refuse(const Experiment& experiment, const char* need, const std::string& why) {
  throw Refusal(rpc::code::not_ready, "profile " + experiment.profile.name() + " needs " + why, {{"need", need}});
}

}  // namespace

Admission::Admission(const BenchConfig& bench, const Live& live, Settings settings)
    : bench_(bench),
      live_(live),
      settings_(std::move(settings)),
      idle_before_(minutes_since_the_last_session(settings_.data)),
      idle_since_(boot_minutes()) {}

void Admission::run_ended() {
  idle_since_ = boot_minutes();
  idle_before_ = 0;
}

Experiment Admission::find(const std::string& text) const {
  Experiment experiment = read(text);
  refuse_beyond_limits(experiment);
  return experiment;
}

Experiment Admission::read(const std::string& text) const {
  if (settings_.recorded) {
    if (text == settings_.recorded->name() || text == "replay") return {.profile = *settings_.recorded};
    throw Refusal(rpc::code::bad_profile, "this daemon replays " + settings_.replay_of +
                                              ", whose reference is recorded. Run `replay`, or start emtbd on a bench");
  }
  try {
    if (!is_inline(text)) return read_experiment(named_profile(text, bench_.file));
    const YamlMap yaml = YamlMap::parse(text, "profile");
    if (yaml.text_or("kind", "") == "from_csv")
      yaml.fail("kind", "is from_csv: a text that is sent has no files beside it");
    return read_experiment(yaml);
  } catch (const Error& e) {
    throw Refusal(rpc::code::bad_profile, e.what());
  }
}

void Admission::refuse_beyond_limits(const Experiment& experiment) const {
  const Profile& profile = experiment.profile;
  const Limits& limits = bench_.reference.limits;
  if (profile.max() > limits.max || profile.min() < limits.min) {
    throw Refusal(rpc::code::bad_profile, "profile " + profile.name() + " goes from " + volts(profile.min()) + " to " +
                                              volts(profile.max()) + ", but " + bench_.name + " allows " +
                                              volts(limits.min) + " to " + volts(limits.max) +
                                              ". Lower its level, or see reference in the bench file");
  }
  if (bench_.limits.time && experiment.longest() > *bench_.limits.time) {
    throw Refusal(rpc::code::bad_profile, "profile " + profile.name() + " lasts " + json(experiment.longest()).dump() +
                                              " s" + (experiment.pauses.empty() ? "" : " with its pauses") +
                                              ", but limits.time of " + bench_.name + " is " +
                                              json(*bench_.limits.time).dump() + " s");
  }
}

void Admission::refuse_unless_ready(const Experiment& experiment) const {
  const Needs& needs = experiment.needs;
  if (needs.at_rest) need_rest(experiment);
  if (needs.field) need_field(experiment);
  if (needs.temperature) need_temperature(experiment, *needs.temperature);
  if (needs.idle) need_idle(experiment, *needs.idle);
  need_memory();
  need_room(experiment);
}

/// NaN: not measured.
double Admission::reading(Signal signal) const {
  const bool measured = std::ranges::find(settings_.channels, signal, &Channel::signal) != settings_.channels.end();
  return measured ? live_.value[index(signal)].load() : std::nan("");
}

void Admission::need_rest(const Experiment& experiment) const {
  constexpr double hardly = 0.02;       // of the largest speed: by hand, above a tacho's noise and offset
  constexpr double without_limits = 1;  // [rad/s] by hand, where the bench file says nothing of speeds
  const double rest = bench_.tacho          ? bench_.tacho->omega
                      : bench_.limits.omega ? hardly * *bench_.limits.omega
                                            : without_limits;
  const double omega = reading(Signal::omega);
  if (std::abs(omega) <= rest) return;
  refuse(experiment, "at_rest",
         "the motor at rest: omega within " + json(rest).dump() + " rad/s, " + but_reads(omega, "rad/s") +
             ". Wait until it stands");
}

void Admission::need_field(const Experiment& experiment) const {
  if (!bench_.field_min) {
    refuse(experiment, "field", "a field that is proved. Write field: {min: ...} in the bench file");
  }
  const double i_f = reading(Signal::i_f);
  if (std::abs(i_f) >= *bench_.field_min) return;
  refuse(experiment, "field",
         "the field: i_f of " + json(*bench_.field_min).dump() + " A or more, " + but_reads(i_f, "A"));
}

/// @param highest [degC]
void Admission::need_temperature(const Experiment& experiment, double highest) const {
  const double temperature = reading(Signal::temperature);
  if (temperature <= highest) return;
  refuse(experiment, "temperature",
         "a temperature of " + json(highest).dump() + " degC at most, " + but_reads(temperature, "degC") +
             ". Let it cool");
}

void Admission::need_idle(const Experiment& experiment, double minutes) const {
  const double idle = idle_before_ + boot_minutes() - idle_since_;
  if (!(idle < minutes)) return;
  refuse(experiment, "idle",
         "a cold motor: " + json(minutes).dump() + " min without a run, but the last one ended " +
             json(std::floor(idle * 10) / 10).dump() + " min ago. Wait");
}

/// HDF5 does not survive in every case that memory runs out in the middle of a recording.
void Admission::need_memory() const {
  constexpr std::size_t needed = 48 << 20;    // [bytes] caches and buffers of a session, twice
  void* volatile held = std::malloc(needed);  // volatile: or the compiler takes it for granted
  std::free(held);
  if (held != nullptr) return;
  throw Refusal(rpc::code::cannot_record,
                "a recording needs " + std::to_string(needed >> 20) +
                    " MB of memory, which are not free. End other programs, or give emtbd more");
}

void Admission::need_room(const Experiment& experiment) const {
  if (!settings_.room) return;
  constexpr double each = 2 * sizeof(double) * 1.1;  // [bytes] time and value, and what HDF5 adds
  const double rate = readings_per_second(settings_.channels, bench_.rate);
  const double needed = rate * experiment.longest() * each + static_cast<double>(disk_reserve);
  const auto room = static_cast<double>(settings_.room());
  if (room >= needed) return;
  const auto megabytes = [](double bytes) { return std::to_string(std::llround(bytes / 1e6)) + " MB"; };
  throw Refusal(rpc::code::cannot_record, settings_.data.string() + ": the disk is nearly full: " + megabytes(room) +
                                              " are free, " + experiment.profile.name() + " needs " +
                                              megabytes(needed) +
                                              ". Make room, or start emtbd with another --data DIR");
}

}  // namespace emtb
