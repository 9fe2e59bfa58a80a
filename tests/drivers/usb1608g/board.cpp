#include "tests/drivers/usb1608g/board.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

namespace emtb::usb1608g {
namespace {

constexpr std::size_t bus_packet = 512;  // [bytes] high speed

std::uint32_t u32(std::span<const std::uint8_t> bytes) {
  return bytes[0] | bytes[1] << 8U | bytes[2] << 16U | static_cast<std::uint32_t>(bytes[3]) << 24U;
}

/// As many bytes of an answer as the host asked for.
int give(std::span<const std::uint8_t> bytes, std::span<std::uint8_t> data) {
  const std::size_t count = std::min(bytes.size(), data.size());
  std::copy_n(bytes.begin(), count, data.begin());
  return static_cast<int>(count);
}

int give_word(unsigned word, std::span<std::uint8_t> data) {
  return give(std::array{static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)}, data);
}

}  // namespace

Board::Board(Traits traits, World world)
    : traits_(std::move(traits)), world_(std::move(world)), configured_(traits_.configured) {
  for (std::uint16_t at = 0; at < 0x100; at = static_cast<std::uint16_t>(at + 4)) {
    const float number = at % 8 == 0 ? traits_.slope : traits_.offset;
    for (unsigned k = 0; k < 4; ++k) {
      memory_[static_cast<std::uint16_t>(0x7000 + at + k)] =
          static_cast<std::uint8_t>(std::bit_cast<std::uint32_t>(number) >> (8 * k));
    }
  }
}

double Board::now() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - born_).count(); }

double Board::output(int channel) const {
  const std::lock_guard lock(mutex_);
  return (dac_[static_cast<std::size_t>(channel)] - 32768.0) / 32768 * 10;
}
std::vector<std::uint16_t> Board::written(int channel) const {
  const std::lock_guard lock(mutex_);
  return written_[static_cast<std::size_t>(channel)];
}
bool Board::scanning() const {
  const std::lock_guard lock(mutex_);
  return scanning_;
}
std::uint32_t Board::requests(std::uint8_t request) const {
  const std::lock_guard lock(mutex_);
  const auto found = requests_.find(request);
  return found == requests_.end() ? 0 : found->second;
}
std::vector<std::uint8_t> Board::last(std::uint8_t request) const {
  const std::lock_guard lock(mutex_);
  const auto found = last_.find(request);
  return found == last_.end() ? std::vector<std::uint8_t>{} : found->second;
}
void Board::set_input(int channel, double volts) {
  const std::lock_guard lock(mutex_);
  catch_up();
  still_[static_cast<std::size_t>(channel)] = volts;
}
void Board::stream(std::function<bool(std::span<std::uint8_t>)> give) {
  const std::lock_guard lock(mutex_);
  stream_ = std::move(give);
}
void Board::overrun() {
  const std::lock_guard lock(mutex_);
  overrun_ = true;
}
void Board::halt_scan() {
  const std::lock_guard lock(mutex_);
  scanning_ = false;
}
void Board::stall_scan() {
  const std::lock_guard lock(mutex_);
  stalled_ = true;
}
void Board::shorten_packet(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  shorten_ = bytes;
}
void Board::lose_fpga() {
  const std::lock_guard lock(mutex_);
  configured_ = scanning_ = false;
}
void Board::silence(bool silent) {
  const std::lock_guard lock(mutex_);
  silent_ = silent;
}
void Board::refuse(std::uint8_t request, bool refused) {
  const std::lock_guard lock(mutex_);
  refused_[request] = refused;
}
void Board::overwrite_output(int channel, std::uint16_t code) {
  const std::lock_guard lock(mutex_);
  dac_[static_cast<std::size_t>(channel)] = code;
}
void Board::power_cycle(bool configured) {
  const std::lock_guard lock(mutex_);
  configured_ = configured;
  configuring_ = scanning_ = overrun_ = stalled_ = false;
  image_ = 0;
  fifo_.clear();
}

