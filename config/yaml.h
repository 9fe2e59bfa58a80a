#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace emtb {

/// No bound, for YamlMap::within().
inline constexpr double unbounded = std::numeric_limits<double>::infinity();

/// A map of a YAML file that knows where it stands, so that every complaint names file, line and key.
///
///     bench.yaml:14: reference.max is 8 V, but the driver takes at most 6 V. Write 6 or less.
///
/// Every reader lists the keys it knows with only(): a misspelt key is an error, not a default.
class YamlMap {
 public:
  /// @throws ConfigError where the file cannot be read, is not YAML, is not one map, or has a key twice.
  static YamlMap load(const std::filesystem::path& path);

  /// The same for a text in memory. @param name what messages call it
  static YamlMap parse(const std::string& text, const std::string& name);

  static constexpr std::size_t longest_file = 4 * 1024 * 1024;  ///< [byte]

  /// A regular file, whole. @throws ConfigError where it cannot be read.
  static std::string read_text(const std::filesystem::path& path);

  bool has(std::string_view key) const;

  /// @throws ConfigError naming the first key that is not among `known`.
  void only(std::initializer_list<std::string_view> known) const;

  double number(std::string_view key) const;  ///< finite; @throws ConfigError where absent or not a number
  double number_or(std::string_view key, double fallback) const;
  double positive(std::string_view key) const;  ///< > 0
  double within(std::string_view key, double min, double max) const;
  double within_or(std::string_view key, double min, double max, double fallback) const;
  std::string text(std::string_view key) const;
  std::string text_or(std::string_view key, std::string_view fallback) const;
  bool flag_or(std::string_view key, bool fallback) const;
  std::vector<double> numbers(std::string_view key) const;
  std::vector<std::string> texts(std::string_view key) const;

  YamlMap map(std::string_view key) const;  ///< a map below; @throws ConfigError where absent or not a map
  std::optional<YamlMap> map_if(std::string_view key) const;
  std::vector<YamlMap> maps(std::string_view key) const;  ///< a list of maps; absent: empty

  /// The entries of this map that are maps themselves, in the file's order.
  std::vector<std::pair<std::string, YamlMap>> entries() const;
  /// The keys of this map, in the file's order.
  std::vector<std::string> keys() const;

  /// Complains about a key (or, where empty, about this map): `FILE:LINE: PATH.KEY what`. Always throws ConfigError.
  [[noreturn]] void fail(std::string_view key, std::string_view what) const;

  const std::filesystem::path& file() const noexcept { return file_; }
  const YAML::Node& node() const noexcept { return node_; }

 private:
  YamlMap(const YAML::Node& node, std::filesystem::path file, std::string path);
  YAML::Node find(std::string_view key) const;
  std::string path_of(std::string_view key) const;
  [[noreturn]] void fail_at(const YAML::Mark& mark, std::string_view key, std::string_view what) const;
  YAML::Node need(std::string_view key) const;
  double number_of(const YAML::Node& node, std::string_view key) const;

  YAML::Node node_;
  std::filesystem::path file_;
  std::string path_;  ///< keys from the root, joined with dots
};

}  // namespace emtb
