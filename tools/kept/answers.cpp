#include "tools/kept/answers.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "hal/regular_file.h"
#include "report/sha256.h"
#include "session/replace.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;

/// Is it a folder that only this user can have written to?
bool is_own_folder(const fs::path& folder) {
  struct stat status {};
  return ::lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
         (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

/// The SHA-256 of what follows; a line of JSON that says what follows; and that.
std::string packed(std::span<const FileState> files, const Answer& answer) {
  std::string texts = answer.out + answer.err;
  for (const std::string& text : answer.written) texts += text;
  json head{{"code", answer.code},
            {"out", answer.out.size()},
            {"err", answer.err.size()},
            {"written", json::array()},
            {"files", json::array()}};
  for (const std::string& text : answer.written) head["written"].push_back(text.size());
  for (const FileState& f : files) {
    head["files"].push_back({{"path", f.path},
                             {"bytes", f.bytes},
                             {"inode", f.inode},
                             {"written", f.written},
                             {"changed", f.changed},
                             {"settled", f.settled},
                             {"sha256", sha256(f.path)}});
  }
  const std::string rest = head.dump(-1, ' ', true, json::error_handler_t::replace) + "\n" + texts;
  return sha256_of(rest) + "\n" + rest;
}

bool same_bytes(const json& kept, const FileState& now) {
  const FileState before{.path = kept.at("path"),
                         .bytes = kept.at("bytes"),
                         .inode = kept.at("inode"),
                         .written = kept.at("written"),
                         .changed = kept.at("changed"),
                         .settled = kept.at("settled")};
  if (is_untouched(before, now)) return true;
  return before.path == now.path && before.bytes == now.bytes && kept.at("sha256") == sha256(now.path);
}

/// What was packed, where it stands for these files. @throws std::exception where it is nothing of the kind
std::optional<Answer> unpacked(const std::string& text, std::span<const FileState> files) {
  const auto line_of = [](std::string_view& of) {
    const std::string_view line = of.substr(0, of.find('\n'));
    of.remove_prefix(std::min(of.size(), line.size() + 1));
    return line;
  };
  std::string_view rest = text;
  const std::string_view sum = line_of(rest);
  if (sum != sha256_of(rest)) return std::nullopt;
  const json head = json::parse(line_of(rest));
  const auto next = [&](const json& size) {
    const std::string part(rest.substr(0, size.get<std::size_t>()));
    rest.remove_prefix(part.size());
    return part;
  };
  Answer answer{.code = head.at("code"), .out = next(head.at("out")), .err = next(head.at("err")), .written = {}};
  for (const json& size : head.at("written")) answer.written.push_back(next(size));
  const json& kept = head.at("files");
  if (kept.size() != files.size()) return std::nullopt;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!same_bytes(kept[i], files[i])) return std::nullopt;
  }
  return answer;
}

}  // namespace

Answers::Answers(fs::path folder, std::uint64_t most) : folder_(std::move(folder)), most_(most) {}

fs::path Answers::place_of(const std::string& question, std::span<const FileState> files) const {
  std::string all = question;
  for (const FileState& f : files) all += '\0' + f.path;
  return folder_ / sha256_of(all);
}

std::optional<Answer> Answers::find(const std::string& question, std::span<const FileState> files) const {
  try {
    if (!is_own_folder(folder_)) return std::nullopt;
    const fs::path place = place_of(question, files);
    if (!fs::exists(place)) return std::nullopt;
    std::optional<Answer> answer = unpacked(read_regular_file(place, longest, "an answer"), files);
    if (answer) fs::last_write_time(place, fs::file_time_type::clock::now());
    return answer;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void Answers::keep(const std::string& question, std::span<const FileState> files, const Answer& answer) const {
  try {
    const std::string text = packed(files, answer);
    if (text.size() > longest) return;
    fs::create_directories(folder_);
    if (!is_own_folder(folder_)) return;
    fs::permissions(folder_, fs::perms::owner_all);
    make_room(text.size());
    replace_file(place_of(question, files), [&](const fs::path& draft) {
      std::ofstream(draft, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
    });
  } catch (const std::exception&) {  // the answer has been given; next time it is worked out again
  }
}

/// Those found longest ago go, until so many bytes more are within the bound.
void Answers::make_room(std::uint64_t bytes) const {
  struct Kept {
    fs::file_time_type found;
    std::uint64_t bytes;
    fs::path path;
  };
  std::vector<Kept> all;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    std::error_code gone;  // another process makes room, too
    const auto found = entry.last_write_time(gone);
    const std::uint64_t size = entry.file_size(gone);
    if (!gone) all.push_back({found, size, entry.path()});
    if (!gone) bytes += size;
  }
  std::ranges::sort(all, {}, &Kept::found);
  for (const Kept& kept : all) {
    if (bytes <= most_) return;
    std::error_code gone;
    fs::remove(kept.path, gone);
    bytes -= kept.bytes;
  }
}

}  // namespace emtb