std::vector<std::uint8_t> Board::descriptors() const {
  const auto low = static_cast<std::uint8_t>(traits_.product);
  const auto high = static_cast<std::uint8_t>(traits_.product >> 8U);
  return {18, 1, 0x00, 0x02, 0xFF, 0xFF, 0,    64,   0xDB, 0x09, low, high, 0x05, 0x01, 1, 2, 3, 1,  // device
          9,  2, 32,   0,    1,    1,    0,    0x80, 0xFA,                                           // configuration
          9,  4, 0,    0,    2,    0xFF, 0xFF, 0xFF, 0,                                              // interface
          7,  5, 0x86, 2,    0x00, 0x02, 0,                                                          // bulk in, 512
          7,  5, 0x02, 2,    0x00, 0x02, 0};                                                         // bulk out, 512
}

std::uint16_t Board::status() const {
  return static_cast<std::uint16_t>((scanning_ ? 0x0002 : 0) | (overrun_ ? 0x0004 : 0) | (configured_ ? 0x0100 : 0) |
                                    (configuring_ ? 0x0200 : 0));
}

std::uint16_t Board::convert(std::uint8_t slot, const std::array<double, 16>& inputs) const {
  constexpr std::array full_scale{10.0, 5.0, 2.0, 1.0};
  const std::size_t channel = slot & 7U;
  const unsigned mode = slot >> 5U & 3U;
  const double volts = mode == 0   ? inputs[channel] - inputs[channel + 8]  // differential: 0 against 8
                       : mode == 1 ? inputs[channel]
                                   : inputs[channel + 8];
  const double ideal = volts / full_scale[slot >> 3U & 3U] * 32768 + 32768;
  // Such that the correction in its memory makes it true.
  const double code = (ideal - static_cast<double>(traits_.offset)) / static_cast<double>(traits_.slope);
  return static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, 65535.0)));
}

void Board::catch_up() {
  if (!scanning_ || overrun_ || silent_) return;
  const double until = now();
  for (double t; (t = began_ + static_cast<double>(scans_) * period_) <= until; ++scans_) {
    const std::array<double, 16> inputs = world_ ? world_(t, (dac_[0] - 32768.0) / 32768 * 10) : still_;
    for (const std::uint8_t slot : list_) {
      fifo_.push_back(convert(slot, inputs));
      if ((slot & 0x80U) != 0) break;
    }
  }
}

int Board::control(const Setup& setup, std::span<std::uint8_t> data) {
  const std::lock_guard lock(mutex_);
  if (silent_) return no_answer;
  return (setup.type & 0x60U) == 0 ? standard(setup, data) : vendor(setup, data);
}

int Board::standard(const Setup& setup, std::span<std::uint8_t> data) const {
  if (setup.request != 6 || setup.value >> 8U != 3) return -EPIPE;  // only strings are asked for
  std::vector<std::uint8_t> answer{0, 3, 0x09, 0x04};               // 0: the languages
  if ((setup.value & 0xFFU) != 0) {
    const std::string text = (setup.value & 0xFFU) == 3 ? traits_.serial : "MCC";
    answer.resize(2);
    for (const char c : text) {
      answer.push_back(static_cast<std::uint8_t>(c));
      answer.push_back(0);
    }
  }
  answer[0] = static_cast<std::uint8_t>(answer.size());
  const std::size_t count = std::min(answer.size(), data.size());
  std::copy_n(answer.begin(), count, data.begin());
  return static_cast<int>(count);
}

int Board::vendor(const Setup& setup, std::span<std::uint8_t> data) {
  ++requests_[setup.request];
  const bool in = (setup.type & 0x80U) != 0;
  if (!in) last_[setup.request] = {data.begin(), data.end()};
  if (refused_[setup.request]) return -EPIPE;
  if (const auto answer = microcontroller(setup, data)) return *answer;
  return configured_ ? fpga(setup, data) : -EPIPE;
}

