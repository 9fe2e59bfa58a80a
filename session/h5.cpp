#include "session/h5.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <mutex>

#include "hal/error.h"
#include "session/text.h"

namespace emtb::h5 {
namespace {

using std::filesystem::path;

/// The consistency flags of a version 3 superblock: what a writer sets while it has the file open.
enum : unsigned char { open_for_writing = 1, open_for_swmr_writing = 4 };

/// How often a SWMR reader looks again at what seems half written. HDF5 doubles its pause from 1 ns each time, up to
/// its default of 100 times: on a damaged file that never ends. This is about 5 ms.
constexpr unsigned read_attempts = 22;

unsigned char consistency_flags(const path& file) {
  std::array<char, 12> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  const bool has_flags = std::memcmp(head.data(), "\x89HDF\r\n\x1a\n", 8) == 0 && head[8] >= 3;
  return has_flags ? static_cast<unsigned char>(head[11]) : 0;
}

std::string trimmed(std::string text) {
  text.resize(std::min(text.find('\0'), text.size()));
  while (text.ends_with(' ')) text.pop_back();  // Fortran and MATLAB pad with spaces
  return text;
}

/// Reads `count` texts with `read(type, buffer)`, whether they are of fixed or of variable length.
template <class Read>
std::vector<std::string> read_texts(hid_t type, hid_t space, std::size_t count, Read read) {
  std::vector<std::string> out;
  if (check(H5Tis_variable_str(type)) > 0) {
    std::vector<char*> pointers(count, nullptr);
    check(read(type, pointers.data()));
    for (const char* p : pointers) out.emplace_back(p ? p : "");
    H5Dvlen_reclaim(type, space, H5P_DEFAULT, pointers.data());
  } else {
    const std::size_t size = H5Tget_size(type);
    std::string buffer(count * size, '\0');
    check(read(type, buffer.data()));
    for (std::size_t i = 0; i < count; ++i) out.push_back(trimmed(buffer.substr(i * size, size)));
  }
  return out;
}

std::optional<std::string> text_of(hid_t attribute) {
  const Id type(H5Aget_type(attribute));
  const Id space(H5Aget_space(attribute));
  if (H5Sget_simple_extent_npoints(space) != 1) return std::nullopt;
  if (H5Tget_class(type) == H5T_STRING) {
    return read_texts(type, space, 1, [&](hid_t memory, void* to) { return H5Aread(attribute, memory, to); }).front();
  }
  double value = 0;
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) {
    int whole = 0;  // an enumeration, as which h5py writes True
    if (H5Aread(attribute, H5T_NATIVE_INT, &whole) < 0) return std::nullopt;
    value = whole;
  }
  return shortest(value);
}

/// Selects rows of a column for reading. @return the space in memory
Id select(hid_t file_space, hsize_t first, hsize_t count) {
  // A vector in MATLAB has two dimensions, one of them 1.
  std::array<hsize_t, H5S_MAX_RANK> extent{};
  std::array<hsize_t, H5S_MAX_RANK> start{};
  std::array<hsize_t, H5S_MAX_RANK> block{};
  const int rank = H5Sget_simple_extent_dims(file_space, extent.data(), nullptr);
  for (int d = 0; d < rank; ++d) {
    const auto i = static_cast<std::size_t>(d);
    start[i] = extent[i] > 1 ? first : 0;
    block[i] = extent[i] > 1 ? count : 1;
  }
  if (rank > 0) check(H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr));
  return Id(check(H5Screate_simple(1, &count, nullptr)));
}

/// Held by the outermost Quiet of a thread. Not recursive: a child process gives back what its parent's thread held.
std::mutex within;
thread_local int depth = 0;  // of Quiets of this thread

}  // namespace

pid_t fork_between_calls() {
  const bool alone = depth > 0;
  if (!alone) within.lock();
  const pid_t child = fork();
  if (!alone) within.unlock();
  return child;
}

Quiet::~Quiet() {
  H5Eset_auto2(H5E_DEFAULT, print_, data_);
  if (--depth == 0) within.unlock();
}

Quiet::Quiet() {
  if (depth++ == 0) within.lock();
  // Left to itself HDF5 closes at exit what is still open: also the file of a failed recording, which must not be
  // touched any more (SessionWriter).
  [[maybe_unused]] static const herr_t stays_open_at_exit = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

std::string reason() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = error->desc;
        return 0;
      },
      &text);
  constexpr std::string_view quoted = "error message = '";
  if (const auto at = text.find(quoted); at != std::string::npos) {
    text = text.substr(at + quoted.size());
    text.resize(std::min(text.find('\''), text.size()));
  }
  std::ranges::replace(text, '\n', ' ');
  return text.empty() ? "" : " (" + text.substr(0, 160) + ")";
}

bool is_open_for_writing(const path& file) { return (consistency_flags(file) & open_for_writing) != 0; }

Opened open(const path& file) {
  const auto fail = [&](const std::string& what) { throw SessionError(file.string() + ": " + what); };
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) fail("no such file. Give the path of a session, .h5, .csv or .mat");
  if (!std::filesystem::is_regular_file(status)) fail("is not a file. Give the path of a session, .h5, .csv or .mat");
  if (!std::ifstream(file)) fail("cannot be read. Is it yours to read?");
  if (std::filesystem::file_size(file, error) == 0) fail("is empty. Copy it again from where it was recorded");

  const unsigned char flags = consistency_flags(file);
  if ((flags & open_for_writing) && !(flags & open_for_swmr_writing)) {
    fail("another program has it open for writing, or died while it did. Close it there, or copy it again");
  }
  Opened opened{.file = {}, .abrupt = (flags & open_for_swmr_writing) != 0};
  if (!opened.abrupt && H5Fis_hdf5(file.c_str()) <= 0) fail("is not HDF5, or only the beginning of it. Copy it again");
  const Id access(check(H5Pcreate(H5P_FILE_ACCESS)));
  if (opened.abrupt) H5Pset_metadata_read_attempts(access, read_attempts);
  opened.file = Id(H5Fopen(file.c_str(), opened.abrupt ? H5F_ACC_RDONLY | H5F_ACC_SWMR_READ : H5F_ACC_RDONLY, access));
  if (!opened.file) fail("is cut off or damaged" + reason() + ". Copy it again");
  return opened;
}

