#pragma once

#include <libusb-1.0/libusb.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "drivers/usb1608g/link.h"

namespace emtb::usb1608g {

/// Bulk transfers that are always under way, so that the card never waits for the host. A ring: each that is complete
/// hands over its bytes and goes out again.
///
/// One thread makes it, calls Link::pump() and ends it. The transfers belong to libusb until their last call back; the
/// destructor waits for that.
class Transfers {
 public:
  /// Gets the bytes of one transfer, within pump(). Must not throw.
  using Take = std::function<void(std::span<const std::uint8_t>)>;

  /// @param bytes of each @throws DeviceError where they cannot be submitted
  Transfers(Link& link, std::size_t count, std::size_t bytes, Take take);
  ~Transfers();
  Transfers(const Transfers&) = delete;
  Transfers& operator=(const Transfers&) = delete;

  /// How the stream ended; LIBUSB_TRANSFER_COMPLETED: it has not.
  libusb_transfer_status ended() const noexcept { return ended_; }

 private:
  struct Frees {
    void operator()(libusb_transfer* transfer) const noexcept { libusb_free_transfer(transfer); }
  };
  struct One {
    std::vector<std::uint8_t> buffer;
    std::unique_ptr<libusb_transfer, Frees> transfer;
    Transfers* home = nullptr;
    bool under_way = false;
  };

  static void LIBUSB_CALL completed(libusb_transfer* transfer);
  void take_in(One& one) noexcept;
  bool any_under_way() const noexcept;
  void end() noexcept;

  Link& link_;
  Take take_;
  std::vector<std::unique_ptr<One>> ring_;
  libusb_transfer_status ended_ = LIBUSB_TRANSFER_COMPLETED;
  bool ending_ = false;
};

}  // namespace emtb::usb1608g
