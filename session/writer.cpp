#include "session/writer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "hal/format_version.h"
#include "session/h5.h"

namespace emtb {
namespace {

constexpr std::size_t event_text_size = 240;  // SWMR cannot write texts of variable length
/// The pages in which the kernel takes over what is written: a kill falls between two of them, never within one.
constexpr hsize_t page_size = 4096;
constexpr std::array attribute_names{"started_utc", "profile", "bench", "operator", "note", "software"};

/// A dataset that grows at its end.
class Growing {
 public:
  Growing(hid_t at, const char* name, hid_t type, hsize_t chunk) {
    const hsize_t none = 0;
    const hsize_t unlimited = H5S_UNLIMITED;
    const h5::Id space(h5::check(H5Screate_simple(1, &none, &unlimited)));
    const h5::Id properties(h5::check(H5Pcreate(H5P_DATASET_CREATE)));
    h5::check(H5Pset_chunk(properties, 1, &chunk));
    id_ = h5::Id(h5::check(H5Dcreate2(at, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT)));
  }

  hid_t id() const { return id_; }
  void abandon() { id_.release(); }

  void append(hid_t type, const void* data, hsize_t count) {
    const hsize_t rows = rows_ + count;
    h5::check(H5Dset_extent(id_, &rows));
    const h5::Id file_space(h5::check(H5Dget_space(id_)));
    const h5::Id memory_space(h5::check(H5Screate_simple(1, &count, nullptr)));
    h5::check(H5Sselect_hyperslab(file_space, H5S_SELECT_SET, &rows_, nullptr, &count, nullptr));
    h5::check(H5Dwrite(id_, type, memory_space, file_space, H5P_DEFAULT, data));
    rows_ = rows;
    unflushed_ = true;
  }

  void flush() {
    if (unflushed_) h5::check(H5Dflush(id_));
    unflushed_ = false;
  }

