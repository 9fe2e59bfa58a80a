#include "daemon/recorder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <utility>

#include "hal/error.h"
#include "session/field.h"

namespace emtb {
namespace {

constexpr double aftermath = 0.5;    // [s] that a black box shows of what followed the fault
constexpr double disk_every = 0.5;   // [s] between looks at the disk
constexpr double flush_every = 0.1;  // [s]; the promise is 0.25 s, and a flush was seen to take 0.1 s

class WriterSink final : public SessionSink {
 public:
  WriterSink(const std::filesystem::path& path, const SessionWriter::Description& description)
      : writer_(path, description) {}
  void append(Signal signal, std::span<const double> t, std::span<const double> value) override {
    writer_.append(signal, t, value);
  }
  void append(const Event& event) override { writer_.append(event); }
  void flush() override { writer_.flush(); }
  void finish() override { writer_.finish(); }

 private:
  SessionWriter writer_;
};

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

}  // namespace

std::string describe(const Record& record) {
  const auto pause = [&] { return "pause " + number(record.value); };
  if (record.code == event_code::paused) return pause() + ": the reference is held until somebody confirms";
  if (record.code == event_code::resumed) return pause() + ": confirmed";
  if (record.code == event_code::unattended) return pause() + ": nobody confirmed in time, the run ends";
  if (record.code != event_code::gap) return describe(static_cast<Fault>(record.code), record.signal, record.value);
  const bool one = record.value == 1;
  if (!record.signal) return "the loop missed " + number(record.value) + (one ? " deadline" : " deadlines");
  return std::string(info(*record.signal).name) + ": " + number(record.value) +
         (one ? " reading is missing before this" : " readings are missing before this");
}

std::string utc_text(double utc) {
  const double whole = std::floor(utc);
  const auto seconds = static_cast<std::time_t>(whole);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>((utc - whole) * 1000));
  return std::string(text.data()) + fraction.data();
}

std::uint64_t free_space(const std::filesystem::path& folder) {
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  return error ? std::numeric_limits<std::uint64_t>::max() : space.available;
}

std::unique_ptr<SessionSink> open_session(const std::filesystem::path& path,
                                          const SessionWriter::Description& description) {
  return std::make_unique<WriterSink>(path, description);
}

std::string describe(Fault fault, std::optional<Signal> signal, double value) {
  std::string words(text(fault));
  if (!signal) return words;
  const SignalInfo& about = info(*signal);
  words += " (" + std::string(about.name);
  if (fault == Fault::stale_signal) {
    words += ": nothing for " + number(value) + " s";
  } else if (fault == Fault::over_speed || fault == Fault::over_current || fault == Fault::over_torque ||
             fault == Fault::non_finite || fault == Fault::output_failed || fault == Fault::field_lost) {
    words += " = " + number(value) + " " + std::string(about.unit);
  }
  if (fault == Fault::dead_tacho || fault == Fault::reversed_tacho) words += " - R_a i_a = " + number(value) + " V";
  if (fault == Fault::device_clock) words += ": off by " + number(value) + " s";
  return words + ")";
}

Recorder::Recorder(Ring& ring, std::atomic<bool>& failed, OpenSink open, Listeners listeners)
    : Recorder(ring, failed, std::move(open), std::move(listeners), {}) {}

Recorder::Recorder(Ring& ring, std::atomic<bool>& failed, OpenSink open, Listeners listeners, Surroundings surroundings)
    : ring_(ring),
      failed_(failed),
      open_(std::move(open)),
      listeners_(std::move(listeners)),
      surroundings_(std::move(surroundings)) {}

void Recorder::finish() {
  const std::lock_guard lock(mutex_);
  if (!latched_by_.empty()) dump();
}

void Recorder::open(const std::filesystem::path& path, const SessionWriter::Description& description,
                    const std::string& profile) {
  const std::lock_guard lock(mutex_);
  if (open_run_) throw SessionError(path_.string() + ": is still being recorded. Wait for the run to end");
  auto sink = open_(path, description);
  sink->append(Event{0, event_code::run, profile});
  sink->flush();
  path_ = path;
  sink_ = std::move(sink);
  open_run_ = true;
  problem_.clear();
  fault_text_.clear();
  failed_ = false;
  if (surroundings_.disk_low != nullptr) *surroundings_.disk_low = false;
}

bool Recorder::recording() const {
  const std::lock_guard lock(mutex_);
  return open_run_;
}

std::size_t Recorder::work(double now) {
  std::vector<Closed> closed;
  std::size_t count = 0;
  {
    const std::lock_guard lock(mutex_);
    now_ = now;
    take_remarks();  // of the run whose end may be in the ring
    count = ring_.consume_all([this](const Record& record) { take(record); });
    write_batches();
    if (sink_ && (now - flushed_ >= flush_every || now < flushed_)) {
      attempt([this] { sink_->flush(); });
      flushed_ = now;
    }
    look_at_disk(now);
    if (!latched_by_.empty() && now >= dump_at_) dump();
    closed.swap(closed_);
  }
  if (listeners_.closed) std::ranges::for_each(closed, listeners_.closed);  // unlocked: it may want to open() the next
  return count;
}

void Recorder::look_at_disk(double now) {
  if (surroundings_.disk_low == nullptr || !surroundings_.room || !open_run_) return;
  if (now >= disk_seen_ && now - disk_seen_ < disk_every) return;
  disk_seen_ = now;
  *surroundings_.disk_low = surroundings_.room() < disk_reserve;
}

