#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace emtb {

/// The newest form of each kind of file that this emtb reads, and the form that it writes. A file says its own:
/// `format: emtb bench 1`, in a session the attribute `format` of the root. One that says nothing is older than these
/// words and is read as version 0. Whatever was written once is read for ever: tests/formats keeps files of each.
namespace newest_format {
inline constexpr int session = 1;
inline constexpr int model = 1;
inline constexpr int bench = 1;
inline constexpr int protocol = 1;  ///< of the daemon's socket; members are only added to one version
}  // namespace newest_format

/// `emtb KIND VERSION`
std::string format_words(std::string_view kind, int version);

/// The version in such words; nothing where they are others.
std::optional<int> format_version(std::string_view words, std::string_view kind);

/// For a message behind the name of what is too new: `made by a newer emtb ...`
std::string made_by_a_newer(std::string_view kind, int version, int newest);

}  // namespace emtb
