#include "daemon/black_box.h"

#include <algorithm>
#include <array>
#include <limits>

#include "daemon/recorder.h"
#include "daemon/traffic.h"
#include "session/field.h"
#include "session/writer.h"

namespace emtb {
namespace {

constexpr std::size_t most_happenings = 512;

std::size_t points_of(const Channel& channel, double period) {
  return static_cast<std::size_t>(BlackBox::seconds * readings_per_second(channel, 1 / period) * 1.1) + 16;
}

std::string words(const Record& record) {
  if (record.kind == Record::Kind::state) {
    return "the loop is " + std::string(word(static_cast<LoopState>(static_cast<int>(record.value))));
  }
  if (record.kind == Record::Kind::field) return field_words(record.value);
  if (record.kind == Record::Kind::end) return "the run is over";
  return describe(record);
}

int code_of(const Record& record) {
  if (record.kind == Record::Kind::state) return event_code::state;
  if (record.kind == Record::Kind::field) return event_code::field;
  return record.kind == Record::Kind::end ? event_code::run_ended : record.code;
}

}  // namespace

BlackBox::BlackBox(Settings settings) : settings_(std::move(settings)), happened_(most_happenings) {
  for (const Channel& channel : settings_.channels) {
    tracks_[channel.signal].points.resize(points_of(channel, settings_.period));
  }
}

void BlackBox::take(const Record& record) {
  if (record.kind != Record::Kind::sample && record.kind != Record::Kind::glimpse) {
    happened_[happenings_++ % happened_.size()] = record;
    return;
  }
  const auto track = tracks_.find(*record.signal);
  if (track == tracks_.end()) return;
  auto& [points, written] = track->second;
  if (written > 0 && record.at < points[(written - 1) % points.size()].at) begin_anew();
  points[written++ % points.size()] = {.at = record.at, .value = record.value};
}

void BlackBox::begin_anew() {
  for (auto& [signal, track] : tracks_) track.written = 0;
  happenings_ = 0;
}

std::filesystem::path BlackBox::dump(std::int64_t utc, const std::string& why) const {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  const auto each = [](const Track& track, const auto& act) {
    const std::size_t size = track.points.size();
    for (std::size_t n = track.written - std::min(track.written, size); n < track.written; ++n) {
      act(track.points[n % size]);
    }
  };
  for (const auto& [signal, track] : tracks_) {
    each(track, [&](const Point& point) {
      first = std::min(first, point.at);
      last = std::max(last, point.at);
    });
  }
  if (first > last) return {};
  first = std::max(first, last - seconds);

  SessionWriter::Description description{
      .channels = settings_.channels, .attributes = settings_.attributes, .config = settings_.config};
  description.attributes["profile"] = "blackbox";
  description.attributes["note"] = why;
  description.attributes["started_utc"] = utc_text(static_cast<double>(utc) - (last - first));
  const auto path = session_path(settings_.folder, utc, "blackbox");
  SessionWriter writer(path, description);
  writer.append(Event{0, event_code::run, "blackbox"});
  std::vector<double> t, value;
  for (const auto& [signal, track] : tracks_) {
    t.clear();
    value.clear();
    each(track, [&](const Point& point) {
      if (point.at < first) return;
      t.push_back(point.at - first);
      value.push_back(point.value);
    });
    writer.append(signal, t, value);
  }
  for (std::size_t n = happenings_ - std::min(happenings_, happened_.size()); n < happenings_; ++n) {
    const Record& record = happened_[n % happened_.size()];
    if (record.at >= first) writer.append(Event{record.at - first, code_of(record), words(record)});
  }
  writer.finish();
  return path;
}

}  // namespace emtb