Id within_file(hid_t kind) {
  Id access(check(H5Pcreate(kind)));
  const auto refuse = [](const char*, const char*, const char*, const char*, unsigned*, hid_t, void*) -> herr_t {
    return -1;
  };
  check(H5Pset_elink_cb(access, refuse, nullptr));
  return access;
}

bool exists(hid_t at, const std::string& name) {
  const Id access = within_file(H5P_LINK_ACCESS);
  for (std::size_t end = name.find('/', 1); true; end = name.find('/', end + 1)) {
    if (H5Lexists(at, name.substr(0, end).c_str(), access) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

std::vector<std::pair<std::string, std::string>> attributes(hid_t object) {
  std::vector<std::pair<std::string, std::string>> out;
  H5O_info_t about{};
  check(H5Oget_info2(object, &about, H5O_INFO_NUM_ATTRS));
  for (hsize_t i = 0; i < about.num_attrs; ++i) {
    const Id id(H5Aopen_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, i, H5P_DEFAULT, H5P_DEFAULT));
    if (!id) continue;
    std::string name(static_cast<std::size_t>(std::max<ssize_t>(H5Aget_name(id, 0, nullptr), 0)), '\0');
    H5Aget_name(id, name.size() + 1, name.data());
    if (auto text = text_of(id)) out.emplace_back(std::move(name), *std::move(text));
  }
  return out;
}

std::optional<std::string> attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return std::nullopt;
  const Id id(H5Aopen(object, name, H5P_DEFAULT));
  return id ? text_of(id) : std::nullopt;
}

std::optional<double> number_attribute(hid_t object, const char* name) {
  const auto text = attribute(object, name);
  if (!text) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  return error == std::errc() && end == text->data() + text->size() ? std::optional(value) : std::nullopt;
}

Column column(hid_t at, const std::string& name) {
  if (!exists(at, name)) throw Failure(" (no such dataset)");
  Column out{.id = Id(check(H5Dopen2(at, name.c_str(), within_file(H5P_DATASET_ACCESS)))), .rows = 0};
  const Id properties(check(H5Dget_create_plist(out.id)));
  if (H5Pget_layout(properties) == H5D_VIRTUAL || H5Pget_external_count(properties) != 0) {
    throw Failure(" (its numbers are in another file, which is not followed)");
  }
  const Id space(check(H5Dget_space(out.id)));
  std::array<hsize_t, H5S_MAX_RANK> extent{};
  const int rank = check(H5Sget_simple_extent_dims(space, extent.data(), nullptr));
  out.rows = static_cast<hsize_t>(check(H5Sget_simple_extent_npoints(space)));
  const auto longest = rank == 0 ? out.rows : *std::max_element(extent.begin(), extent.begin() + rank);
  if (longest != out.rows && out.rows > 0) throw Failure(" (has several columns)");
  return out;
}

hsize_t rows_within(const Column& column, std::uintmax_t file_size) {
  const Id properties(check(H5Dget_create_plist(column.id)));
  hsize_t chunk = 0;
  if (H5Pget_layout(properties) != H5D_CHUNKED || H5Pget_chunk(properties, 1, &chunk) != 1 || chunk == 0)
    return column.rows;
  const auto within = [&](hsize_t row) {
    unsigned filters = 0;
    haddr_t address = HADDR_UNDEF;
    hsize_t size = 0;
    return H5Dget_chunk_info_by_coord(column.id, &row, &filters, &address, &size) >= 0 && address != HADDR_UNDEF &&
           address + size <= file_size;
  };
  hsize_t good = 0;
  hsize_t bad = (column.rows + chunk - 1) / chunk;
  while (good < bad) {
    const hsize_t middle = (good + bad) / 2;
    within(middle * chunk) ? good = middle + 1 : bad = middle;
  }
  return std::min(good * chunk, column.rows);
}

std::vector<double> numbers(const Column& column, hsize_t first, hsize_t count) {
  const Id type(check(H5Dget_type(column.id)));
  if (H5Tget_class(type) != H5T_FLOAT && H5Tget_class(type) != H5T_INTEGER) throw Failure(" (holds no numbers)");
  std::vector<double> out(count);
  if (count == 0) return out;
  const Id file_space(check(H5Dget_space(column.id)));
  const Id memory_space = select(file_space, first, count);
  check(H5Dread(column.id, H5T_NATIVE_DOUBLE, memory_space, file_space, H5P_DEFAULT, out.data()));
  return out;
}

std::vector<std::string> texts(const Column& column, hsize_t first, hsize_t count) {
  const Id type(check(H5Dget_type(column.id)));
  if (H5Tget_class(type) != H5T_STRING) throw Failure(" (holds no text)");
  if (count == 0) return {};
  const Id file_space(check(H5Dget_space(column.id)));
  const Id memory_space = select(file_space, first, count);
  return read_texts(type, memory_space, count, [&](hid_t memory, void* to) {
    return H5Dread(column.id, memory, memory_space, file_space, H5P_DEFAULT, to);
  });
}

}  // namespace emtb::h5
