// Loaded before the C library: makes one call of emtbd fail, at one call site, for its n-th time.
//
//     EMTB_CALLS=FILE                        at the end of the process the sites and how often each was passed
//     EMTB_FAIL=CALL:CALLER:WITHIN:N[+]      which one fails; with + all from there on; EMTB_FAILED=FILE is made when
//     it does
//
// A site is the instruction that calls, and where in emtbd that came from: a library's allocation counts once for each
// place of emtbd that has the library make it. Addresses are those of a process without address randomisation.
// fault_injection.cpp drives this.

#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <stdarg.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

enum Call : std::uint8_t {
  c_malloc,
  c_calloc,
  c_realloc,
  c_new,
  c_aligned,
  c_open,
  c_write,
  c_pwrite,
  c_writev,
  c_sync,
  c_truncate,
  c_rename,
  c_accept,
  c_send,
  c_pipe,
  c_count
};
constexpr std::array<const char*, c_count> names{"malloc",   "calloc", "realloc", "new",    "aligned",
                                                 "open",     "write",  "pwrite",  "writev", "sync",
                                                 "truncate", "rename", "accept",  "send",   "pipe"};
constexpr std::array<int, c_count> errors{ENOMEM, ENOMEM, ENOMEM, ENOMEM, ENOMEM, EMFILE,  ENOSPC, ENOSPC,
                                          ENOSPC, EIO,    ENOSPC, EIO,    EMFILE, ENOBUFS, EMFILE};

struct Site {
  std::atomic<std::uintptr_t> caller{0};  // 0: free
  std::uintptr_t within = 0;
  std::uint8_t call = 0;
  std::atomic<bool> whole{false};
  std::atomic<std::uint64_t> times{0};
};
constexpr std::size_t most_sites = 1 << 15;
std::array<Site, most_sites> sites;

enum Mode : int { off, counting, failing };
std::atomic<int> mode{off};
const char* calls_file = nullptr;
const char* failed_file = nullptr;
Site wanted;
std::uint64_t wanted_time = 0;
bool from_there_on = false;
std::uintptr_t program_begin = 0, program_end = 0;
pid_t our_process = 0;

__thread int inside __attribute__((tls_model("initial-exec"))) = 0;

/// The innermost place of emtbd that this came from; 0: none, as in a thread of a library's own.
std::uintptr_t within_program(std::uintptr_t caller) {
  const auto ours = [](std::uintptr_t at) { return at >= program_begin && at < program_end; };
  if (ours(caller)) return caller;
  std::array<void*, 48> frames{};
  const int count = backtrace(frames.data(), frames.size());
  for (int i = 0; i < count; ++i) {
    const auto at = reinterpret_cast<std::uintptr_t>(frames[static_cast<std::size_t>(i)]);
    if (ours(at)) return at;
  }
  return 0;
}

Site* site_of(Call call, std::uintptr_t caller, std::uintptr_t within) {
  std::size_t at = (caller * 31 + within * 7 + call) % most_sites;
  for (std::size_t tries = 0; tries < most_sites; ++tries, at = (at + 1) % most_sites) {
    Site& site = sites[at];
    std::uintptr_t free = 0;
    if (site.caller.compare_exchange_strong(free, caller)) {
      site.within = within;
      site.call = call;
      site.whole = true;
      return &site;
    }
    while (!site.whole) {
    }
    if (site.caller == caller && site.within == within && site.call == call) return &site;
  }
  return nullptr;
}