 private:
  h5::Id id_;
  hsize_t rows_ = 0;
  bool unflushed_ = false;
};

/// One second of rows: small enough that a flush rewrites little, large enough that the index stays small.
hsize_t chunk_of(const Channel& channel) {
  return channel.period > 0 ? static_cast<hsize_t>(std::clamp(1 / channel.period, 16.0, 16384.0)) : 1024;
}

h5::Id text_type() {
  h5::Id type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

/// Of datasets. Said to be ASCII, though UTF-8 is written where a text needs it: Octave opens no file that says UTF-8.
h5::Id text_type(std::size_t size) {
  h5::Id type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, size);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return type;
}

void write_attribute(hid_t at, const char* name, hid_t type, const void* data) {
  const h5::Id space(h5::check(H5Screate(H5S_SCALAR)));
  const h5::Id id(h5::check(H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT)));
  h5::check(H5Awrite(id, type, data));
}

void write_attribute(hid_t at, const char* name, const std::string& text) {
  const char* pointer = text.c_str();
  write_attribute(at, name, text_type(), &pointer);
}

void write_attribute(hid_t at, const char* name, double value) { write_attribute(at, name, H5T_NATIVE_DOUBLE, &value); }

/// Cut to what an event holds, not within a character.
std::array<char, event_text_size> event_text(const std::string& text) {
  std::size_t size = std::min(text.size(), event_text_size);
  while (size > 0 && size < text.size() && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  std::array<char, event_text_size> out{};
  std::memcpy(out.data(), text.data(), size);
  return out;
}

/// A lock that lasts as long as the writing process, by which repair_session() tells a session that is being recorded
/// from one whose writer died. Shared, and of the kind that HDF5 itself does not use, so that readers are not kept out.
class AliveMark {
 public:
  explicit AliveMark(const std::filesystem::path& path) : fd_(::open(path.c_str(), O_RDWR | O_CLOEXEC)) {
    struct flock lock = whole_file(F_RDLCK);
    if (fd_ >= 0) ::fcntl(fd_, F_OFD_SETLK, &lock);
  }
  ~AliveMark() {
    if (fd_ >= 0) ::close(fd_);
  }
  AliveMark(const AliveMark&) = delete;
  AliveMark& operator=(const AliveMark&) = delete;

  /// Whether the file is still the one at this path: nobody has deleted it, moved it, or put another in its place.
  bool stands_at(const std::filesystem::path& path) const {
    struct stat ours {
    }, there{};
    return fd_ < 0 || (fstat(fd_, &ours) == 0 && stat(path.c_str(), &there) == 0 && ours.st_dev == there.st_dev &&
                       ours.st_ino == there.st_ino);
  }

  /// Takes what stands at a place of the file now for what must stand there for good.
  void remember(off_t place, std::size_t size) {
    kept_place_ = place;
    kept_ = read(place, size);
  }

  /// Whether it holds what was flushed: nobody has cut it, or written over its beginning. HDF5 mends the beginning and
  /// the length of a file that is cut while it flushes; what it wrote once only (remember()) tells of that as well.
  bool is_whole() {
    struct stat ours {};
    static constexpr std::string_view signature = "\x89HDF\r\n\x1a\n";
    if (fd_ < 0 || fstat(fd_, &ours) != 0) return true;  // of which nothing is known
    const bool cut = ours.st_size < flushed_;
    flushed_ = ours.st_size;
    return !cut && read(0, signature.size()) == signature && read(kept_place_, kept_.size()) == kept_;
  }

  static bool on(const std::filesystem::path& path) {
    const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    struct flock lock = whole_file(F_WRLCK);
    const bool found = fd >= 0 && ::fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
    if (fd >= 0) ::close(fd);
    return found;
  }

 private:
  static struct flock whole_file(short type) {
    struct flock lock {};
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    return lock;
  }

  std::string read(off_t place, std::size_t size) const {
    std::string found(size, '\0');
    const ssize_t got = pread(fd_, found.data(), found.size(), place);
    found.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return found;
  }

  int fd_;
  off_t flushed_ = 0;  ///< bytes that the file had at the last look
  off_t kept_place_ = 0;
  std::string kept_;
};

}  // namespace

struct SessionWriter::Impl {
  struct Column {
    Signal signal;
    Growing t;
    Growing value;
    std::size_t chunk;
    double last = -std::numeric_limits<double>::infinity();
    std::vector<double> new_t;
    std::vector<double> new_value;
  };
  struct Events {
    explicit Events(hid_t group);
    Growing t;
    Growing code;
    Growing text;
  };

  Impl(const std::filesystem::path& where, const Description& description);
  ~Impl();

  /// @return where in the file the bench's text is
  off_t create(const std::filesystem::path& draft, const Description& description);
  void add_channel(hid_t signals, const Channel& channel);
  static void write_rows(Column& column);
  void flush();
  void need_file();
  void close();
  void abandon();

  /// Does something to the open file; after a failure the writer is of no more use.
  template <class Action>
  void change(Action action) {
    if (broken) throw SessionError(path.string() + ": an earlier write failed. Record into a new session");
    if (!file) throw SessionError(path.string() + ": is closed. Record into a new session");
    const h5::Quiet quiet;
    try {
      action();
    } catch (const h5::Failure& e) {
      abandon();
      throw SessionError(path.string() + ": cannot be written" + e.what() + ". What was flushed before is kept");
    }
  }

