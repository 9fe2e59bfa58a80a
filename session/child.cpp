#include "session/child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "session/h5.h"

namespace emtb {
namespace {

constexpr std::size_t block = 1 << 16;               // [byte]
constexpr int silence = 300'000;                     // [ms] of a child that says nothing and uses no processor either
constexpr std::uint64_t least_time = 5;              // [s] of processor time
constexpr std::uint64_t slowest = 10 * 1024 * 1024;  // [byte/s] of a compressed file
constexpr std::uint64_t least_memory = std::uint64_t{1} << 30;  // [byte]

enum Verdict : std::uint64_t { refused = 1, done = 2 };

/// In the child.
void become_quiet() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGINT, SIGTERM}) ::signal(signal, SIG_DFL);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);  // what a C library says of its own death
  if (nowhere >= 0) dup2(nowhere, STDERR_FILENO);
}

/// What the child hands over.
class Outlet {
 public:
  explicit Outlet(int pipe) : pipe_(pipe) {}
  void put(std::uint64_t number) { put(&number, sizeof number); }
  void put(double number) { put(&number, sizeof number); }
  void put(const std::string& text) {
    put(text.size());
    put(text.data(), text.size());
  }
  void put(const SharedColumn<double>& numbers) {
    put(numbers.size());
    put(numbers.data(), numbers.size() * sizeof(double));
  }
  void flush() {
    write_out(waiting_.data(), waiting_.size());
    waiting_.clear();
  }

 private:
  void put(const void* data, std::size_t size) {
    if (waiting_.size() + size > block) flush();
    if (size > block) return write_out(static_cast<const char*>(data), size);
    waiting_.append(static_cast<const char*>(data), size);
  }
  void write_out(const char* data, std::size_t size) const {
    while (size > 0) {
      const ssize_t n = write(pipe_, data, size);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) _exit(1);  // nobody reads any more
      data += n;
      size -= static_cast<std::size_t>(n);
    }
  }

  int pipe_;
  std::string waiting_;
};

/// The child died, or tells nonsense.
struct Broken {};

/// What the parent takes. As much as comes, not as much as is announced.
class Inlet {
 public:
  explicit Inlet(int pipe) : pipe_(pipe) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    get(&value, sizeof value);
    return value;
  }
  /// @throws Broken where it is more
  std::uint64_t number(std::uint64_t most) {
    const std::uint64_t value = number();
    if (value > most) throw Broken();
    return value;
  }
  double real() {
    double value = 0;
    get(&value, sizeof value);
    return value;
  }
  std::string text() { return many<std::string>(); }
  std::vector<double> numbers() { return many<std::vector<double>>(); }

 private:
  template <class Container>
  Container many() {
    Container out;
    std::uint64_t left = number();
    out.reserve(std::min<std::uint64_t>(left, std::uint64_t{1} << 20));
    while (left > 0) {
      const std::size_t count = std::min<std::uint64_t>(left, block);
      out.resize(out.size() + count);
      get(out.data() + out.size() - count, count * sizeof(typename Container::value_type));
      left -= count;
    }
    out.shrink_to_fit();
    return out;
  }
  void get(void* data, std::size_t size) {
    auto* to = static_cast<char*>(data);
    while (size > 0) {
      if (begin_ == end_) {
        end_ = more();
        begin_ = 0;
      }
      const std::size_t count = std::min(size, end_ - begin_);
      std::memcpy(to, buffer_.data() + begin_, count);
      begin_ += count;
      to += count;
      size -= count;
    }
  }
  std::size_t more() {
    pollfd readable{.fd = pipe_, .events = POLLIN, .revents = 0};
    int ready = 0;
    while ((ready = poll(&readable, 1, silence)) < 0 && errno == EINTR) {
    }
    if (ready <= 0) throw Broken();
    ssize_t n = 0;
    while ((n = ::read(pipe_, buffer_.data(), buffer_.size())) < 0 && errno == EINTR) {
    }
    if (n <= 0) throw Broken();
    return static_cast<std::size_t>(n);
  }

  int pipe_;
  std::vector<char> buffer_ = std::vector<char>(block);
  std::size_t begin_ = 0, end_ = 0;
};

/// @param times the place, from 1, of the times among those before it; 0: they come here
void put(Outlet& to, const Series& series, std::uint64_t times) {
  to.put(times);
  if (times == 0) to.put(series.t);
  to.put(series.value);
  to.put(series.window);
  to.put(series.lsb);
  to.put(series.source);
}

void put(Outlet& to, const Session& session) {
  to.put(session.runs.size());
  for (const Run& run : session.runs) {
    to.put(run.name);
    to.put(run.field_on);
    to.put(run.signals.size());
    std::vector<const double*> times;
    for (const auto& [signal, series] : run.signals) {
      to.put(std::uint64_t{index(signal)});
      const auto same = std::ranges::find(times, series.t.data());
      put(to, series, same != times.end() ? static_cast<std::uint64_t>(same - times.begin()) + 1 : 0);
      if (same == times.end()) times.push_back(series.t.data());
    }
  }
  to.put(session.events.size());
  for (const Event& event : session.events) {
    to.put(event.t);
    to.put(static_cast<double>(event.code));
    to.put(event.text);
  }
  to.put(session.attributes.size());
  for (const auto& [name, text] : session.attributes) {
    to.put(name);
    to.put(text);
  }
  to.put(session.config);
  to.put(std::uint64_t{session.complete});
}

