#include "drivers/usb1608g/link.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emtb::usb1608g {
namespace {

constexpr unsigned patience = 1000;  // [ms] of a request: the vendor's library, too
constexpr std::uint8_t vendor_out = 0x40;
constexpr std::uint8_t vendor_in = 0xC0;

struct Unref {
  void operator()(libusb_device** list) const noexcept { libusb_free_device_list(list, 1); }
};
using DeviceList = std::unique_ptr<libusb_device*, Unref>;

/// Calls `look(device, descriptor, model)` for each card that is connected.
template <class Look>
void each_card(libusb_context* context, Look look) {
  libusb_device** raw = nullptr;
  const ssize_t count = libusb_get_device_list(context, &raw);
  const DeviceList list(raw);
  for (ssize_t k = 0; k < count; ++k) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(raw[k], &descriptor) != 0 || descriptor.idVendor != vendor_id) continue;
    if (const Model* model = model_of(descriptor.idProduct)) look(raw[k], descriptor, *model);
  }
}

std::string serial_of(libusb_device_handle* handle, const libusb_device_descriptor& descriptor) {
  std::array<unsigned char, 64> text{};
  const int length = libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text.data(), text.size());
  return length > 0 ? std::string(text.begin(), text.begin() + length) : std::string();
}

libusb_context* new_context() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0) {
    throw DeviceError(std::string("USB: libusb does not start: ") + libusb_strerror(error));
  }
  return context;
}

}  // namespace

Link::Link(const std::string& serial, Access access) : context_(new_context()) {
  find(serial);
  if (access == Access::requests) return;
  libusb_set_auto_detach_kernel_driver(handle_.get(), 1);
  if (const int error = libusb_claim_interface(handle_.get(), 0); error != 0) {
    throw DeviceError(name() + ": " +
                      (error == LIBUSB_ERROR_BUSY ? "is in use by another program. Close that one" : why(error)));
  }
  const int size = libusb_get_max_packet_size(libusb_get_device(handle_.get()), scan_endpoint);
  if (size < 2) throw DeviceError(name() + ": has no endpoint 0x86 for a scan. Is it really this card?");
  packet_size_ = static_cast<std::size_t>(size);
}

void Link::find(const std::string& serial) {
  std::string seen;
  int error = 0;
  int matches = 0;
  each_card(context_.get(), [&](libusb_device* device, const libusb_device_descriptor& descriptor, const Model& model) {
    libusb_device_handle* raw = nullptr;
    if (const int refused = libusb_open(device, &raw); refused != 0) {
      error = refused;
      return;
    }
    std::unique_ptr<libusb_device_handle, decltype(&libusb_close)> open(raw, libusb_close);
    const std::string found = serial_of(raw, descriptor);
    seen += (seen.empty() ? "" : ", ") + std::string(model.name) + " " + found;
    if (!serial.empty() && found != serial) return;
    if (++matches > 1) return;
    handle_.reset(open.release());
    model_ = &model;
    serial_ = found;
  });
  if (matches == 1) return;
  if (matches > 1)
    throw DeviceError("several cards are connected: " + seen + ". Write serial: of the one that is meant");
  const std::string wanted = serial.empty() ? "no USB-1608G, -1608GX or -1608GX-2AO" : "no card of serial " + serial;
  if (error == LIBUSB_ERROR_ACCESS) {
    throw DeviceError(
        "a card is connected, but not ours to open. Install the rules of systemd/60-emtb.rules, plug it in "
        "anew, and add the user of emtbd to the group plugdev");
  }
  throw DeviceError(wanted + " is connected" +
                    (seen.empty() ? ". Plug it in, or look for it with: lsusb -d 09db:" : "; there is " + seen));
}

std::string Link::why(int error) const { return libusb_strerror(error); }

void Link::fail(Request request, int error) const {
  static constexpr std::array digits{'0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'A', 'B', 'C', 'D', 'E', 'F'};
  const auto code = static_cast<unsigned>(request);
  const std::string what = name() + ": request 0x" + digits[code >> 4U] + digits[code & 15U] + ": ";
  if (error == LIBUSB_ERROR_PIPE) throw Stalled(what + "the card refuses it");
  if (error == LIBUSB_ERROR_TIMEOUT) throw DeviceError(what + "no answer within a second");
  throw Gone(what + why(error));
}

void Link::send(Request request, std::uint16_t value, std::uint16_t index, std::span<const std::uint8_t> data) {
  std::array<std::uint8_t, 64> buffer{};  // libusb wants to be able to write
  if (data.size() > buffer.size()) throw DeviceError(name() + ": more than 64 bytes in one request");
  std::ranges::copy(data, buffer.begin());
  const int sent = libusb_control_transfer(handle_.get(), vendor_out, static_cast<std::uint8_t>(request), value, index,
                                           buffer.data(), static_cast<std::uint16_t>(data.size()), patience);
  if (sent < 0) fail(request, sent);
  if (static_cast<std::size_t>(sent) != data.size()) throw DeviceError(name() + ": took a part of a request only");
}

std::size_t Link::receive(Request request, std::span<std::uint8_t> data) {
  const int got = libusb_control_transfer(handle_.get(), vendor_in, static_cast<std::uint8_t>(request), 0, 0,
                                          data.data(), static_cast<std::uint16_t>(data.size()), patience);
  if (got < 0) fail(request, got);
  return static_cast<std::size_t>(got);
}

std::uint16_t Link::status() {
  std::array<std::uint8_t, 2> word{};
  if (receive(Request::status, word) != word.size()) throw DeviceError(name() + ": half a status word");
  return little_endian(word[0], word[1]);
}

void Link::clear_halt() {
  if (const int error = libusb_clear_halt(handle_.get(), scan_endpoint); error != 0)
    throw Gone(name() + ": " + why(error));
}

void Link::pump(double seconds) {
  timeval patience_of_pump{.tv_sec = static_cast<time_t>(seconds),
                           .tv_usec = static_cast<suseconds_t>((seconds - std::floor(seconds)) * 1e6)};
  const int error = libusb_handle_events_timeout_completed(context_.get(), &patience_of_pump, nullptr);
  if (error != 0 && error != LIBUSB_ERROR_INTERRUPTED) throw Gone(name() + ": " + why(error));
}

std::vector<Connected> connected_cards() {
  struct Exit {
    void operator()(libusb_context* context) const noexcept { libusb_exit(context); }
  };
  const std::unique_ptr<libusb_context, Exit> context(new_context());
  std::vector<Connected> cards;
  each_card(context.get(), [&](libusb_device* device, const libusb_device_descriptor& descriptor, const Model& model) {
    libusb_device_handle* raw = nullptr;
    Connected card{.model = &model, .serial = {}};
    if (libusb_open(device, &raw) == 0) {
      card.serial = serial_of(raw, descriptor);
      libusb_close(raw);
    }
    cards.push_back(card);
  });
  return cards;
}

}  // namespace emtb::usb1608g