  std::filesystem::path path;
  h5::Id file;
  std::vector<Column> columns;
  std::optional<Events> events;
  bool broken = false;
  std::unique_ptr<AliveMark> alive;
};

SessionWriter::Impl::Events::Events(hid_t group)
    : t(group, "t", H5T_IEEE_F64LE, 64),
      code(group, "code", H5T_STD_I32LE, 64),
      text(group, "text", text_type(event_text_size), 16) {}

SessionWriter::Impl::Impl(const std::filesystem::path& where, const Description& description) : path(where) {
  const h5::Quiet quiet;
  std::error_code error;
  if (std::filesystem::exists(path, error))
    throw SessionError(path.string() + ": exists already. Choose another name, or move it away");
  // Until SWMR mode has begun, a process that dies leaves a file that nobody can open. So it gets its name only then.
  std::filesystem::path draft = path;
  draft += ".new";
  try {
    const off_t config = create(draft, description);
    alive = std::make_unique<AliveMark>(draft);
    alive->remember(config, description.config.size());
    std::filesystem::rename(draft, path);
  } catch (const std::exception& e) {
    columns.clear();
    events.reset();
    file.close();
    std::filesystem::remove(draft, error);
    if (dynamic_cast<const SessionError*>(&e)) throw;
    throw SessionError(path.string() + ": cannot be created" + e.what() +
                       ". Is the folder there and yours to write, the disk not full?");
  }
}

SessionWriter::Impl::~Impl() {
  try {
    if (file) change([&] { flush(), close(); });
  } catch (const SessionError&) {  // what was flushed before is kept
  }
}

off_t SessionWriter::Impl::create(const std::filesystem::path& draft, const Description& description) {
  const h5::Id access(h5::check(H5Pcreate(H5P_FILE_ACCESS)));
  h5::check(H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST));
  // What HDF5 keeps of the file's structure it then lays within pages, so that no kill tears it. Only the index of a
  // signal of more than 8,180 chunks has blocks of more than a page.
  const h5::Id layout(h5::check(H5Pcreate(H5P_FILE_CREATE)));
  h5::check(H5Pset_file_space_strategy(layout, H5F_FSPACE_STRATEGY_PAGE, false, 1));
  h5::check(H5Pset_file_space_page_size(layout, page_size));
  file = h5::Id(h5::check(H5Fcreate(draft.c_str(), H5F_ACC_TRUNC, layout, access)));