void mark() {
  if (failed_file == nullptr) return;
  const long file = syscall(SYS_openat, AT_FDCWD, failed_file, O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  if (file >= 0) syscall(SYS_close, file);
}

/// Whether this call is the one that fails. errno is set then.
bool fails(Call call, const void* return_address) {
  const int now = mode.load(std::memory_order_relaxed);
  if (now == off || inside > 0 || getpid() != our_process) return false;
  const auto caller = reinterpret_cast<std::uintptr_t>(return_address);
  if (now == failing && (call != wanted.call || caller != wanted.caller)) return false;
  ++inside;
  const int before = errno;
  const std::uintptr_t within = within_program(caller);
  bool fail = false;
  if (now == counting) {
    if (Site* site = within != 0 ? site_of(call, caller, within) : nullptr) ++site->times;
  } else if (within == wanted.within) {
    const std::uint64_t time = ++wanted.times;
    fail = time == wanted_time || (from_there_on && time > wanted_time);
    if (time == wanted_time) mark();
  }
  errno = fail ? errors[call] : before;
  --inside;
  return fail;
}

int find_program(dl_phdr_info* info, std::size_t, void*) {
  for (int i = 0; i < info->dlpi_phnum; ++i) {  // the first object is the program itself
    const auto& header = info->dlpi_phdr[i];
    if (header.p_type != PT_LOAD || (header.p_flags & PF_X) == 0) continue;
    program_begin = info->dlpi_addr + header.p_vaddr;
    program_end = program_begin + header.p_memsz;
  }
  return 1;
}

__attribute__((constructor)) void begin() {
  ++inside;
  if (std::strcmp(program_invocation_short_name, "emtbd") == 0) {
    std::array<void*, 4> warm{};
    backtrace(warm.data(), warm.size());  // loads the unwinder
    dl_iterate_phdr(find_program, nullptr);
    our_process = getpid();
    calls_file = getenv("EMTB_CALLS");
    failed_file = getenv("EMTB_FAILED");
    if (calls_file != nullptr) mode = counting;
    if (const char* text = getenv("EMTB_FAIL")) {
      std::array<char, 16> call{}, plus{};
      unsigned long caller = 0, within = 0, time = 0;
      if (std::sscanf(text, "%15[a-z]:%lx:%lx:%lu%1[+]", call.data(), &caller, &within, &time, plus.data()) >= 4) {
        for (std::uint8_t c = 0; c < c_count; ++c) {
          if (std::strcmp(names[c], call.data()) == 0) wanted.call = c;
        }
        wanted.caller = caller;
        wanted.within = within;
        wanted_time = time;
        from_there_on = plus[0] == '+';
        mode = failing;
      }
    }
    unsetenv("LD_PRELOAD");  // of those whom emtbd starts
  }
  --inside;
}

__attribute__((destructor)) void end() {
  if (mode != counting || getpid() != our_process) return;
  mode = off;
  std::FILE* out = std::fopen(calls_file, "w");
  if (out == nullptr) return;
  for (const Site& site : sites) {
    if (site.caller == 0) continue;
    std::fprintf(out, "%s %lx %lx %lu\n", names[site.call], static_cast<unsigned long>(site.caller),
                 static_cast<unsigned long>(site.within), static_cast<unsigned long>(site.times));
  }
  std::fclose(out);
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

void* allocated(std::size_t size, const void* caller) {
  void* memory = fails(c_new, caller) ? nullptr : __libc_malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

#define CALLER __builtin_return_address(0)

void* operator new(std::size_t size) { return allocated(size, CALLER); }
void* operator new[](std::size_t size) { return allocated(size, CALLER); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return fails(c_new, CALLER) ? nullptr : __libc_malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

extern "C" {

void* malloc(std::size_t size) { return fails(c_malloc, CALLER) ? nullptr : __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) {
  return fails(c_calloc, CALLER) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  return fails(c_realloc, CALLER) ? nullptr : __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails(c_aligned, CALLER) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = fails(c_aligned, CALLER) ? nullptr : __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const auto bits = static_cast<mode_t>((flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(list, int) : 0);
  va_end(list);
  return fails(c_open, CALLER) ? -1 : static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, bits));
}
int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const auto bits = static_cast<mode_t>((flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(list, int) : 0);
  va_end(list);
  return fails(c_open, CALLER) ? -1 : static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, bits));
}
ssize_t write(int file, const void* data, std::size_t size) {
  return fails(c_write, CALLER) ? -1 : syscall(SYS_write, file, data, size);
}
ssize_t pwrite(int file, const void* data, std::size_t size, off_t at) {
  return fails(c_pwrite, CALLER) ? -1 : syscall(SYS_pwrite64, file, data, size, at);
}
ssize_t pwrite64(int file, const void* data, std::size_t size, off64_t at) {
  return fails(c_pwrite, CALLER) ? -1 : syscall(SYS_pwrite64, file, data, size, at);
}
ssize_t writev(int file, const iovec* pieces, int count) {
  return fails(c_writev, CALLER) ? -1 : syscall(SYS_writev, file, pieces, count);
}
int fsync(int file) { return fails(c_sync, CALLER) ? -1 : static_cast<int>(syscall(SYS_fsync, file)); }
int fdatasync(int file) { return fails(c_sync, CALLER) ? -1 : static_cast<int>(syscall(SYS_fdatasync, file)); }
int ftruncate(int file, off_t size) noexcept {
  return fails(c_truncate, CALLER) ? -1 : static_cast<int>(syscall(SYS_ftruncate, file, size));
}
int ftruncate64(int file, off64_t size) noexcept {
  return fails(c_truncate, CALLER) ? -1 : static_cast<int>(syscall(SYS_ftruncate, file, size));
}
int rename(const char* from, const char* to) noexcept {
  return fails(c_rename, CALLER) ? -1 : static_cast<int>(syscall(SYS_rename, from, to));
}
int accept(int file, sockaddr* address, socklen_t* size) {
  return fails(c_accept, CALLER) ? -1 : static_cast<int>(syscall(SYS_accept4, file, address, size, 0));
}
int accept4(int file, sockaddr* address, socklen_t* size, int flags) {
  return fails(c_accept, CALLER) ? -1 : static_cast<int>(syscall(SYS_accept4, file, address, size, flags));
}
ssize_t send(int file, const void* data, std::size_t size, int flags) {
  return fails(c_send, CALLER) ? -1 : syscall(SYS_sendto, file, data, size, flags, nullptr, 0);
}
ssize_t sendmsg(int file, const msghdr* message, int flags) {
  return fails(c_send, CALLER) ? -1 : syscall(SYS_sendmsg, file, message, flags);
}
int pipe2(int* ends, int flags) noexcept {
  return fails(c_pipe, CALLER) ? -1 : static_cast<int>(syscall(SYS_pipe2, ends, flags));
}

}  // extern "C"
