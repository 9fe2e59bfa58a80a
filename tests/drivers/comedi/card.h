#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace emtb::comedi {

/// A PCI card of the E series, in a file that lies where its node would: every program in which kernel.cpp stands in
/// for the kernel sees the same card, and a test sees and does what a person at the card would. 12 bit; 16 inputs of
/// -10 to 10, -5 to 5, -0.5 to 0.5 or -0.05 to 0.05 V; two outputs of -10 to 10 V.
struct Card {
  static constexpr std::uint64_t is_one = 0x6472616369646F63;  ///< the file's first bytes
  static constexpr std::uint32_t top = 4095;                   ///< the highest code
  static constexpr std::size_t remembered = 4096;

  std::uint64_t magic = is_one;

  // ---- What it is; set before it is opened
  std::array<char, 20> board{"pci-6024e"};
  bool scans = true;             ///< its driver knows commands
  bool wide = false;             ///< samples of 32 bits
  bool tells = true;             ///< what its outputs were told
  bool rounds_up = false;        ///< has a slow clock: periods are whole milliseconds
  std::uint32_t buffer = 65536;  ///< [bytes] of the driver's buffer

  // ---- What a person sees and does
  std::atomic<bool> present = true;              ///< the card, and its driver
  std::array<std::atomic<double>, 16> inputs{};  ///< [V] at its terminals
  std::atomic<std::uint32_t> ends = 0;           ///< count one up, and the scan under way ends without a word
  std::atomic<bool> silent = false;              ///< the scan goes on, and nothing comes
  std::atomic<int> away = 0;                     ///< [ms] the computer does not get to the card, once
  std::atomic<bool> refuses = false;             ///< what an output is told

  // ---- What the driver has done
  std::array<std::atomic<std::uint32_t>, 2> outputs{2048U, 2048U};  ///< codes; kept when programs die
  std::atomic<std::uint32_t> written = 0;                           ///< how often output 0 was told
  std::array<std::atomic<std::uint16_t>, remembered> codes{};       ///< what, the last of them
  std::atomic<std::uint32_t> commands = 0;                          ///< scans that were begun
  std::atomic<std::uint32_t> scan_period = 0;                       ///< [ns] of the last
  std::array<std::atomic<std::uint32_t>, 16> list{};                ///< and its channels, packed
  std::atomic<pid_t> scanning = 0;                                  ///< the program whose scan runs

  double output(std::size_t channel) const { return (outputs[channel] - 2047.5) / 2047.5 * 10; }  ///< [V]
};
static_assert(std::atomic<double>::is_always_lock_free && std::is_standard_layout_v<Card>);

}  // namespace emtb::comedi