  const int incomplete = 0;
  write_attribute(file, "format", format_words("session", newest_format::session));
  write_attribute(file, "complete", H5T_NATIVE_INT, &incomplete);
  std::map<std::string, std::string> attributes = description.attributes;
  attributes.erase("format");
  attributes.erase("complete");
  for (const char* name : attribute_names) attributes.try_emplace(name);
  for (const auto& [name, text] : attributes) write_attribute(file, name.c_str(), text);
  off_t config_place = 0;
  {
    const h5::Id type = text_type(std::max<std::size_t>(description.config.size(), 1));
    const h5::Id space(h5::check(H5Screate(H5S_SCALAR)));
    const h5::Id config(h5::check(H5Dcreate2(file, "config", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)));
    h5::check(H5Dwrite(config, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, description.config.c_str()));
    config_place = static_cast<off_t>(H5Dget_offset(config));
  }
  {
    const h5::Id signals(h5::check(H5Gcreate2(file, "signals", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)));
    for (const Channel& channel : description.channels) add_channel(signals, channel);
    events.emplace(h5::Id(h5::check(H5Gcreate2(file, "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT))));
  }
  h5::check(H5Fflush(file, H5F_SCOPE_LOCAL));  // says what the disk refuses; of the same the next call would crash
  h5::check(H5Fstart_swmr_write(file));
  return config_place;
}

void SessionWriter::Impl::add_channel(hid_t signals, const Channel& channel) {
  const std::string name(info(channel.signal).name);
  if (std::ranges::find(columns, channel.signal, &Column::signal) != columns.end()) {
    throw SessionError(path.string() + ": two channels measure " + name + ". Record one of them");
  }
  const h5::Id group(h5::check(H5Gcreate2(signals, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)));
  const hsize_t chunk = chunk_of(channel);
  columns.push_back({.signal = channel.signal,
                     .t = Growing(group, "t", H5T_IEEE_F64LE, chunk),
                     .value = Growing(group, "value", H5T_IEEE_F64LE, chunk),
                     .chunk = chunk,
                     .new_t = {},
                     .new_value = {}});
  write_attribute(columns.back().t.id(), "unit", "s");
  for (const hid_t at : {static_cast<hid_t>(group), columns.back().value.id()}) {
    write_attribute(at, "unit", std::string(info(channel.signal).unit));
    write_attribute(at, "source", channel.source);
    write_attribute(at, "window", channel.window);
    write_attribute(at, "lsb", channel.lsb);
  }
}

void SessionWriter::Impl::write_rows(Column& column) {
  if (column.new_t.empty()) return;
  column.t.append(H5T_NATIVE_DOUBLE, column.new_t.data(), column.new_t.size());
  column.value.append(H5T_NATIVE_DOUBLE, column.new_value.data(), column.new_value.size());
  column.new_t.clear();
  column.new_value.clear();
}

void SessionWriter::Impl::flush() {
  for (Column& column : columns) {
    write_rows(column);
    column.t.flush();
    column.value.flush();
  }
  events->t.flush();
  events->code.flush();
  events->text.flush();
  h5::check(H5Fflush(file, H5F_SCOPE_GLOBAL));  // the datasets' flush alone leaves the file's end unsaid
}

/// What is written to a file that nobody can find again is lost, however well it was written.
void SessionWriter::Impl::need_file() {
  if (!alive) return;
  if (alive->stands_at(path)) {
    if (alive->is_whole()) return;
    throw SessionError(path.string() +
                       ": was cut or written over by another program while it was recorded. Leave the data folder "
                       "alone during a run");
  }
  throw SessionError(path.string() +
                     ": is not there any more: deleted, moved or its disk gone while it was recorded. Leave the data "
                     "folder alone during a run");
}

/// After a failed write (a full disk) the file is left as it is, for readers and repair_session(): closing it would
/// mark it as whole while what it refers to was never written. It stays open within HDF5, for good.
void SessionWriter::Impl::abandon() {
  for (Column& column : columns) {
    column.t.abandon();
    column.value.abandon();
  }
  columns.clear();
  events->t.abandon();
  events->code.abandon();
  events->text.abandon();
  events.reset();
  file.release();
  alive.reset();
  broken = true;
}

void SessionWriter::Impl::close() {
  columns.clear();
  events.reset();
  alive.reset();
  if (file) h5::check(H5Fclose(file.release()));
}

SessionWriter::SessionWriter(const std::filesystem::path& path, const Description& description)
    : impl_(std::make_unique<Impl>(path, description)) {}
SessionWriter::~SessionWriter() = default;
SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;
SessionWriter& SessionWriter::operator=(SessionWriter&&) noexcept = default;

void SessionWriter::append(Signal signal, std::span<const double> t, std::span<const double> value) {
  impl_->change([&] {
    const auto column = std::ranges::find(impl_->columns, signal, &Impl::Column::signal);
    if (column == impl_->columns.end()) {
      throw SessionError(impl_->path.string() + ": no channel measures " + std::string(info(signal).name) +
                         ". Name all channels at the start");
    }
    if (t.size() != value.size())
      throw SessionError(impl_->path.string() + ": " + std::string(info(signal).name) + " needs a value for each time");
    for (std::size_t i = 0; i < t.size(); ++i) {
      if (!std::isfinite(t[i]) || !std::isfinite(value[i]) || t[i] <= column->last) continue;
      column->last = t[i];
      column->new_t.push_back(t[i]);
      column->new_value.push_back(value[i]);
    }
    if (column->new_t.size() >= column->chunk) Impl::write_rows(*column);
  });
}

void SessionWriter::append(const Event& event) {
  impl_->change([&] {
    const auto text = event_text(event.text);
    impl_->events->t.append(H5T_NATIVE_DOUBLE, &event.t, 1);
    impl_->events->code.append(H5T_NATIVE_INT, &event.code, 1);
    impl_->events->text.append(text_type(event_text_size), text.data(), 1);
  });
}

void SessionWriter::flush() {
  impl_->change([&] {
    impl_->need_file();  // before HDF5 mends what another has written over
    impl_->flush();
    impl_->need_file();
  });
}

void SessionWriter::finish() {
  impl_->change([&] {
    impl_->need_file();  // before HDF5 mends what another has written over
    impl_->flush();
    impl_->need_file();
    const int complete = 1;  // SWMR forbids new attributes, not new values
    h5::Id attribute(h5::check(H5Aopen(impl_->file, "complete", H5P_DEFAULT)));
    h5::check(H5Awrite(attribute, H5T_NATIVE_INT, &complete));
    attribute.close();
    impl_->close();
  });
}

bool is_being_recorded(const std::filesystem::path& path) { return AliveMark::on(path); }

}  // namespace emtb
