#pragma once

#include <libusb-1.0/libusb.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb1608g/protocol.h"
#include "hal/error.h"

namespace emtb::usb1608g {

/// The card stalled a request: it does not have it, or not now.
class Stalled : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// The card has been unplugged, or answers nothing any more.
class Gone : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// What a Link is for: requests alone go beside another program's scan, so that an output can be made safe at any time.
enum class Access : std::uint8_t { requests, requests_and_scan };

/// One card on the USB, for one thread: a libusb session of its own, so that several cards, an output beside a scan,
/// and a return after an unplug need no common state.
class Link {
 public:
  /// @param serial of the card; empty: the only one that is connected
  /// @throws DeviceError where it is absent, ambiguous, in use, or not ours to open
  Link(const std::string& serial, Access access);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  const Model& model() const noexcept { return *model_; }
  const std::string& serial() const noexcept { return serial_; }
  std::string name() const { return std::string(model_->name) + " " + serial_; }
  std::size_t packet_size() const noexcept { return packet_size_; }  ///< [bytes] of the scan's endpoint

  /// @throws Stalled, Gone, or DeviceError where it takes longer than a second
  void send(Request request, std::uint16_t value = 0, std::uint16_t index = 0, std::span<const std::uint8_t> data = {});
  /// @return how many bytes came, `data.size()` at most. @throws as send()
  std::size_t receive(Request request, std::span<std::uint8_t> data);
  std::uint16_t status();
  void clear_halt();  ///< of the scan's endpoint

  /// Lets completed transfers call back, at most so long. @throws Gone
  void pump(double seconds);

  libusb_device_handle* handle() const noexcept { return handle_.get(); }
  std::string why(int error) const;

 private:
  struct Closes {
    void operator()(libusb_context* context) const noexcept { libusb_exit(context); }
    void operator()(libusb_device_handle* handle) const noexcept {
      libusb_release_interface(handle, 0);
      libusb_close(handle);
    }
  };
  using Handle = std::unique_ptr<libusb_device_handle, Closes>;

  void find(const std::string& serial);
  [[noreturn]] void fail(Request request, int error) const;

  std::unique_ptr<libusb_context, Closes> context_;
  Handle handle_;
  const Model* model_ = nullptr;
  std::string serial_;
  std::size_t packet_size_ = 0;
};

/// A card that is connected, for lists.
struct Connected {
  const Model* model = nullptr;
  std::string serial;  ///< empty where it may not be opened
};
std::vector<Connected> connected_cards();

}  // namespace emtb::usb1608g