/// Status, the FPGA's image, memory: what the card does before it has an image. @return nothing: not its request
std::optional<int> Board::microcontroller(const Setup& setup, std::span<std::uint8_t> data) {
  const bool in = (setup.type & 0x80U) != 0;
  const int taken = static_cast<int>(data.size());
  switch (setup.request) {
    case 0x40:
      return in ? give_word(status(), data) : -EPIPE;
    case 0x50:
      configuring_ = data.size() == 1 && data[0] == 0xAD;
      image_ = 0;
      return taken;
    case 0x51:
      if (!configuring_ || data.size() > 64) return -EPIPE;
      image_ += data.size();
      if (image_ == traits_.image) {
        configured_ = true;
        configuring_ = false;
      }
      return taken;
    case 0x31:
      if (in || data.size() != 2) return -EPIPE;
      address_ = static_cast<std::uint16_t>(data[0] | data[1] << 8U);
      return taken;
    case 0x30:
      if (!in || data.size() > 64) return -EPIPE;
      for (std::uint8_t& byte : data) byte = memory_[address_++];
      return taken;
    default:
      return std::nullopt;
  }
}

/// Inputs, scans and outputs.
int Board::fpga(const Setup& setup, std::span<std::uint8_t> data) {
  const bool in = (setup.type & 0x80U) != 0;
  const int taken = static_cast<int>(data.size());
  switch (setup.request) {
    case 0x10: {
      if (scanning_ || !in) return -EPIPE;
      const std::array<double, 16> inputs = world_ ? world_(now(), (dac_[0] - 32768.0) / 32768 * 10) : still_;
      return give_word(convert(list_[setup.value], inputs), data);
    }
    case 0x12:
      if (scanning_ || in || (data.size() != 14 && data.size() != 15)) return -EPIPE;
      period_ = (u32(data.subspan(8)) + 1.0) / 64e6;
      packet_ = data[12] + 1U;
      began_ = now();
      scans_ = 0;
      scanning_ = true;
      return taken;
    case 0x13:
      scanning_ = false;
      return taken;
    case 0x14:
      if (scanning_ || data.size() != 16) return -EPIPE;
      std::ranges::copy(data, list_.begin());
      return taken;
    case 0x15:
      fifo_.clear();
      overrun_ = false;
      return taken;
    case 0x18: {
      if (in) {
        return give(std::array{static_cast<std::uint8_t>(dac_[0]), static_cast<std::uint8_t>(dac_[0] >> 8U),
                               static_cast<std::uint8_t>(dac_[1]), static_cast<std::uint8_t>(dac_[1] >> 8U)},
                    data);
      }
      if (setup.index > 1 || traits_.product == 0x0134 || traits_.product == 0x0135) return -EPIPE;
      catch_up();  // what was sampled so far saw the voltage before
      dac_[setup.index] = setup.value;
      written_[setup.index].push_back(setup.value);
      return taken;
    }
    default:
      return -EPIPE;
  }
}

int Board::bulk_in(std::uint8_t endpoint, std::span<std::uint8_t> data) {
  const std::lock_guard lock(mutex_);
  if (endpoint != 0x86) return -EPIPE;
  if (silent_) return -EAGAIN;
  if (stalled_) return -EPIPE;
  if (stream_) return scanning_ && stream_(data) ? static_cast<int>(data.size()) : -EAGAIN;
  catch_up();
  const bool full = 2 * packet_ == bus_packet;  // then the transfer goes on until it is full
  const std::size_t samples = full ? data.size() / 2 : packet_;
  if (!scanning_ || overrun_ || fifo_.size() < samples) return -EAGAIN;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    data[bytes++] = static_cast<std::uint8_t>(fifo_.front());
    data[bytes++] = static_cast<std::uint8_t>(fifo_.front() >> 8U);
    fifo_.pop_front();
  }
  if (shorten_ != 0) bytes = std::min(bytes, std::exchange(shorten_, 0));
  return static_cast<int>(bytes);
}

void Board::clear_halt(std::uint8_t endpoint) {
  const std::lock_guard lock(mutex_);
  if (endpoint == 0x86) stalled_ = false;
}

}  // namespace emtb::usb1608g
