#include "drivers/serial_port.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

#include "hal/error.h"

namespace emtb {
namespace {

constexpr std::array<std::pair<int, speed_t>, 9> speeds{{{600, B600},
                                                         {1200, B1200},
                                                         {2400, B2400},
                                                         {4800, B4800},
                                                         {9600, B9600},
                                                         {19200, B19200},
                                                         {38400, B38400},
                                                         {57600, B57600},
                                                         {115200, B115200}}};
constexpr int write_patience = 1000;  // [ms]

std::string reason(int error) { return std::generic_category().message(error); }

std::optional<speed_t> speed_of(int baud) {
  const auto found = std::ranges::find(speeds, baud, &std::pair<int, speed_t>::first);
  return found == speeds.end() ? std::nullopt : std::optional{found->second};
}

}  // namespace

SerialPort::SerialPort(const std::string& path, const LineSettings& settings)
    : path_(path), file_(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
  if (file_ < 0) {
    const int error = errno;
    const std::string what = error == EBUSY ? "is in use by another program. Close that one" : reason(error);
    throw DeviceError(path + ": " + what +
                      (error == ENOENT   ? ". Plug its adapter in, or see /dev/serial/by-id for its name"
                       : error == EACCES ? ". Add the user of emtbd to the group dialout"
                                         : ""));
  }
  try {
    set(settings);
  } catch (...) {
    ::close(file_);
    throw;
  }
}

SerialPort::~SerialPort() { ::close(file_); }

void SerialPort::set(const LineSettings& settings) {
  termios wanted{};
  if (tcgetattr(file_, &wanted) != 0) throw DeviceError(path_ + ": is not a serial port: " + reason(errno));
  ioctl(file_, TIOCEXCL);
  cfmakeraw(&wanted);
  wanted.c_cflag &= ~static_cast<tcflag_t>(CSIZE | PARENB | PARODD | CSTOPB | CRTSCTS);
  wanted.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
  wanted.c_cflag |= static_cast<tcflag_t>(settings.data_bits == 7 ? CS7 : CS8);
  if (settings.parity != Parity::none) wanted.c_cflag |= static_cast<tcflag_t>(PARENB);
  if (settings.parity == Parity::odd) wanted.c_cflag |= static_cast<tcflag_t>(PARODD);
  if (settings.stop_bits == 2) wanted.c_cflag |= static_cast<tcflag_t>(CSTOPB);
  // A byte of the wrong parity is read as 0, which no frame contains.
  if (settings.parity != Parity::none) wanted.c_iflag |= static_cast<tcflag_t>(INPCK);
  wanted.c_cc[VMIN] = 0;
  wanted.c_cc[VTIME] = 0;
  const auto speed = speed_of(settings.baud);
  if (!speed) throw DeviceError(path_ + ": no serial port does " + std::to_string(settings.baud) + " baud");
  cfsetispeed(&wanted, *speed);
  cfsetospeed(&wanted, *speed);

  // A pseudo-terminal (a network adapter, a test) has neither control lines nor 7 data bits, and needs none.
  int lines = 0;
  const bool wired = ioctl(file_, TIOCMGET, &lines) == 0;
  if (tcsetattr(file_, TCSANOW, &wanted) != 0 && wired) {
    throw DeviceError(path_ + ": cannot be set to " + std::to_string(settings.baud) + " baud with " +
                      std::to_string(settings.data_bits) + " data bits: " + reason(errno));
  }
  if (wired) {
    lines = settings.dtr ? lines | TIOCM_DTR : lines & ~TIOCM_DTR;
    lines = settings.rts ? lines | TIOCM_RTS : lines & ~TIOCM_RTS;
    if (ioctl(file_, TIOCMSET, &lines) != 0) {
      throw DeviceError(path_ + ": DTR and RTS cannot be set: " + reason(errno));
    }
  }
  tcflush(file_, TCIOFLUSH);
}

void SerialPort::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::write(file_, bytes.data(), bytes.size());
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (sent < 0 && errno != EAGAIN && errno != EINTR) throw DeviceError(path_ + ": has gone: " + reason(errno));
    pollfd ready{.fd = file_, .events = POLLOUT, .revents = 0};
    if (::poll(&ready, 1, write_patience) == 0) throw DeviceError(path_ + ": takes no bytes");
    if ((ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) throw DeviceError(path_ + ": has gone");
  }
}

void SerialPort::wait(double seconds, int other) const {
  std::array<pollfd, 2> ready{
      {{.fd = file_, .events = POLLIN, .revents = 0}, {.fd = other, .events = POLLIN, .revents = 0}}};
  ::poll(ready.data(), ready.size(), static_cast<int>(std::ceil(std::max(seconds, 0.0) * 1e3)));
}

std::string_view SerialPort::read(std::span<char> buffer) {
  const ssize_t got = ::read(file_, buffer.data(), buffer.size());
  if (got > 0) return {buffer.data(), static_cast<std::size_t>(got)};
  if (got < 0 && errno != EAGAIN && errno != EINTR) throw DeviceError(path_ + ": has gone: " + reason(errno));
  pollfd state{.fd = file_, .events = POLLIN, .revents = 0};
  if (::poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) {
    throw DeviceError(path_ + ": has gone");
  }
  return {};
}

void SerialPort::flush() noexcept { tcflush(file_, TCIFLUSH); }

}  // namespace emtb