void Recorder::dump() {
  const std::string why = std::exchange(latched_by_, {});
  std::string words;
  try {
    const auto path = surroundings_.black_box->dump(std::time(nullptr), why);
    if (path.empty()) return;
    if (listeners_.dumped) listeners_.dumped(path);
    words = path.string() + ": the last seconds before " + why;
  } catch (const std::exception& e) {  // the run's own session is worth more than its black box
    words = std::string("no black box: ") + e.what();
  }
  if (listeners_.happened) listeners_.happened(words);
}

void Recorder::take(const Record& record) {
  if (surroundings_.black_box) surroundings_.black_box->take(record);
  switch (record.kind) {
    case Record::Kind::glimpse:
    case Record::Kind::state:
      return;
    case Record::Kind::field:
      if (sink_) attempt([&] { sink_->append(Event{record.t, event_code::field, field_words(record.value)}); });
      return;
    case Record::Kind::sample: {
      if (!sink_) return;
      Batch& batch = batches_[*record.signal];
      batch.t.push_back(record.t);
      batch.value.push_back(record.value);
      return;
    }
    case Record::Kind::event: {
      const bool harmless = record.code < static_cast<int>(Fault::over_speed);  // a gap, a pause
      const std::string words = describe(record);
      const bool merely_ended = record.code == static_cast<int>(Fault::terminated) && !open_run_;
      if (surroundings_.black_box && !harmless && !merely_ended && latched_by_.empty()) {
        latched_by_ = words;
        dump_at_ = now_ + aftermath;
      }
      if (listeners_.happened) listeners_.happened(words);
      if (!harmless && fault_text_.empty()) fault_text_ = words;
      if (sink_) attempt([&] { sink_->append(Event{record.t, record.code, words}); });
      return;
    }
    case Record::Kind::end:
      close(record);
      return;
  }
}

void Recorder::give_up(const std::string& why) {
  const std::lock_guard lock(mutex_);
  failed_ = open_run_;
  sink_.reset();
  batches_.clear();  // and with them the memory that they hold
  if (open_run_ && problem_.empty()) problem_ = why;
}

void Recorder::take_remarks() {
  if (!listeners_.remarks) return;
  for (const Event& event : listeners_.remarks(runs_)) {
    if (listeners_.happened) listeners_.happened(event.text);
    if (sink_) attempt([&] { sink_->append(event); });
  }
}

void Recorder::close(const Record& end) {
  write_batches();
  Closed closed{.path = path_, .outcome = end.outcome, .fault = static_cast<Fault>(end.code), .text = {}, .t = end.t};
  if (sink_) {
    const std::string figures = listeners_.figures ? listeners_.figures() : std::string();
    const auto clocks = listeners_.clocks ? listeners_.clocks() : std::vector<std::string>();
    attempt([&] {
      for (const std::string& clock : clocks) sink_->append(Event{end.t, event_code::clock, clock});
      if (!figures.empty()) sink_->append(Event{end.t, event_code::figures, figures});
      if (end.outcome == Outcome::done) sink_->append(Event{end.t, event_code::run_ended, "the run ended as planned"});
      if (end.outcome == Outcome::stopped) sink_->append(Event{end.t, event_code::run_ended, "the run was stopped"});
      sink_->finish();
    });
  }
  if (!problem_.empty()) {
    closed.complete = false;
    closed.outcome = Outcome::fault;
    closed.fault = Fault::recorder_failed;
    fault_text_ = std::string(text(Fault::recorder_failed)) + ": " + problem_;
  }
  if (closed.outcome == Outcome::fault) {
    closed.text = fault_text_.empty() ? std::string(text(closed.fault)) : fault_text_;
  }
  closed_.push_back(std::move(closed));  // the last for which memory may be missing: then all of this is done again
  sink_.reset();
  open_run_ = false;
  failed_ = false;
  ++runs_;
}

void Recorder::write_batches() {
  for (auto& [signal, batch] : batches_) {
    if (batch.t.empty()) continue;
    if (sink_) attempt([&, of = signal, &rows = batch] { sink_->append(of, rows.t, rows.value); });
    batch.t.clear();
    batch.value.clear();
  }
}

void Recorder::attempt(const std::function<void()>& write) {
  try {
    write();
  } catch (const std::exception& e) {
    problem_ = e.what();
    failed_ = true;
    sink_.reset();  // it keeps what was flushed; the rest of the run goes nowhere
    if (listeners_.happened) listeners_.happened(std::string(text(Fault::recorder_failed)) + ": " + problem_);
  }
}

std::vector<Channel> recorded_channels(std::vector<Channel> channels, double rate) {
  std::erase_if(channels, [](const Channel& c) { return c.signal == Signal::u_ref; });
  channels.push_back({.signal = Signal::u_ref, .period = 1 / rate, .source = "commanded reference"});
  return channels;
}

std::filesystem::path session_path(const std::filesystem::path& data, std::int64_t utc, const std::string& profile) {
  const std::time_t time = utc;
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 32> stamp{};
  std::strftime(stamp.data(), stamp.size(), "%Y%m%dT%H%M%SZ", &parts);

  std::string word = profile.substr(0, 64);
  for (char& c : word) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';  // never a path of its own
  }
  const std::string stem = std::string(stamp.data()) + "-" + (word.empty() ? "run" : word);
  std::filesystem::path path = data / (stem + ".h5");
  for (int n = 2; std::filesystem::exists(path); ++n) path = data / (stem + "-" + std::to_string(n) + ".h5");
  return path;
}

}  // namespace emtb
