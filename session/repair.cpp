#include <algorithm>

#include "hal/error.h"
#include "session/child.h"
#include "session/h5.h"
#include "session/replace.h"
#include "session/stored.h"
#include "session/writer.h"

namespace emtb {
namespace {

constexpr hsize_t block_rows = 65536;

Channel channel_of(const StoredSession::StoredSignal& stored) {
  Channel channel{
      .signal = stored.signal, .period = 0, .window = stored.window, .lsb = stored.lsb, .source = stored.source};
  try {
    const auto t = h5::numbers(stored.t, 0, std::min<hsize_t>(stored.rows, 1000));
    if (t.size() > 1) channel.period = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  } catch (const h5::Failure&) {  // copy() will find out
  }
  return channel;
}

struct Copied {
  double last = 0;      ///< [s] the last time copied
  hsize_t missing = 0;  ///< rows that cannot be read
};

/// Copies what can be read, block by block, up to the first row that cannot.
Copied copy(const StoredSession::StoredSignal& from, SessionWriter& to) {
  Copied copied;
  hsize_t row = 0;
  for (hsize_t block = block_rows; row < from.rows && block > 0;) {
    const hsize_t count = std::min(block, from.rows - row);
    try {
      const auto t = h5::numbers(from.t, row, count);
      const auto value = h5::numbers(from.value, row, count);
      to.append(from.signal, t, value);
      copied.last = t.back();
      row += count;
    } catch (const h5::Failure&) {
      block /= 2;
    }
  }
  copied.missing = from.lost + from.rows - row;
  return copied;
}

/// @return rows of any signal that could not be read
hsize_t write_repaired(const StoredSession& broken, const std::filesystem::path& draft) {
  SessionWriter::Description description{.channels = {}, .attributes = broken.attributes, .config = broken.config};
  for (const auto& signal : broken.signals) description.channels.push_back(channel_of(signal));
  SessionWriter writer(draft, description);
  Copied all;
  for (const auto& signal : broken.signals) {
    const Copied copied = copy(signal, writer);
    all.last = std::max(all.last, copied.last);
    all.missing += copied.missing;
  }
  for (const Event& event : broken.events) writer.append(event);
  if (broken.complete && all.missing == 0) {  // it died between its last flush and the closing of the file
    writer.finish();
    return 0;
  }
  std::string text = "the recording ended abruptly; what was flushed by then is kept";
  if (all.missing > 0)
    text = "the recording ended abruptly; " + std::to_string(all.missing) + " rows cannot be read any more";
  writer.append({all.last, event_code::repaired, text});
  writer.flush();
  return all.missing;
}

}  // namespace

bool ended_abruptly(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && h5::is_open_for_writing(path) && !is_being_recorded(path);
}

bool repair_alone(const std::filesystem::path& path) {
  bound_this_process(path);
  return repair_session(path);
}

bool repair_session(const std::filesystem::path& path) {
  const h5::Quiet quiet;
  if (is_being_recorded(path))
    throw SessionError(path.string() + ": is being recorded by another process. Repair it when that has ended");
  const StoredSession session = open_stored(path);
  if (session.intact()) return false;
  replace_file(path, [&](const std::filesystem::path& draft) {
    const hsize_t missing = write_repaired(session, draft);
    if (!open_stored(draft).intact()) {
      throw SessionError(path.string() + ": cannot be repaired; it stands as it was. Is the disk full?");
    }
    if (missing > 0) {  // somebody may know how to get more out of it
      std::filesystem::path damaged = path;
      damaged += ".damaged";
      std::error_code ignored;
      std::filesystem::create_hard_link(path, damaged, ignored);
    }
  });
  return true;
}

}  // namespace emtb
