#include "session/spec.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <future>
#include <iterator>
#include <span>
#include <thread>

#include "hal/error.h"
#include "hal/printable.h"
#include "session/csv.h"
#include "session/hdf5.h"
#include "session/held_reference.h"
#include "session/mat.h"
#include "session/resolution.h"
#include "session/shift.h"
#include "session/text.h"
#include "session/unwind.h"

namespace emtb {
namespace {

constexpr std::string_view form = "A session is PATH[#RUN][@T0:T1], its PATH ending in .csv, .h5 or .mat";

bool ends_with(std::string_view text, std::string_view ending) {
  return text.size() >= ending.size() &&
         std::ranges::equal(text.substr(text.size() - ending.size()), ending,
                            [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
}

enum class Kind { csv, hdf5, mat, none };

Kind kind_of(std::string_view path) {
  return ends_with(path, ".csv")   ? Kind::csv
         : ends_with(path, ".h5")  ? Kind::hdf5
         : ends_with(path, ".mat") ? Kind::mat
                                   : Kind::none;
}

Kind need_kind(const std::filesystem::path& path) {
  const Kind kind = kind_of(path.string());
  if (kind == Kind::none)
    throw SessionError(path.string() + ": is none of .csv, .h5 and .mat, which are what emtb reads and writes");
  return kind;
}

/// Where PATH can end: behind each .csv, .h5 or .mat that stands at the end or before # or @.
std::vector<std::size_t> possible_ends(std::string_view text) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i <= text.size(); ++i) {
    const bool boundary = i == text.size() || text[i] == '#' || text[i] == '@';
    if (boundary && kind_of(text.substr(0, i)) != Kind::none) ends.push_back(i);
  }
  return ends;
}

/// A folder, a file and a run may all contain # and @, so the file that exists decides; where none does, the first end
/// with no folder behind it.
std::size_t end_of_path(std::string_view text) {
  const auto ends = possible_ends(text);
  if (ends.empty()) throw SessionError(shown(text) + ": is not a session. " + std::string(form));
  for (const std::size_t end : ends) {
    std::error_code error;
    if (std::filesystem::is_regular_file(std::filesystem::path(text.substr(0, end)), error)) return end;
  }
  const auto found =
      std::ranges::find_if(ends, [&](std::size_t end) { return text.find('/', end) == std::string_view::npos; });
  return found == ends.end() ? ends.back() : *found;
}

bool looks_like_span(std::string_view text) {
  return text.find_first_not_of("0123456789.:+-eE") == std::string_view::npos;
}

void parse_span(std::string_view text, std::string_view span, SessionSpec& spec) {
  const auto fail = [&](const std::string& why) {
    throw SessionError(std::string(text) + ": " + why +
                       ". A span is @T0:T1 in s with T0 < T1, either of which may be left out");
  };
  const std::size_t colon = span.find(':');
  if (colon == std::string_view::npos) fail("the span `@" + shown(span) + "` has no colon");
  const auto bound = [&](std::string_view digits) -> std::optional<double> {
    if (digits.empty()) return std::nullopt;
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value) || value < 0) {
      fail("`" + shown(digits) + "` is not a time in s from the start of the run");
    }
    return value;
  };
  spec.t0 = bound(span.substr(0, colon));
  spec.t1 = bound(span.substr(colon + 1));
  if (!spec.t0 && !spec.t1) fail("the span `@" + shown(span) + "` has neither beginning nor end");
  if (spec.t1 && *spec.t1 <= spec.t0.value_or(0)) fail("the span `@" + shown(span) + "` ends before it begins");
}

std::string span_text(const SessionSpec& spec) {
  if (!spec.t0 && !spec.t1) return "";
  return "@" + (spec.t0 ? shortest(*spec.t0) : "") + ":" + (spec.t1 ? shortest(*spec.t1) : "");
}

/// [s] The times of one row, each signal's its own, differ by their rounding.
constexpr double rounding = 1e-9;

/// Whether reading k tells only of time from t0 on: the mean of a slow meter may have begun before. A signal that
/// has a reading in each row may drive the motor, and stays whole.
bool begins_within(const Series& series, bool sparse, std::size_t k, double t0) {
  if (series.t[k] < t0 - rounding) return false;
  return t0 <= 0 || !sparse || window_start(series, k) >= t0 - rounding;
}

/// A reference is set, and so may be what drives a motor: a voltage, or a current where there is none.
bool may_be_set(std::span<const Run> runs, Signal signal) {
  const auto has = [&](Signal other) {
    return std::ranges::any_of(runs, [&](const Run& run) { return run.has(other); });
  };
  return signal == Signal::u_ref || signal == Signal::e_a || signal == Signal::i_f || signal == Signal::armature_open ||
         (signal == Signal::i_a && !has(Signal::u_ref) && !has(Signal::e_a));
}

/// Is it read here, and not by a child (child.h)?
bool is_text(std::string_view spec) {
  const std::vector<std::size_t> ends = possible_ends(spec);
  return ends.size() == 1 && kind_of(spec.substr(0, ends.front())) == Kind::csv;
}

/// Of instruments whose resolution nobody states, from their readings in all runs together: of a slow meter a run may
/// hold three.
void estimate_resolutions(std::span<Run> runs) {
  for (const Signal signal : all_signals()) {
    std::vector<Series*> series;
    std::vector<std::span<const double>> pieces;
    for (Run& run : runs) {
      if (!run.has(signal) || run.at(signal).lsb > 0) continue;
      series.push_back(&run.signals.at(signal));
      pieces.emplace_back(series.back()->value);
    }
    if (series.empty()) continue;
    const double lsb = resolution(pieces, may_be_set(runs, signal));
    for (Series* s : series) s->lsb = lsb;
  }
}

