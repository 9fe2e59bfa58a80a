// How fast the recorder takes what a card of 8 channels at 100 kS/s gives (the class of card of Erdal et al. 2011).
//
//     recorder_rate [--seconds S] [--folder DIR]
//
// S seconds of such readings go through the loop's ring as fast as the recorder takes them: black box, batches, HDF5,
// flushes. Beside it the same bytes by write(2) alone. Then the session is read back, and every reading must be there.
// Exit 1: one is missing or is another.

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <iostream>
#include <thread>

#include "daemon/recorder.h"
#include "session/spec.h"

namespace emtb {
namespace {

constexpr std::array signals{Signal::u_ref, Signal::e_a,    Signal::i_a, Signal::omega,
                             Signal::theta, Signal::torque, Signal::i_f, Signal::temperature};
constexpr double rate = 100e3;  // [Hz]

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double time_of(std::size_t tick) { return static_cast<double>(tick) / rate; }

/// Another number for each reading.
double value_of(std::size_t tick, std::size_t channel) { return static_cast<double>(8 * tick + channel); }

void say(const std::string& what, std::size_t readings, double seconds) {
  const double per_second = static_cast<double>(readings) / seconds;
  std::cout << what << ": " << per_second / 1e6 << " million readings/s, " << 16e-6 * per_second << " MB/s, "
            << per_second / (rate * signals.size()) << " x real time\n";
}

void push_all(Ring& ring, std::size_t ticks) {
  const auto push = [&](const Record& record) {
    while (!ring.push(record)) std::this_thread::yield();
  };
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double t = time_of(tick);
    for (std::size_t c = 0; c < signals.size(); ++c) {
      push({.signal = signals[c], .t = t, .value = value_of(tick, c), .at = t});
    }
  }
  push({.kind = Record::Kind::end, .t = time_of(ticks)});
}

void record(const std::filesystem::path& path, std::size_t ticks) {
  std::vector<Channel> channels;
  for (const Signal signal : signals) {
    channels.push_back({.signal = signal, .period = 1 / rate, .source = {}, .conversion = {.scale = 1}});
  }
  Ring ring(4'000'000);  // what emtbd takes at most
  std::atomic<bool> failed = false;
  Recorder recorder(
      ring, failed, open_session, {},
      {.disk_low = nullptr,
       .room = {},
       .black_box = BlackBox({.folder = path.parent_path(), .channels = channels, .period = 1 / rate, .config = {}})});
  recorder.open(path, {.channels = channels, .attributes = {}, .config = {}}, "as fast as it goes");
  const double began = now();
  std::jthread loop([&] { push_all(ring, ticks); });
  while (recorder.recording()) {
    if (recorder.work(now()) == 0) std::this_thread::yield();
  }
  say("recorder", ticks * signals.size(), now() - began);
  if (failed) std::cout << "  the recorder failed\n";
}

/// The least that writing can cost: times and values, as they are, in blocks of a megabyte.
void write_alone(const std::filesystem::path& path, std::size_t ticks) {
  std::vector<double> block(131'072);
  const std::size_t numbers = 2 * ticks * signals.size();
  const int fd = ::open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
  const double began = now();
  for (std::size_t done = 0; done < numbers; done += block.size()) {
    for (std::size_t k = 0; k < block.size(); ++k) block[k] = static_cast<double>(done + k);
    if (::write(fd, block.data(), block.size() * sizeof(double)) < 0) break;
  }
  say("write(2) alone", ticks * signals.size(), now() - began);
  ::close(fd);
  std::filesystem::remove(path);
}

/// How many readings are missing or another.
std::size_t wrong_in(const std::filesystem::path& path, std::size_t ticks) {
  std::size_t wrong = 0;
  const Session session = read_session(path);
  for (std::size_t c = 0; c < signals.size(); ++c) {
    const Series& series = session.runs.at(0).at(signals[c]);
    const std::size_t there = std::min(ticks, series.t.size());
    wrong += ticks - there;
    for (std::size_t tick = 0; tick < there; ++tick) {
      if (series.t[tick] != time_of(tick) || series.value[tick] != value_of(tick, c)) ++wrong;
    }
  }
  return wrong;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  double seconds = 20;
  std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    if (words[i] == "--seconds") seconds = std::stod(words[i + 1]);
    if (words[i] == "--folder") folder = words[i + 1];
  }
  const auto ticks = static_cast<std::size_t>(seconds * emtb::rate);
  const std::filesystem::path session = folder / ("recorder_rate-" + std::to_string(::getpid()) + ".h5");
  emtb::record(session, ticks);
  const std::size_t wrong = emtb::wrong_in(session, ticks);
  std::filesystem::remove(session);
  emtb::write_alone(folder / "recorder_rate.bin", ticks);
  std::cout << ticks * emtb::signals.size() << " readings, " << wrong << " missing or another\n";
  return wrong == 0 ? 0 : 1;
}
