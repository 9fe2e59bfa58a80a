#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <optional>
#include <system_error>
#include <vector>

#include "daemon/daemon.h"
#include "daemon/guardian.h"
#include "daemon/lock.h"
#include "daemon/log.h"
#include "daemon/make_safe.h"
#include "daemon/options.h"
#include "daemon/repairs.h"
#include "drivers/registry.h"
#include "drivers/replay/open.h"
#include "drivers/simulated/paced_clock.h"
#include "emtb/version.h"
#include "hal/error.h"
#include "hal/standard_streams.h"
#include "server/client.h"
#include "session/writer.h"

namespace emtb {
namespace {

/// What an exception that nobody catches, in any thread, still has to do.
std::atomic<AnalogOutput*> last_resort{nullptr};

struct Forget {  // before the output itself goes
  ~Forget() { last_resort = nullptr; }
};

/// Safe first, then a line for a person: memory may be what is missing.
void die_safely() {
  AnalogOutput* const output = last_resort.exchange(nullptr);
  if (output != nullptr) output->make_safe();
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "emtbd: %s, where nothing could take it. %s\n", e.what(),
                 output != nullptr ? "The reference was made safe" : "No bench was open");
  } catch (...) {  // of a library's own kind: abort() says all that is known
  }
  std::abort();
}

/// The folder for sessions: made where missing, ours to write in.
void prepare_data(const std::filesystem::path& data) {
  std::error_code error;
  std::filesystem::create_directories(data, error);
  std::string probe = (data / ".emtbd-XXXXXX").string();
  const int file = error ? -1 : mkstemp(probe.data());  // asks the disk itself: modes say nothing to root
  if (file < 0) {
    const std::string why = error ? error.message() : std::generic_category().message(errno);
    throw Error(data.string() + ": sessions cannot be written there: " + why + ". Give another --data DIR");
  }
  close(file);
  unlink(probe.c_str());
}

/// In a process of its own, which Repairs started.
int repair(const std::filesystem::path& file) {
  repair_alone(file);
  return 0;
}

/// `--pace` takes the place of simulation.pace. The bench's own text, which sessions keep, stays as it is.
void override_pace(const Options& options, const BenchConfig& config) {
  if (!options.pace) return;
  if (!config.simulation) {
    throw Error("--pace: " + config.name + " is no simulated bench; its time is the world's. Leave it out");
  }
  YAML::Node simulation = config.simulation->node();  // a handle, not a copy
  simulation["pace"] = std::isinf(*options.pace) ? "max" : fmt::format("{}", *options.pace);
}

/// Simulated time: experiments at the pace that was asked for, idle at the pace of people.
void set_pace(const Bench& bench, Daemon::Settings& settings) {
  using simulated::PacedClock;
  const auto clock = std::dynamic_pointer_cast<PacedClock>(bench.clock);
  if (!clock) return;
  const double pace = clock->pace();
  clock->set_pace(1);
  settings.pace = pace == PacedClock::as_fast_as_possible ? "max" : fmt::format("{}", pace);
  settings.set_pace = [clock, pace](bool busy) { clock->set_pace(busy ? pace : 1); };
  settings.realtime = Realtime::off;  // a loop that hardly sleeps must not outrank everybody
}

Bench open_live(const Options& options, const BenchConfig& config, Daemon::Settings& settings) {
  override_pace(options, config);
  Bench bench = open_bench(config);
  set_pace(bench, settings);
  return bench;
}

/// A daemon that can serve nobody for lack of memory, yet holds the bench, is worse than none.
/// @throws std::bad_alloc where less is free than clients and recordings need
void refuse_without_spare_memory() {
  constexpr std::size_t spare = std::size_t{4} << 20;  // bytes
  std::vector<char> block(spare);
  volatile char& last = block.back();
  last = 1;  // or it may be left out
}

Bench open_replay(const Options& options, BenchConfig& config, Daemon::Settings& settings) {
  const double pace = options.pace.value_or(1);
  config.reference.rate = 0;  // the recorded reference was within it
  replay::Replay opened = replay::open(options.replay.string(), config.reference.limits, 1 / config.rate, pace);
  settings.pace = std::isinf(pace) ? "max" : fmt::format("{}", pace);
  settings.set_pace = opened.play;
  settings.recorded = std::move(opened.profile);
  settings.replay_of = options.replay.string();
  settings.realtime = Realtime::off;
  return std::move(opened.bench);
}

