#pragma once

// What the session room needs of HDF5's C API, with handles that close themselves and failures that throw. Private to
// session/.

#include <hdf5.h>
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace emtb::h5 {

/// Any HDF5 identifier, closed with its owner.
class Id {
 public:
  Id() = default;
  explicit Id(hid_t id) noexcept : id_(id) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
  Id& operator=(Id&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Id() { close(); }

  void close() noexcept {
    if (id_ >= 0) H5Idec_ref(id_);
    id_ = H5I_INVALID_HID;
  }
  hid_t release() noexcept { return std::exchange(id_, H5I_INVALID_HID); }
  explicit operator bool() const noexcept { return id_ >= 0; }
  operator hid_t() const noexcept { return id_; }

 private:
  hid_t id_ = H5I_INVALID_HID;
};

/// Keeps HDF5 from printing its error stack while it lives, and other threads out of HDF5. The setting is each thread's
/// own, so every entry point makes one.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// fork(), while no thread is within HDF5: the child could never enter it otherwise. @return as fork() does
pid_t fork_between_calls();

/// An HDF5 call failed; what() is HDF5's innermost reason in brackets, ` (No space left on device)`, to be put behind
/// file and object.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What HDF5 says of the call that just failed. Any other call, even closing a handle, wipes it out: see check().
std::string reason();

/// Passes on what a call returned. @throws Failure where that is negative
template <class Result>
Result check(Result result) {
  if (result < 0) throw Failure(reason());
  return result;
}

struct Opened {
  Id file;
  bool abrupt = false;  ///< its writer died, or still writes: read in SWMR mode, up to the last flush
};

/// Opens a session for reading, whether its writer has closed it or not. What is not in this file (external links,
/// external data, virtual datasets) is not followed. @throws SessionError
Opened open(const std::filesystem::path& path);

/// Whether the file says so, without HDF5. Where nothing writes it, its writer died.
bool is_open_for_writing(const std::filesystem::path& file);

bool exists(hid_t at, const std::string& path);

/// How objects are opened: no link is followed out of the file. @param kind H5P_GROUP_ACCESS, say
Id within_file(hid_t kind);

/// The attributes of an object that hold one text; numbers are told as text.
std::vector<std::pair<std::string, std::string>> attributes(hid_t object);
std::optional<std::string> attribute(hid_t object, const char* name);
std::optional<double> number_attribute(hid_t object, const char* name);

/// A dataset of one column.
struct Column {
  Id id;
  hsize_t rows = 0;
};

/// @throws Failure where there is no such dataset or it is not one column
Column column(hid_t at, const std::string& path);

/// How many of the column's rows lie within a file of that size. HDF5 reads zeros from beyond its end, which for a SWMR
/// reader is no error: in a file that was cut off they would pass for readings. Chunks lie in the order of time, so a
/// search by halves finds the end.
hsize_t rows_within(const Column& column, std::uintmax_t file_size);

/// @throws Failure where they cannot be read or are of another kind
std::vector<double> numbers(const Column& column, hsize_t first, hsize_t count);
std::vector<std::string> texts(const Column& column, hsize_t first, hsize_t count);

}  // namespace emtb::h5
