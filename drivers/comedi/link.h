#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/comedi/mapping.h"
#include "hal/error.h"

namespace emtb::comedi {

/// The card itself has gone, or its driver was unloaded.
class Gone : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// Which card, and how its codes become volts.
struct CardSettings {
  std::string node = "/dev/comedi0";
  std::string board;                 ///< what its driver must call it; empty: whatever is there
  std::string calibration = "auto";  ///< auto: a calibration file where there is one; nominal; or the file
};

/// A card, opened through its kernel driver. All calls are for one thread.
class Link {
 public:
  /// @throws DeviceError where there is no such node, no kernel driver behind it, or another card than expected
  explicit Link(const CardSettings& settings);

  const std::string& name() const noexcept { return name_; }  ///< `/dev/comedi0 (pci-6024e)`
  const std::string& board() const noexcept { return board_; }
  comedi_t* get() const noexcept { return card_.get(); }
  int descriptor() const noexcept { return comedi_fileno(card_.get()); }

  /// The first subdevice of a kind. @throws DeviceError where the card has none
  unsigned int subdevice(int type, const char* what) const;
  unsigned int flags(unsigned int subdevice) const noexcept;

  /// Checks a channel's number and chooses the narrowest range. @throws DeviceError that says what the card has
  std::size_t range_for(unsigned int subdevice, unsigned int channel, Range wanted) const;
  Range range(unsigned int subdevice, unsigned int channel, std::size_t number) const;

  /// By the calibration that the settings ask for. @throws DeviceError where they name a file that is none
  Converter converter(unsigned int subdevice, unsigned int channel, std::size_t range) const;

  lsampl_t read(unsigned int subdevice, unsigned int channel, std::size_t range, Wiring wiring) const;
  void write(unsigned int subdevice, unsigned int channel, std::size_t range, lsampl_t code) const;

  /// Throws what the library's last error means. @param what was tried
  [[noreturn]] void fail(const std::string& what) const;

 private:
  struct Close {
    void operator()(comedi_t* card) const noexcept { comedi_close(card); }
  };
  struct Forget {
    void operator()(comedi_calibration_t* calibration) const noexcept { comedi_cleanup_calibration(calibration); }
  };
  void read_calibration(const std::string& wish);
  std::vector<Range> ranges(unsigned int subdevice, unsigned int channel) const;

  std::unique_ptr<comedi_t, Close> card_;
  std::unique_ptr<comedi_calibration_t, Forget> calibration_;  ///< of a file, if any
  bool nominal_ = false;
  std::string board_;
  std::string name_;
};

}  // namespace emtb::comedi