/// @param times those that came so far
Series take_series(Inlet& from, std::vector<SharedColumn<double>>& times) {
  Series series;
  const std::uint64_t known = from.number(times.size());
  if (known == 0) times.emplace_back(from.numbers());
  series.t = known == 0 ? times.back() : times[known - 1];
  series.value = from.numbers();
  if (series.t.size() != series.value.size()) throw Broken();
  series.window = from.real();
  series.lsb = from.real();
  series.source = from.text();
  return series;
}

Session take_session(Inlet& from) {
  Session session;
  for (std::uint64_t runs = from.number(); runs > 0; --runs) {
    Run run{.name = from.text(), .signals = {}, .field_on = from.real()};
    std::vector<SharedColumn<double>> times;
    for (std::uint64_t signals = from.number(signal_count); signals > 0; --signals) {
      const auto signal = static_cast<Signal>(from.number(signal_count - 1));
      run.signals[signal] = take_series(from, times);
    }
    session.runs.push_back(std::move(run));
  }
  for (std::uint64_t events = from.number(); events > 0; --events) {
    Event event{.t = from.real(), .code = 0, .text = {}};
    const double code = from.real();
    if (!(std::abs(code) < 2e9)) throw Broken();
    event.code = static_cast<int>(code);
    event.text = from.text();
    session.events.push_back(std::move(event));
  }
  for (std::uint64_t attributes = from.number(); attributes > 0; --attributes) {
    std::string name = from.text();
    session.attributes[std::move(name)] = from.text();
  }
  session.config = from.text();
  session.complete = from.number(1) == 1;
  return session;
}

using Reader = std::function<Session(const std::filesystem::path&)>;

[[noreturn]] void be_the_child(int pipe, const std::filesystem::path& file, const Reader& read) {
  bound_this_process(file);
  become_quiet();
  try {
    Outlet outlet(pipe);
    try {
      const Session session = read(file);
      outlet.put(std::uint64_t{done});
      put(outlet, session);
    } catch (const SessionError& e) {  // before anything was put
      outlet.put(std::uint64_t{refused});
      outlet.put(std::string(e.what()));
    }
    outlet.flush();
    _exit(0);
  } catch (const std::bad_alloc&) {
    raise(SIGKILL);
  } catch (...) {
  }
  _exit(1);
}

struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw SessionError("no descriptor is left to read a session with");
  }
  ~Pipe() {
    close_write();
    close(ends[0]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_write() {
    if (ends[1] >= 0) close(std::exchange(ends[1], -1));
  }
  std::array<int, 2> ends{-1, -1};
};

int status_of(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

[[noreturn]] void tell_death(const std::filesystem::path& file, int status) {
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  const char* const why = signal == SIGXCPU ? "reading it does not end"
                          : signal == SIGKILL || signal == SIGABRT
                              ? "reading it takes more time or memory than a whole file would"
                              : "reading it fails";
  throw SessionError(file.string() + ": is damaged: " + why +
                     (signal != 0 ? std::string(" (SIG") + sigabbrev_np(signal) + ")" : "") +
                     ". Copy it again from where it was recorded");
}

}  // namespace

void bound_this_process(const std::filesystem::path& file) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{.rlim_cur = 0, .rlim_max = 0};
  setrlimit(RLIMIT_CORE, &no_core);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  const rlim_t seconds = least_time + (error ? 0 : size / slowest);
  const rlimit time{.rlim_cur = seconds, .rlim_max = seconds};
  setrlimit(RLIMIT_CPU, &time);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  std::uint64_t pages = 0;  // that the parent had mapped, and so has the child
  std::ifstream("/proc/self/statm") >> pages;
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const std::uint64_t half = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * page / 2;
  const rlim_t bytes = pages * page + std::max(least_memory, half);
  const rlimit memory{.rlim_cur = bytes, .rlim_max = bytes};
  setrlimit(RLIMIT_AS, &memory);
#endif
}

Session read_in_child(const std::filesystem::path& file, const Reader& read) {
  Pipe pipe;
  const pid_t child = h5::fork_between_calls();
  if (child < 0) throw SessionError(file.string() + ": no process is left to read it with");
  if (child == 0) be_the_child(pipe.ends[1], file, read);
  pipe.close_write();
  Inlet inlet(pipe.ends[0]);
  try {
    if (inlet.number() == refused) throw SessionError(inlet.text());
    Session session = take_session(inlet);
    status_of(child);
    return session;
  } catch (const Broken&) {
    kill(child, SIGKILL);  // where it only tells nonsense
    tell_death(file, status_of(child));
  } catch (...) {
    kill(child, SIGKILL);
    status_of(child);
    throw;
  }
}

}  // namespace emtb
