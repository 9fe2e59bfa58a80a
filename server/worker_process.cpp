#include "server/worker_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <cstring>

#include "hal/error.h"

namespace emtb {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

std::string in_words(int status) {
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    return std::string("it was ended by signal ") + std::to_string(number) + " (" + strsignal(number) + ")";
  }
  return "it ended with code " + std::to_string(WEXITSTATUS(status));
}

/// In the child, between fork and exec: async-signal-safe calls alone.
[[noreturn]] void become(int socket, pid_t parent, char* const* argv) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  if (dup2(socket, WorkerProcess::channel) < 0) _exit(1);
  if (socket == WorkerProcess::channel) fcntl(socket, F_SETFD, 0);
  setpriority(PRIO_PROCESS, 0, WorkerProcess::niceness);
  const rlimit memory{WorkerProcess::most_memory, WorkerProcess::most_memory};
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadows take terabytes of addresses
  setrlimit(RLIMIT_AS, &memory);
#else
  static_cast<void>(memory);
#endif
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  signal(SIGINT, SIG_IGN);  // Ctrl-C is for the parent, which ends us
  execv("/proc/self/exe", argv);
  _exit(127);
}

}  // namespace

/// Its end of the socket. Outlives the object for as long as something is pending.
struct WorkerProcess::Wire : std::enable_shared_from_this<Wire> {
  Wire(asio::io_context& context, int descriptor) : socket(context) {
    socket.assign(asio::local::stream_protocol(), descriptor);
  }

  void read() {
    asio::async_read_until(socket, asio::dynamic_buffer(input, longest_line), '\n',
                           [self = shared_from_this()](const error_code& error, std::size_t size) {
                             if (self->owner == nullptr) return;
                             if (error) return self->owner->over();
                             std::string line = self->input.substr(0, size - 1);
                             self->input.erase(0, size);
                             self->owner->listeners_.line(std::move(line));
                             if (self->owner != nullptr) self->read();
                           });
  }

  void write() {
    asio::async_write(socket, asio::buffer(queue.front()),
                      [self = shared_from_this()](const error_code& error, std::size_t) {
                        self->queue.pop_front();
                        if (!error && !self->queue.empty()) self->write();  // an end is seen by reading
                      });
  }

  asio::local::stream_protocol::socket socket;
  WorkerProcess* owner = nullptr;
  std::string input;
  std::deque<std::string> queue;
};

WorkerProcess::WorkerProcess(asio::io_context& context, std::vector<std::string> argv, Listeners listeners)
    : context_(context), argv_(std::move(argv)), listeners_(std::move(listeners)) {}

WorkerProcess::~WorkerProcess() { stop(); }

void WorkerProcess::start() {
  if (running()) return;
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw Error(std::string("no process to compute with: ") + std::strerror(errno));
  }
  std::vector<std::string> words = argv_;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) become(ends[1], parent, argv.data());
  close(ends[1]);
  if (pid_ < 0) {
    close(ends[0]);
    pid_ = 0;
    throw Error(std::string("no process to compute with: ") + std::strerror(errno));
  }
  wire_ = std::make_shared<Wire>(context_, ends[0]);
  wire_->owner = this;
  wire_->read();
}

void WorkerProcess::send(std::string line) {
  start();
  wire_->queue.push_back(std::move(line) + "\n");
  if (wire_->queue.size() == 1) wire_->write();
}

void WorkerProcess::stop() {
  if (!running()) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
  wire_->owner = nullptr;
  error_code ignored;
  wire_->socket.close(ignored);
  wire_.reset();
}

void WorkerProcess::over() {
  kill(pid_, SIGKILL);  // its socket is closed: it is of no use, whatever it does
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = 0;
  const auto wire = std::move(wire_);
  wire->owner = nullptr;
  error_code ignored;
  wire->socket.close(ignored);
  listeners_.ended(in_words(status));
}

}  // namespace emtb
