#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include "drivers/doorbell.h"
#include "drivers/target.h"
#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/error.h"

namespace emtb {

/// The card does not tell what it was told.
class NoReadBack : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// One converter of a card, as CardOutput drives it: one call at a time. Each but code() may throw DeviceError.
class CardConverter {
 public:
  virtual ~CardConverter() = default;

  /// Finds the card. @param again it was open before, and was lost
  virtual void open(bool again) = 0;
  virtual void close() noexcept = 0;
  virtual std::uint32_t code(double volts) const noexcept = 0;  ///< the nearest; once it is open
  virtual void write(std::uint32_t code) = 0;
  /// @return the code that the card was last told @throws NoReadBack by one that cannot say
  virtual std::uint32_t read_back() = 0;
  virtual std::string name() const = 0;  ///< `USB-1608GX-2AO 01A2B3C4: output 0`, once it is open
};

/// One analog output of a card, in a thread of its own and beside whoever scans the inputs.
///
/// The card keeps its last voltage when the host dies, so it is made safe when it is opened and when it is closed, and
/// `emtbd --safe` does just that. Four times a second the card is asked what it was told. A request that fails or
/// takes longer than 0.2 s, and an output that reads back otherwise, are Fault::output_failed, until one is well again.
class CardOutput final : public AnalogOutput {
 public:
  /// The output is safe, and reads back so, when this returns.
  /// @param read_back ask the card what it was told
  /// @throws DeviceError where the card is absent, has no such output, or does not do as it is told
  CardOutput(std::string name, std::unique_ptr<CardConverter> converter, const Limits& limits, bool read_back);
  CardOutput(const CardOutput&) = delete;
  CardOutput& operator=(const CardOutput&) = delete;
  ~CardOutput() override;

  Fault set(double volts) noexcept override;
  Fault make_safe() noexcept override;
  Limits limits() const noexcept override { return target_.limits(); }

 private:
  void write(std::uint32_t code);
  void check();
  void run() noexcept;
  Fault verdict() const noexcept;

  std::unique_ptr<CardConverter> converter_;
  bool read_back_;
  MonotonicClock machine_;

  // Of the thread.
  bool open_ = false;
  std::uint32_t written_ = 0;

  static constexpr double never = std::numeric_limits<double>::infinity();
  Doorbell bell_;
  Target target_;
  std::atomic<bool> anew_ = false;          ///< even if it is what was written last
  std::atomic<Fault> fault_ = Fault::none;  ///< of the last request
  std::atomic<double> busy_since_ = never;  ///< [s] a request is under way
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

}  // namespace emtb