/// @throws SessionError for times of which no seconds can be made: rows closer than any logger's
void need_seconds(const Run& run, const std::string& name) {
  constexpr double closest = 1e-8;  // [s]
  for (const auto& [signal, series] : run.signals) {
    const double lasts = series.t.back() - series.t.front();
    if (series.t.size() < 2 || lasts >= closest * static_cast<double>(series.t.size() - 1)) continue;
    throw SessionError(name + ": its " + std::to_string(series.t.size()) + " rows of " +
                       std::string(info(signal).column) + " lie within " + shortest(lasts) +
                       " s, as no logger's do. Map its time by --map, with the unit that it has");
  }
}

/// The runs of one, their angles as they were read.
std::vector<Run> read_one(std::string_view text, const Mapping& mapping) {
  const SessionSpec spec = parse_session_spec(text);
  Session session = read_session(spec.path, mapping);
  if (session.runs.empty()) throw SessionError(spec.path.string() + ": holds no reading. Record at least one signal");
  const bool several = session.runs.size() > 1;
  if (!spec.run.empty()) {
    std::vector<std::string> names;
    for (const Run& run : session.runs) names.push_back(run.name);
    std::erase_if(session.runs, [&](const Run& run) { return run.name != spec.run; });
    if (session.runs.empty()) {
      throw SessionError(
          spec.path.string() + ": no run `" + shown(spec.run) + "`. " +
          (several ? "Runs here: " + listed(names) : "It holds a single run: leave out #" + shown(spec.run)));
    }
  }
  std::vector<Run> runs;
  for (const Run& whole : session.runs) {
    Run run = spec.t0 || spec.t1 ? cut(whole, spec.t0.value_or(0), spec.t1.value_or(HUGE_VAL)) : whole;
    const std::string name = spec.path.string() + (several || !spec.run.empty() ? "#" + printable(whole.name) : "");
    if (run.signals.empty()) {
      throw SessionError(name + ": the span " + span_text(spec) + " holds no reading; the run lasts from 0 to " +
                         shortest(whole.duration()) + " s");
    }
    need_seconds(run, name);
    run.name = name + span_text(spec);
    runs.push_back(std::move(run));
  }
  return runs;
}

}  // namespace

Run cut(const Run& run, double t0, double t1) {
  Run out{.name = run.name, .signals = {}, .field_on = run.field_on + t0};
  for (const auto& [signal, series] : run.signals) {
    const bool sparse = is_sparse(run, signal);
    Series part{.t = {}, .value = {}, .window = series.window, .lsb = series.lsb, .source = series.source};
    for (std::size_t k = 0; k < series.t.size() && series.t[k] < t1 - rounding; ++k) {
      if (!begins_within(series, sparse, k, t0)) continue;
      part.t.push_back(series.t[k]);
      part.value.push_back(series.value[k]);
    }
    if (part.t.empty()) continue;
    shift_to_zero(part.t, t0);
    out.signals.emplace(signal, std::move(part));
  }
  share_times(out.signals);
  return out;
}

SessionSpec parse_session_spec(std::string_view text) {
  const std::size_t end = end_of_path(text);
  SessionSpec spec;
  spec.path = text.substr(0, end);
  std::string_view rest = text.substr(end);
  const std::size_t at = rest.rfind('@');
  if (at != std::string_view::npos && (at == 0 || looks_like_span(rest.substr(at + 1)))) {
    parse_span(text, rest.substr(at + 1), spec);
    rest = rest.substr(0, at);
  }
  if (rest.empty()) return spec;
  if (rest[0] != '#' || rest.size() == 1) {
    throw SessionError(std::string(text) + ": `" + shown(rest) + "` names no run. " + std::string(form));
  }
  spec.run = rest.substr(1);
  return spec;
}

Session read_session(const std::filesystem::path& path, const Mapping& mapping) {
  const Kind kind = need_kind(path);
  Session session = kind == Kind::csv   ? read_csv(path, mapping)
                    : kind == Kind::mat ? read_mat(path, mapping)
                                        : read_hdf5(path);
  estimate_resolutions(session.runs);
  return session;
}

std::vector<Run> read_runs(std::string_view spec, const Mapping& mapping) {
  std::vector<Run> runs = read_one(spec, mapping);
  hold_references(runs);
  unwind_angles(runs);
  return runs;
}

std::vector<Run> read_runs(const std::vector<std::string>& specs, const Mapping& mapping) {
  const std::size_t at_a_time = std::max(1U, std::thread::hardware_concurrency());
  std::vector<Run> all;
  for (std::size_t begin = 0; begin < specs.size(); begin += at_a_time) {
    const auto part = std::span(specs).subspan(begin, std::min(at_a_time, specs.size() - begin));
    std::vector<std::future<std::vector<Run>>> texts(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (is_text(part[i])) texts[i] = std::async([&, i] { return read_one(part[i], mapping); });
    }
    for (std::future<std::vector<Run>>& text : texts) {
      if (text.valid()) text.wait();  // here, where no thread could be had; a child is made by a process of one thread
    }
    for (std::size_t i = 0; i < part.size(); ++i) {
      std::ranges::move(texts[i].valid() ? texts[i].get() : read_one(part[i], mapping), std::back_inserter(all));
    }
  }
  if (specs.size() > 1) estimate_resolutions(all);
  hold_references(all);
  unwind_angles(all);
  return all;
}

void write_session(const std::filesystem::path& path, const Session& session) {
  switch (need_kind(path)) {
    case Kind::csv:
      return write_csv(path, session);
    case Kind::mat:
      return write_mat(path, session);
    default:
      return write_hdf5(path, session);
  }
}

}  // namespace emtb
