#include "tools/batch/claims.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "hal/error.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;

const std::string draft_prefix = ".draft.";

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What makes a process number mean the same process: machine, its boot, and what the process sees as its machine.
std::string machine() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  std::error_code ignored;
  std::string boot = text_of("/proc/sys/kernel/random/boot_id");
  boot = boot.substr(0, boot.find('\n'));
  std::string where =
      std::string(name.data()) + "/" + boot + "/" + fs::read_symlink("/proc/self/ns/pid", ignored).string();
  for (char& c : where) c = c == ' ' ? '_' : c;
  return where;
}

/// When a process began, in the kernel's ticks: its number may be given anew. Empty: there is none.
std::string begin_of(const std::string& process) {
  const std::string stat = text_of("/proc/" + process + "/stat");
  const std::size_t name_ends = stat.rfind(')');
  if (name_ends == std::string::npos) return {};
  std::istringstream words(stat.substr(name_ends + 1));
  std::string word, state;
  for (int field = 3; field <= 22 && words >> word; ++field) {
    if (field == 3) state = word;
  }
  return state == "Z" || state == "X" ? "" : word;
}

/// Of a claim: machine, process, its begin, how often it was taken.
struct Written {
  std::string machine, process, begin;
  int times = 0;
};

Written parsed(const std::string& text) {
  Written w;
  std::istringstream(text) >> w.machine >> w.process >> w.begin >> w.times;
  return w;
}

}  // namespace

Claims::Claims(fs::path folder, double patience) : folder_(std::move(folder)), patience_(patience) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw Error(folder_.string() + ": cannot be made: " + error.message() + ". Give another --out FOLDER");
  const std::string process = std::to_string(getpid());
  me_ = machine() + " " + process + " " + begin_of(process);
  remove_old_drafts();
  keeper_ = std::jthread([this] { keep_up(); });
}

Claims::~Claims() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ends_.notify_all();
  keeper_.join();
  std::error_code ignored;
  for (const std::string& name : held_) fs::remove(folder_ / name, ignored);
}

/// Of processes that died as they were about to claim something.
void Claims::remove_old_drafts() const {
  std::error_code ignored;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, ignored)) {
    const bool draft = file.path().filename().string().starts_with(draft_prefix);
    if (draft && age_of(file.path()) > patience_) fs::remove(file.path(), ignored);
  }
}

bool Claims::make(const std::string& name, int times) {
  // Written beside it and linked: whoever sees it sees all of it.
  static std::atomic<unsigned> drafts{0};
  const fs::path draft =
      folder_ / (draft_prefix + std::to_string(getpid()) + "." +
                 std::to_string(std::hash<std::string>()(me_) % 1000000007) + "." + std::to_string(drafts++));
  {
    std::ofstream out(draft);
    out << me_ << " " << times << "\n";
    if (!out.flush())
      throw Error(draft.string() + ": cannot be written. Is the folder yours to write, the disk not full?");
  }
  const bool mine = link(draft.c_str(), (folder_ / name).c_str()) == 0;
  const int why = errno;
  unlink(draft.c_str());
  if (!mine && why != EEXIST) throw Error((folder_ / name).string() + ": cannot be made: " + std::strerror(why));
  if (mine) {
    const std::lock_guard lock(mutex_);
    held_.insert(name);
  }
  return mine;
}

int Claims::take(const std::string& name) {
  if (make(name, 1)) return 1;
  const fs::path claim = folder_ / name;
  const std::string text = text_of(claim);
  if (text.empty() || !is_left_behind(claim, text)) return 0;
  const int times = parsed(text).times + 1;
  const fs::path aside = folder_ / (".left." + name + "." + std::to_string(getpid()));
  if (rename(claim.c_str(), aside.c_str()) != 0) return 0;  // another was quicker
  unlink(aside.c_str());
  return make(name, times) ? times : 0;
}

void Claims::let_go(const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    held_.erase(name);
  }
  unlink((folder_ / name).c_str());
}

void Claims::clear(const std::string& name) {
  if (fs::exists(folder_ / name) && take(name) > 0) let_go(name);
}

bool Claims::is_left_behind(const fs::path& claim, const std::string& text) const {
  const Written w = parsed(text);
  const Written here = parsed(me_);
  if (w.machine == here.machine) return begin_of(w.process) != w.begin;
  return age_of(claim) > patience_;
}

/// [s] by the clock of the file system, which is one for all machines.
double Claims::age_of(const fs::path& claim) const {
  const fs::path clock = folder_ / (".clock." + std::to_string(getpid()));
  std::ofstream(clock) << "now\n";
  struct stat now {
  }, then{};
  const bool known = stat(clock.c_str(), &now) == 0 && stat(claim.c_str(), &then) == 0;
  unlink(clock.c_str());
  return known ? static_cast<double>(now.st_mtim.tv_sec - then.st_mtim.tv_sec) : 0;
}

void Claims::keep_up() {
  std::unique_lock lock(mutex_);
  const auto pause = std::chrono::duration<double>(patience_ / 6);
  while (!ends_.wait_for(lock, pause, [this] { return ending_; })) {
    for (const std::string& name : held_) utimensat(AT_FDCWD, (folder_ / name).c_str(), nullptr, 0);
  }
}

}  // namespace emtb
