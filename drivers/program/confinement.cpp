#include "drivers/program/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>

namespace emtb::program {
namespace {

constexpr rlim_t most_memory = rlim_t{4} << 30;  // [bytes] of its address space
constexpr rlim_t most_files = 256;

#if defined(__x86_64__)
constexpr std::uint32_t architecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t architecture = AUDIT_ARCH_AARCH64;
#else
#error "which calls start a process here?"
#endif

// The words of the kernel's filter language.
constexpr sock_filter load(std::size_t offset) {
  return {BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)};
}
constexpr sock_filter answer(std::uint32_t what) { return {BPF_RET | BPF_K, 0, 0, what}; }
/// Goes on by so many words where the loaded number is, or is not, `value`.
constexpr sock_filter equal(std::uint32_t value, std::uint8_t yes, std::uint8_t no) {
  return {BPF_JMP | BPF_JEQ | BPF_K, yes, no, value};
}
constexpr sock_filter at_least(std::uint32_t value, std::uint8_t yes, std::uint8_t no) {
  return {BPF_JMP | BPF_JGE | BPF_K, yes, no, value};
}
constexpr sock_filter has_bit(std::uint32_t value, std::uint8_t yes, std::uint8_t no) {
  return {BPF_JMP | BPF_JSET | BPF_K, yes, no, value};
}

constexpr std::uint32_t refused = SECCOMP_RET_ERRNO | EPERM;
constexpr std::uint32_t absent = SECCOMP_RET_ERRNO | ENOSYS;

/// No process of its own, and no look into ours, which may be of the same user. clone3() hides its flags in memory: it
/// is absent, and the C library takes clone() instead, which may make threads.
const sock_filter filter[] = {
    load(offsetof(seccomp_data, arch)),
    equal(architecture, 1, 0),
    answer(SECCOMP_RET_KILL_PROCESS),
    load(offsetof(seccomp_data, nr)),
    at_least(0x40000000, 0, 1),  // the x32 calls of x86-64
    answer(refused),
#if defined(__NR_fork)
    equal(__NR_fork, 0, 1),
    answer(refused),
    equal(__NR_vfork, 0, 1),
    answer(refused),
#endif
    equal(__NR_ptrace, 0, 1),
    answer(refused),
    equal(__NR_process_vm_readv, 0, 1),
    answer(refused),
    equal(__NR_process_vm_writev, 0, 1),
    answer(refused),
    equal(__NR_pidfd_getfd, 0, 1),
    answer(refused),
    equal(__NR_clone3, 0, 1),
    answer(absent),
    equal(__NR_clone, 0, 3),
    load(offsetof(seccomp_data, args[0])),  // its lower half: both architectures keep it first
    has_bit(CLONE_THREAD, 1, 0),
    answer(refused),
    answer(SECCOMP_RET_ALLOW),
};

bool limit(__rlimit_resource resource, rlim_t most) noexcept {
  rlimit now{};
  if (prlimit(0, resource, nullptr, &now) != 0) return false;
  const rlim_t value = now.rlim_max < most ? now.rlim_max : most;
  const rlimit wanted{value, value};
  return prlimit(0, resource, &wanted, nullptr) == 0;
}

/// As any program of any user, whatever the daemon has taken for its loop.
bool schedule_as_usual() noexcept {
  const sched_param none{};
  if (sched_setscheduler(0, SCHED_OTHER, &none) != 0) return false;
  errno = 0;
  if (const int nice = getpriority(PRIO_PROCESS, 0); nice < 0) setpriority(PRIO_PROCESS, 0, 0);
  cpu_set_t all;
  __builtin_memset(&all, 0xFF, sizeof all);
  sched_setaffinity(0, sizeof all, &all);  // the kernel takes those that there are
  return limit(RLIMIT_RTPRIO, 0) && limit(RLIMIT_NICE, 0);
}

bool keep_few_resources() noexcept {
  if (!limit(RLIMIT_CORE, 0) || !limit(RLIMIT_NOFILE, most_files)) return false;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // a program under test may be built so as well
  if (!limit(RLIMIT_AS, most_memory)) return false;
#endif
  return limit(RLIMIT_MEMLOCK, 64 * 1024);
}

void take_signals_as_usual() noexcept {
  struct sigaction usual {};
  usual.sa_handler = SIG_DFL;
  struct sigaction ignored {};
  ignored.sa_handler = SIG_IGN;
  for (int number = 1; number < NSIG; ++number) sigaction(number, &usual, nullptr);
  // The unit's end is sent to all of its processes; a program that moves has to be told to be safe before it ends.
  for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT}) sigaction(number, &ignored, nullptr);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

/// The C library's own functions would have every thread of ours change as well.
bool drop_to(const Identity& identity) noexcept {
  return syscall(SYS_setgroups, identity.groups.size(), identity.groups.data()) == 0 &&
         syscall(SYS_setresgid, identity.group, identity.group, identity.group) == 0 &&
         syscall(SYS_setresuid, identity.user, identity.user, identity.user) == 0;
}

bool close_all_others() noexcept {
  if (close_range(3, ~0U, 0) == 0) return true;
  rlimit files{};
  if (prlimit(0, RLIMIT_NOFILE, nullptr, &files) != 0) return false;
  for (rlim_t file = 3; file < files.rlim_cur; ++file) close(static_cast<int>(file));
  return true;
}

bool fails(Confinement& confinement, const char* step) noexcept {
  confinement.error = errno;
  confinement.step = step;
  return false;
}

bool confine(Confinement& own) noexcept {
  setsid();
  take_signals_as_usual();
  for (int file = 0; file < 3; ++file) {
    if (dup2(own.ends[static_cast<std::size_t>(file)], file) < 0) return fails(own, "its pipes");
  }
  if (!close_all_others()) return fails(own, "closing our files");
  if (!schedule_as_usual()) return fails(own, "its priority");
  if (!keep_few_resources()) return fails(own, "its limits");
  prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  if (own.identity != nullptr && !drop_to(*own.identity)) return fails(own, "becoming its user");
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return fails(own, "no new privileges");
  if (chdir(own.folder) != 0) return fails(own, "the bench file's folder");
  // After the change of user, which would undo it.
  if (prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0) != 0) return fails(own, "its end with ours");
  if (getppid() != own.parent) return fails(own, "our own end");
  const sock_fprog program{sizeof filter / sizeof *filter, const_cast<sock_filter*>(filter)};
  if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) != 0) return fails(own, "its system calls");
  return true;
}

}  // namespace

void become(Confinement& own) noexcept {
  if (!confine(own)) return;
  execve(own.words[0], own.words, own.surroundings);
  fails(own, "its program");
}

}  // namespace emtb::program
