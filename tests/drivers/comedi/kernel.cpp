// What the kernel's comedi does with a card, for a program that this library is loaded into: open() of a file that is a
// Card, and ioctl(), read() and close() of what it gave, answer as the driver of an NI PCI-6024E would. Everything else
// goes to the C library. libcomedi above it is the real one.
//
// After comedi's own description of its system calls (linux/comedi.h) and of commands (Comedi documentation, 4.5): a
// driver adjusts a command step by step, a subdevice whose scan runs is busy, a buffer that is full ends the scan, and
// read() gives what is left and then EPIPE.

#include <comedi.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/drivers/comedi/card.h"

namespace emtb::comedi {
namespace {

constexpr unsigned ai = 0;  // subdevices
constexpr unsigned ao = 1;
constexpr unsigned subdevices = 2;
constexpr unsigned step = 50;            // [ns] of its clock
constexpr unsigned slow_step = 1000000;  // [ns]
constexpr unsigned fastest = 5000;       // [ns] of a conversion
constexpr auto interrupts = std::chrono::microseconds(500);

constexpr std::array<comedi_krange, 4> input_ranges{{{-10000000, 10000000, UNIT_volt},
                                                     {-5000000, 5000000, UNIT_volt},
                                                     {-500000, 500000, UNIT_volt},
                                                     {-50000, 50000, UNIT_volt}}};
constexpr std::array<comedi_krange, 1> output_ranges{{{-10000000, 10000000, UNIT_volt}}};

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
int real_open(const char* path, int flags, mode_t mode) {
  static const auto call = next<int(const char*, int, ...)>("open");
  return call(path, flags, mode);
}
int real_close(int file) {
  static const auto call = next<int(int)>("close");
  return call(file);
}
ssize_t real_read(int file, void* into, size_t bytes) {
  static const auto call = next<ssize_t(int, void*, size_t)>("read");
  return call(file, into, bytes);
}
int real_ioctl(int file, unsigned long request, void* argument) {
  static const auto call = next<int(int, unsigned long, ...)>("ioctl");
  return call(file, request, argument);
}

int refused(int error) {
  errno = error;
  return -1;
}

/// One open file.
struct File {
  std::atomic<int> number = -1;  ///< -1: free
  Card* card = nullptr;
  std::thread scan;
  std::atomic<bool> stop = false;
  std::atomic<int> error = 0;  ///< what read() says once it has given everything
};

std::array<File, 16> files;
std::mutex opening;

File* file_of(int number) {
  if (number < 0) return nullptr;
  const auto found = std::ranges::find_if(files, [&](const File& file) { return file.number == number; });
  return found == files.end() ? nullptr : &*found;
}

/// The card whose file this is, or nothing.
Card* map_card(int number) {
  struct stat about {};
  if (fstat(number, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size != sizeof(Card)) return nullptr;
  void* memory = mmap(nullptr, sizeof(Card), PROT_READ | PROT_WRITE, MAP_SHARED, number, 0);
  if (memory == MAP_FAILED) return nullptr;
  auto* card = static_cast<Card*>(memory);
  if (card->magic == Card::is_one) return card;
  munmap(memory, sizeof(Card));
  return nullptr;
}

std::uint32_t convert(const Card& card, unsigned packed) {
  const unsigned channel = CR_CHAN(packed);
  double volts = card.inputs[channel];
  if (CR_AREF(packed) == AREF_DIFF)
    volts -= card.inputs[(channel + 8) % card.inputs.size()];     // 9 has no pair: nonsense
  const double full = input_ranges[CR_RANGE(packed)].max * 1e-6;  // [V]
  const double code = (volts / full + 1) / 2 * Card::top;
  return static_cast<std::uint32_t>(std::lround(std::clamp(code, 0.0, static_cast<double>(Card::top))));
}

// ---- A scan

bool alive(pid_t program) { return program != 0 && (kill(program, 0) == 0 || errno != ESRCH); }

/// Of another file, or another program.
bool busy_elsewhere(const File& file) { return !file.scan.joinable() && alive(file.card->scanning); }

void end_scan(File& file) {
  file.stop = true;
  if (!file.scan.joinable()) return;
  file.scan.join();
  file.card->scanning = 0;
}

/// The driver's interrupts: puts what the card's clock has made since the last into the buffer, a pipe.
void scan(File& file, int buffer, std::vector<unsigned> list, unsigned nanoseconds) {
  using Clock = std::chrono::steady_clock;
  Card& card = *file.card;
  const auto began = Clock::now();
  const std::uint32_t ends = card.ends;
  std::vector<std::uint8_t> bytes;
  std::uint64_t scans = 0;
  while (!file.stop) {
    std::this_thread::sleep_for(interrupts + std::chrono::milliseconds(card.away.exchange(0)));
    if (!card.present || card.ends != ends) {
      file.error = card.present ? 0 : ENODEV;
      break;
    }
    bytes.clear();
    for (; began + std::chrono::nanoseconds(nanoseconds) * scans <= Clock::now(); ++scans) {
      for (const unsigned entry : list) {
        const std::uint32_t code = convert(card, entry);
        for (unsigned k = 0; k < (card.wide ? 4U : 2U); ++k) bytes.push_back(static_cast<std::uint8_t>(code >> 8 * k));
      }
      if (bytes.size() > card.buffer) break;
    }
    if (card.silent) continue;
    const std::size_t fits = std::min<std::size_t>(bytes.size(), card.buffer);  // whoever reads meanwhile
    std::size_t at = 0;
    while (at < fits) {
      const ssize_t put = write(buffer, bytes.data() + at, fits - at);
      if (put <= 0) break;
      at += static_cast<std::size_t>(put);
    }
    if (at < bytes.size()) {
      file.error = EPIPE;
      break;
    }
  }
  real_close(buffer);
}

/// The first step in which something is wrong with a command, and is put right; 0: none.
int check(const Card& card, comedi_cmd& cmd) {
  const auto masked = [](unsigned& source, unsigned able) {
    const unsigned before = source;
    source &= able;
    return source == 0 || source != before;
  };
  bool wrong = masked(cmd.start_src, TRIG_NOW | TRIG_INT | TRIG_EXT);
  wrong |= masked(cmd.scan_begin_src, TRIG_TIMER | TRIG_EXT);
  wrong |= masked(cmd.convert_src, TRIG_TIMER | TRIG_EXT);
  wrong |= masked(cmd.scan_end_src, TRIG_COUNT);
  wrong |= masked(cmd.stop_src, TRIG_COUNT | TRIG_NONE);
  if (wrong) return 1;
  for (const unsigned source : {cmd.start_src, cmd.scan_begin_src, cmd.convert_src, cmd.stop_src}) {
    if ((source & (source - 1)) != 0) return 2;
  }
  const auto bounded = [&wrong](unsigned& argument, unsigned least, unsigned most) {
    const unsigned within = std::clamp(argument, least, most);
    wrong |= within != argument;
    argument = within;
  };
  constexpr unsigned longest = 0xFFFFFF * step;
  if (cmd.start_src == TRIG_NOW) bounded(cmd.start_arg, 0, 0);
  if (cmd.convert_src == TRIG_TIMER) bounded(cmd.convert_arg, fastest, longest);
  if (cmd.scan_begin_src == TRIG_TIMER) bounded(cmd.scan_begin_arg, fastest, longest);
  bounded(cmd.scan_end_arg, cmd.chanlist_len, cmd.chanlist_len);
  if (cmd.stop_src == TRIG_NONE) bounded(cmd.stop_arg, 0, 0);
  if (wrong) return 3;
  const auto rounded = [&wrong](unsigned& argument, unsigned to) {
    const unsigned whole = (argument + to - 1) / to * to;
    wrong |= whole != argument;
    argument = whole;
  };
  if (cmd.convert_src == TRIG_TIMER) rounded(cmd.convert_arg, step);
  if (cmd.scan_begin_src == TRIG_TIMER) {
    rounded(cmd.scan_begin_arg, card.rounds_up ? slow_step : step);
    if (cmd.convert_src == TRIG_TIMER) bounded(cmd.scan_begin_arg, cmd.convert_arg * cmd.scan_end_arg, longest);
  }
  if (wrong) return 4;
  if (cmd.chanlist == nullptr) return 0;
  for (const unsigned entry : std::span(cmd.chanlist, cmd.chanlist_len)) {
    const unsigned channels = CR_AREF(entry) == AREF_DIFF ? 8 : 16;
    if (CR_CHAN(entry) >= channels || CR_RANGE(entry) >= input_ranges.size()) return 5;
  }
  return 0;
}

int begin(File& file, comedi_cmd& cmd) {
  if (cmd.subdev != ai || !file.card->scans) return refused(EIO);
  if (file.scan.joinable() || busy_elsewhere(file)) return refused(EBUSY);
  if (check(*file.card, cmd) != 0) return refused(EAGAIN);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return -1;
  fcntl(ends[1], F_SETFL, O_NONBLOCK);
  fcntl(ends[1], F_SETPIPE_SZ, static_cast<int>(file.card->buffer));
  dup3(ends[0], file.number, O_CLOEXEC);  // poll() and read() are the kernel's own from now on
  real_close(ends[0]);
  file.stop = false;
  file.error = 0;
  file.card->scanning = getpid();
  file.card->scan_period = cmd.scan_begin_arg;
  const std::vector<unsigned> list(cmd.chanlist, cmd.chanlist + cmd.chanlist_len);
  for (std::size_t k = 0; k < list.size() && k < file.card->list.size(); ++k) file.card->list[k] = list[k];
  ++file.card->commands;
  file.scan = std::thread(scan, std::ref(file), ends[1], list, cmd.scan_begin_arg);
  return 0;
}

// ---- The rest of what the driver is asked

int describe(const Card& card, comedi_devinfo& info) {
  info = {};
  info.version_code = 0x00084C;
  info.n_subdevs = subdevices;
  std::strcpy(info.driver_name, "ni_pcimio");
  std::memcpy(info.board_name, card.board.data(), sizeof info.board_name);
  info.read_subdevice = card.scans ? static_cast<int>(ai) : -1;
  info.write_subdevice = -1;
  return 0;
}

int describe(const Card& card, comedi_subdinfo* info) {
  info[ai] = {};
  info[ai].type = COMEDI_SUBD_AI;
  info[ai].n_chan = 16;
  info[ai].subd_flags = SDF_READABLE | SDF_GROUND | SDF_COMMON | SDF_DIFF | (card.scans ? SDF_CMD_READ : 0) |
                        (card.wide ? SDF_LSAMPL : 0);
  info[ai].timer_type = 5;
  info[ai].len_chanlist = 512;
  info[ai].maxdata = Card::top;
  info[ai].range_type = ai << 24U | static_cast<unsigned>(input_ranges.size());
  info[ao] = {};
  info[ao].type = COMEDI_SUBD_AO;
  info[ao].n_chan = 2;
  info[ao].subd_flags = SDF_WRITABLE | SDF_GROUND | (card.tells ? SDF_READABLE : 0);
  info[ao].timer_type = 5;
  info[ao].maxdata = Card::top;
  info[ao].range_type = ao << 24U | static_cast<unsigned>(output_ranges.size());
  return 0;
}

int describe(const comedi_rangeinfo& asked) {
  const unsigned subdevice = asked.range_type >> 24U & 0xFU;
  const std::span<const comedi_krange> ranges =
      subdevice == ai ? std::span<const comedi_krange>(input_ranges) : std::span<const comedi_krange>(output_ranges);
  if (subdevice >= subdevices || (asked.range_type & 0xFFFFU) != ranges.size()) return refused(EINVAL);
  std::memcpy(asked.range_ptr, ranges.data(), ranges.size_bytes());
  return 0;
}

int instruct(File& file, const comedi_insn& insn) {
  Card& card = *file.card;
  const unsigned channel = CR_CHAN(insn.chanspec);
  if (insn.insn == INSN_GTOD) {  // the time of day: by which libcomedi finds out that there are instructions
    if (insn.n != 2) return refused(EINVAL);
    insn.data[0] = insn.data[1] = 0;
    return 2;
  }
  const bool is_input = insn.subdev == ai && insn.insn == INSN_READ;
  const bool is_output = insn.subdev == ao && (insn.insn == INSN_WRITE || insn.insn == INSN_READ);
  if (!is_input && !is_output) return refused(EINVAL);
  if (channel >= (is_input ? 16U : 2U)) return refused(EINVAL);
  if (is_input && (file.scan.joinable() || busy_elsewhere(file))) return refused(EBUSY);
  for (lsampl_t& code : std::span(insn.data, insn.n)) {
    if (is_input) {
      code = convert(card, insn.chanspec);
    } else if (insn.insn == INSN_READ) {
      if (!card.tells) return refused(EINVAL);
      code = card.outputs[channel];
    } else {
      if (card.refuses || code > Card::top) return refused(EIO);
      card.outputs[channel] = code;
      if (channel == 0) card.codes[card.written++ % Card::remembered] = static_cast<std::uint16_t>(code);
    }
  }
  return static_cast<int>(insn.n);
}

int answer(File& file, unsigned long request, void* argument) {
  if (!file.card->present) return refused(ENODEV);
  switch (request) {
    case COMEDI_DEVINFO:
      return describe(*file.card, *static_cast<comedi_devinfo*>(argument));
    case COMEDI_SUBDINFO:
      return describe(*file.card, static_cast<comedi_subdinfo*>(argument));
    case COMEDI_CHANINFO: {
      const auto& asked = *static_cast<const comedi_chaninfo*>(argument);  // here all channels are alike
      const bool lists = asked.maxdata_list != nullptr || asked.flaglist != nullptr || asked.rangelist != nullptr;
      return asked.subdev >= subdevices || lists ? refused(EINVAL) : 0;
    }
    case COMEDI_RANGEINFO:
      return describe(*static_cast<const comedi_rangeinfo*>(argument));
    case COMEDI_SETRSUBD:
      return reinterpret_cast<std::uintptr_t>(argument) == ai && file.card->scans ? 0 : refused(EINVAL);
    case COMEDI_INSN:
      return instruct(file, *static_cast<const comedi_insn*>(argument));
    case COMEDI_INSNLIST: {
      const auto& list = *static_cast<const comedi_insnlist*>(argument);
      for (unsigned k = 0; k < list.n_insns; ++k) {
        if (instruct(file, list.insns[k]) < 0) return k > 0 ? static_cast<int>(k) : -1;
      }
      return static_cast<int>(list.n_insns);
    }
    case COMEDI_CMDTEST: {
      auto& cmd = *static_cast<comedi_cmd*>(argument);
      return cmd.subdev == ai && file.card->scans ? check(*file.card, cmd) : refused(EIO);
    }
    case COMEDI_CMD:
      return begin(file, *static_cast<comedi_cmd*>(argument));
    case COMEDI_CANCEL:
      if (busy_elsewhere(file)) return refused(EBUSY);
      end_scan(file);
      return 0;
    default:
      return refused(ENOTTY);
  }
}

}  // namespace
}  // namespace emtb::comedi

// ---- In place of the C library's

using namespace emtb::comedi;

extern "C" int open(const char* path, int flags, ...) {
  mode_t mode = 0;
  if ((flags & (O_CREAT | O_TMPFILE)) != 0) {
    va_list rest;
    va_start(rest, flags);
    mode = va_arg(rest, mode_t);
    va_end(rest);
  }
  const int number = real_open(path, flags, mode);
  const std::string_view name(path);
  if (number < 0 || name.substr(name.rfind('/') + 1).substr(0, 6) != "comedi") return number;
  Card* card = map_card(number);
  if (card == nullptr) return number;
  const std::lock_guard lock(opening);
  const auto free = std::ranges::find_if(files, [](const File& file) { return file.number == -1; });
  if (!card->present || free == files.end()) {
    const int error = card->present ? EMFILE : ENXIO;
    munmap(card, sizeof(Card));
    real_close(number);
    return refused(error);
  }
  free->card = card;
  free->error = 0;
  free->number = number;
  return number;
}

extern "C" int ioctl(int number, unsigned long request, ...) noexcept {
  constexpr unsigned long kernels = 0xFFFFFFFF;  // libcomedi's is an int, the kernel looks at its 32 bits
  va_list rest;
  va_start(rest, request);
  void* argument = va_arg(rest, void*);
  va_end(rest);
  File* file = file_of(number);
  return file == nullptr ? real_ioctl(number, request, argument) : answer(*file, request & kernels, argument);
}

extern "C" ssize_t read(int number, void* into, size_t bytes) {
  const ssize_t got = real_read(number, into, bytes);
  if (got != 0) return got;
  File* file = file_of(number);
  if (file == nullptr || file->error == 0) return got;
  return refused(file->error);
}

extern "C" int close(int number) {
  if (File* file = file_of(number); file != nullptr) {
    const std::lock_guard lock(opening);
    end_scan(*file);
    munmap(file->card, sizeof(Card));
    file->number = -1;
  }
  return real_close(number);
}
