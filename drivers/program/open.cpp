#include "drivers/program/open.h"

#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "config/shipped.h"

namespace emtb::program {
namespace {

constexpr double shortest_period = 0.002;  // [s] what comes faster wants a driver in C++
constexpr double shortest_silence = 0.2;   // [s] an interpreter tidies its memory meanwhile
constexpr double missed_periods = 4;       // one less than the loop bears of a signal: the device is named, then

class Input final : public InputDevice {
 public:
  explicit Input(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  std::span<const Channel> channels() const noexcept override { return device_->channels(); }
  void start() override { device_->start(); }
  Readings read(std::span<Reading> out) noexcept override { return device_->read(out); }

 private:
  std::shared_ptr<Device> device_;
};

class Output final : public AnalogOutput {
 public:
  explicit Output(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  Fault set(double volts) noexcept override { return device_->set(volts); }
  Fault make_safe() noexcept override { return device_->make_safe(); }
  Limits limits() const noexcept override { return device_->limits(); }

 private:
  std::shared_ptr<Device> device_;
};

/// A word of the command that names a program of ours, where the bench was copied away from it.
std::string with_ours(const std::string& word, const std::filesystem::path& folder) {
  const std::filesystem::path named(word);
  if (named.is_absolute() || named.parent_path().filename() != "devices") return word;
  const std::filesystem::path found = beside_or_shipped(folder, named, "devices");
  return found == folder / named ? word : found.string();
}

/// Whom the program becomes where the bench file names nobody: root starts none with its own rights.
constexpr const char* whom_root_makes_it = "nobody";

ChildSettings read_child(const YamlMap& device) {
  ChildSettings child{.command = device.texts("command"), .folder = {}, .user = device.text_or("user", "")};
  child.folder = std::filesystem::absolute(device.file()).parent_path();
  if (child.command.empty())
    device.fail("command", "is empty. Write the program and its arguments: [python3, mine.py]");
  for (std::string& word : child.command) word = with_ours(word, child.folder);
  const std::string program = find_program(child.command[0], child.folder);
  if (program.empty()) {
    device.fail("command", "names `" + child.command[0] +
                               "`, which is no program: a path, from the bench file's folder, or a name in /usr/bin");
  }
  child.command[0] = program;

  const bool root = geteuid() == 0;
  if (root && child.user.empty()) child.user = whom_root_makes_it;
  const passwd* entry = child.user.empty() ? nullptr : getpwnam(child.user.c_str());
  if (child.user.empty()) return child;
  if (entry == nullptr) device.fail("user", "is `" + child.user + "`, whom this computer does not know");
  if (entry->pw_uid == 0) device.fail("user", "is root. Write another, nobody");
  if (!root && entry->pw_uid != geteuid()) {
    device.fail("user", "is `" + child.user +
                            "`, and only root can start a program as another. Remove it: the program runs as whoever "
                            "starts emtbd");
  }
  if (!root) child.user.clear();  // it is who we are
  return child;
}

ProgramChannel read_channel(Signal signal, const YamlMap& yaml) {
  yaml.only({"period", "window", "latency", "unit", "scale", "offset", "resolution", "range"});
  ProgramChannel channel{.signal = signal, .scaling = read_scaling(signal, yaml)};
  channel.period = yaml.within("period", shortest_period, 60);
  channel.window = yaml.within_or("window", 0, 60, 0);
  channel.latency = yaml.within_or("latency", 0, 60, 0);
  return channel;
}

}  // namespace

ProgramSettings read_settings(const YamlMap& device, const BenchConfig::Reference* reference) {
  device.only({"driver", "command", "user", "start_up", "silence", "moves", "channels"});
  ProgramSettings settings{.child = read_child(device), .channels = {}};
  settings.start_up = device.within_or("start_up", 0.1, 60, settings.start_up);
  const bool moves = device.flag_or("moves", false);
  if (reference != nullptr && !moves) {
    reference->yaml.fail("device", "is `" + reference->device +
                                       "`, a program, which moves nothing unless it says so: moves: true. Read in "
                                       "docs/wiring/program.md what it must do then");
  }
  if (reference == nullptr && moves) device.fail("moves", "is true, but reference.device is another. Remove it");
  double shortest = 1;
  if (const auto entries = device.map_if("channels")) {
    for (const auto& [name, entry] : entries->entries()) {
      settings.channels.push_back(read_channel(measured_signal(*entries, name, name), entry));
      const ProgramChannel& channel = settings.channels.back();
      const double patience = missed_periods * channel.period + channel.window;
      shortest = settings.channels.size() == 1 ? patience : std::min(shortest, patience);
    }
  }
  if (settings.channels.empty() && !moves) device.fail("channels", "is empty. Give at least one signal");
  settings.silence = device.within_or("silence", shortest_silence, 300, std::max(shortest_silence, shortest));
  if (moves) {
    reference->yaml.only({"device", "min", "max", "safe", "safe_because", "rate"});
    settings.moves = reference->limits;
  }
  return settings;
}

namespace {

ProgramSettings settings_of(const OpenRequest& request) {
  const bool has_reference = request.bench.reference.device == request.device.name;
  return read_settings(request.device.yaml, has_reference ? &request.bench.reference : nullptr);
}

}  // namespace

void check_program(const OpenRequest& request) {
  request.need_real_time();
  settings_of(request);
}

OpenedDevice open_program(const OpenRequest& request) {
  request.need_real_time();
  ProgramSettings settings = settings_of(request);
  if (!request.drives_reference()) settings.moves.reset();  // it is told nothing, and stays as safe as it began
  auto device = std::make_shared<Device>(request.device.name, request.clock, std::move(settings));
  OpenedDevice opened;
  if (request.drives_reference()) opened.output = std::make_unique<Output>(device);
  if (!device->channels().empty()) opened.input = std::make_unique<Input>(std::move(device));
  return opened;
}

}  // namespace emtb::program
