#include "tools/kept/kept_answers.h"

#include <link.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iostream>
#include <optional>
#include <streambuf>
#include <utility>

#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/processor.h"
#include "hal/regular_file.h"
#include "session/spec.h"
#include "tools/kept/answers.h"
#include "tools/kept/file_state.h"
#include "tools/user_folder.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;

/// What the linker calls this program, which another build of it is not called; empty where it did not.
std::string build_id() {
  std::string id;
  const auto look = [](dl_phdr_info* object, std::size_t, void* to) {
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const ElfW(Phdr)& part = object->dlpi_phdr[i];
      if (part.p_type != PT_NOTE) continue;
      const char* note = reinterpret_cast<const char*>(object->dlpi_addr + part.p_vaddr);
      const char* const end = note + part.p_memsz;
      while (note + sizeof(ElfW(Nhdr)) <= end) {
        ElfW(Nhdr) head;
        std::memcpy(&head, note, sizeof head);
        const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
        const char* name = note + sizeof head;
        const char* what = name + padded(head.n_namesz);
        if (head.n_type == NT_GNU_BUILD_ID && head.n_namesz == 4 && std::memcmp(name, "GNU", 4) == 0)
          static_cast<std::string*>(to)->assign(what, head.n_descsz);
        note = what + padded(head.n_descsz);
      }
    }
    return 1;  // the first object is the program itself
  };
  dl_iterate_phdr(look, &id);
  return id;
}

/// Writes down what goes through a stream, which loses nothing by it.
class Overhearing final : public std::streambuf {
 public:
  explicit Overhearing(std::ostream& stream) : stream_(stream), through_(stream.rdbuf(this)) {}
  ~Overhearing() override { stream_.rdbuf(through_); }
  Overhearing(const Overhearing&) = delete;
  Overhearing& operator=(const Overhearing&) = delete;

  const std::string& heard() const { return heard_; }

 private:
  int overflow(int c) override {
    if (c == traits_type::eof()) return traits_type::not_eof(c);
    heard_ += traits_type::to_char_type(c);
    return through_->sputc(traits_type::to_char_type(c));
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    heard_.append(text, static_cast<std::size_t>(count));
    return through_->sputn(text, count);
  }
  int sync() override { return through_->pubsync(); }

  std::ostream& stream_;
  std::streambuf* through_;
  std::string heard_;
};

/// The states of all files; none where one of them is no regular file.
std::optional<std::vector<FileState>> look_at_all(const std::vector<fs::path>& paths) {
  std::vector<FileState> states;
  for (const fs::path& path : paths) {
    const auto state = look_at(path);
    if (!state) return std::nullopt;
    states.push_back(*state);
  }
  return states;
}

std::string question_of(const std::vector<std::string>& words, const std::string& build,
                        const std::vector<fs::path>& writes) {
  const TerminalStyle style = style_of_stdout();
  std::string all = build;
  for (const std::string& word : words) all += '\0' + word;
  for (const fs::path& path : writes) all += '\0' + fs::absolute(path).string();
  for (const int number :
       {style.width, style.lines, style.colour ? 1 : 0, isatty(STDOUT_FILENO), processor() == Processor::avx2 ? 1 : 0})
    all += '\0' + std::to_string(number);
  return all;
}

/// The files that a command wrote; none where one of them cannot be read again: a pipe.
std::optional<std::vector<std::string>> read_all(const std::vector<fs::path>& paths) {
  std::vector<std::string> texts;
  try {
    for (const fs::path& path : paths) texts.push_back(read_regular_file(path, Answers::longest, "a file"));
  } catch (const Error&) {
    return std::nullopt;
  }
  return texts;
}

void give(const Answer& answer, const std::vector<fs::path>& writes) {
  for (std::size_t i = 0; i < writes.size(); ++i) {
    std::ofstream out(writes[i], std::ios::binary);
    out << answer.written[i];
    if (!out.flush()) throw Error(writes[i].string() + ": cannot be written");
  }
  if (isatty(STDERR_FILENO) == 1)
    std::cerr << "The answer of last time: no file has changed since. --no-cache works it out anew\n";
  std::cerr << answer.err;
  std::cout << answer.out << std::flush;  // its last lines are what was asked for
}

}  // namespace

KeptAnswers::KeptAnswers(std::vector<std::string> words) : words_(std::move(words)) {}

int KeptAnswers::answer(const Files& files, const std::function<int()>& work) const {
  const fs::path folder = user_folder("XDG_CACHE_HOME", ".cache");
  const std::string build = build_id();
  if (off || folder.empty() || build.empty()) return work();
  const auto before = look_at_all(files.reads);
  if (!before) return work();
  const std::string question = question_of(words_, build, files.writes);
  const Answers answers(folder / "answers");
  if (const auto known = answers.find(question, *before); known && known->written.size() == files.writes.size()) {
    give(*known, files.writes);
    return known->code;
  }
  Answer fresh;
  {
    const Overhearing out(std::cout), err(std::cerr);
    fresh.code = work();
    fresh.out = out.heard();
    fresh.err = err.heard();
  }
  std::cout << std::flush;
  auto written = read_all(files.writes);
  const auto after = look_at_all(files.reads);
  const bool has_changed = !after || !std::ranges::equal(*before, *after, seems_the_same);
  if (fresh.code > 1 || !written || has_changed) return fresh.code;
  fresh.written = std::move(*written);
  answers.keep(question, *before, fresh);
  return fresh.code;
}

std::vector<fs::path> files_read(const std::vector<std::string>& paths, const std::vector<std::string>& sessions,
                                 const std::vector<std::string>& held_out) {
  std::vector<fs::path> all(paths.begin(), paths.end());
  std::erase(all, fs::path());
  for (const auto* specs : {&sessions, &held_out}) {
    for (const std::string& spec : *specs) {
      try {
        all.push_back(parse_session_spec(spec).path);
      } catch (const Error&) {
        all.emplace_back(spec);  // another model; or the command will say what is wrong with it
      }
    }
  }
  return all;
}

std::vector<fs::path> files_written(const std::vector<std::string>& paths) {
  std::vector<fs::path> all(paths.begin(), paths.end());
  std::erase_if(all, [](const fs::path& path) { return path.empty() || path == "-"; });
  return all;
}

}  // namespace emtb