int serve(const Options& options) {
  if (!options.repair.empty()) return repair(options.repair);
  if (options.safe) return make_safe(options.config, "emtbd");
  BenchConfig config = read_bench(options.config);

  // First what tells whether another daemon is at work; only then the devices. A replay leaves those to whoever has
  // them.
  const bool replays = !options.replay.empty();
  std::optional<PathLock> bench_lock;
  if (!replays) bench_lock.emplace(options.config, "bench");
  prepare_data(options.data);
  const PathLock data_lock(options.data, "data folder");
  UnixSocketServer server(options.socket.empty() ? socket_to_listen() : options.socket);

  // Signals are taken by sigtimedwait below; every thread started from here on inherits the mask.
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGHUP);
  sigaddset(&ending, SIGCHLD);  // no end of ours, but perhaps the guardian's
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  signal(SIGPIPE, SIG_IGN);
  for (const int stops : {SIGTSTP, SIGTTIN, SIGTTOU}) signal(stops, SIG_IGN);  // who stands still stops no motor
  signal(SIGXFSZ, SIG_IGN);  // a full disk is the recorder's fault to report

  Daemon::Settings settings{.data = std::filesystem::absolute(options.data),
                            .realtime = config.realtime,
                            .log = [](const std::string& line) { spdlog::info("{}", line); }};
  Guardian guardian(std::filesystem::read_symlink("/proc/self/exe").parent_path() / "emtb-safe", options.config);
  if (!replays && !guardian.start()) {
    spdlog::warn("no guardian: emtb-safe is not beside emtbd, or does not start. A kill -9 leaves the reference on");
  }
  settings.at_work = [&guardian] { guardian.sign_of_life(); };
  Bench bench = replays ? open_replay(options, config, settings) : open_live(options, config, settings);
  last_resort = bench.reference.get();
  std::set_terminate(die_safely);
  Daemon daemon(config, std::move(bench), server, std::move(settings));
  const Forget forget;
  refuse_without_spare_memory();
  spdlog::info("{} at {} Hz, sessions in {}; latched until `emtb reset`", config.name, config.rate,
               options.data.string());
  sd_notify(0, "READY=1");
  const Repairs repairs(options.data, "/proc/self/exe", [](const std::string& line) { spdlog::warn("{}", line); });

  std::uint64_t watchdog_us = 0;
  const bool watched = sd_watchdog_enabled(0, &watchdog_us) > 0;
  constexpr std::uint64_t sign_of_life_us = 500'000;  // to the guardian
  const std::uint64_t wait_us =
      watched ? std::clamp<std::uint64_t>(watchdog_us / 3, 1000, sign_of_life_us) : sign_of_life_us;
  const timespec wait{static_cast<time_t>(wait_us / 1'000'000), static_cast<long>(wait_us % 1'000'000 * 1000)};
  for (std::uint64_t ticks = 0;;) {
    const int signal = sigtimedwait(&ending, nullptr, &wait);
    if (guardian.has_died()) {
      daemon.guardian_lost(guardian.start());
      spdlog::error("the guardian has died");
    }
    if (signal > 0 && signal != SIGCHLD) {
      spdlog::info("{}: ending", strsignal(signal));
      break;
    }
    // A loop that stands still is not worth a sign of life: the guardian, or systemd, then ends us and makes the
    // reference safe.
    if (daemon.ticks() != ticks) {
      guardian.sign_of_life();
      if (watched) sd_notify(0, "WATCHDOG=1");
    }
    ticks = daemon.ticks();
  }
  guardian.expect_none();
  sd_notify(0, "STOPPING=1");
  daemon.terminate();
  return 0;
}

/// Says what the daemon ends of. @return the exit code
int ended_by(const std::exception& e) {
  last_resort = nullptr;
  const auto* const system = dynamic_cast<const std::system_error*>(&e);
  const bool no_memory = dynamic_cast<const std::bad_alloc*>(&e) != nullptr ||
                         (system && system->code() == std::errc::resource_unavailable_try_again);  // a thread's stack
  std::cerr << "emtbd: "
            << (no_memory ? "the memory that is free is not enough. End other programs, or allow it more" : e.what())
            << "\n";
  return 2;
}

/// Each thread that meets another at the heap reserves 64 MB of addresses, by chance: what a run takes of little memory
/// would be told before it, and then not be there.
void reserve_few_arenas() {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 2);
#endif
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  using namespace emtb;
  reserve_few_arenas();
  have_standard_streams();
  try {
    const Options options = parse_options(argc, argv);
    if (options.help) {
      std::cout << options_help;
      return 0;
    }
    if (options.version) {
      std::cout << "emtbd " << version << (*commit ? std::string(" (commit ") + commit + ")" : "") << "\n";
      return 0;
    }
    log_to_standard_error();
    return serve(options);
  } catch (const std::exception& e) {
    return ended_by(e);
  }
}
