#include "drivers/usb1608g/transfers.h"

#include <algorithm>
#include <exception>

namespace emtb::usb1608g {
namespace {

constexpr int longest_farewell = 50;    // rounds
constexpr double farewell_round = 0.1;  // [s]

}  // namespace

Transfers::Transfers(Link& link, std::size_t count, std::size_t bytes, Take take)
    : link_(link), take_(std::move(take)) {
  for (std::size_t k = 0; k < count; ++k) {
    auto one = std::make_unique<One>();
    one->buffer.resize(bytes);
    one->transfer.reset(libusb_alloc_transfer(0));
    one->home = this;
    if (!one->transfer) throw DeviceError(link_.name() + ": no memory for a transfer");
    libusb_fill_bulk_transfer(one->transfer.get(), link_.handle(), scan_endpoint, one->buffer.data(),
                              static_cast<int>(bytes), completed, one.get(), 0);
    ring_.push_back(std::move(one));
  }
  for (const auto& one : ring_) {
    const int error = libusb_submit_transfer(one->transfer.get());
    one->under_way = error == 0;
    if (error == 0) continue;
    end();
    throw Gone(link_.name() + ": a transfer cannot be submitted: " + link_.why(error));
  }
}

Transfers::~Transfers() { end(); }

void Transfers::end() noexcept {
  ending_ = true;
  for (const auto& one : ring_) {
    if (one->under_way) libusb_cancel_transfer(one->transfer.get());
  }
  for (int round = 0; round < longest_farewell && any_under_way(); ++round) {
    try {
      link_.pump(farewell_round);
    } catch (const std::exception&) {  // the next round, or the last
    }
  }
  // What libusb still holds after seconds may be written to at any time: rather lost than freed.
  for (auto& one : ring_) {
    if (!one->under_way) continue;
    one->home = nullptr;
    static_cast<void>(one.release());
  }
}

bool Transfers::any_under_way() const noexcept {
  return std::ranges::any_of(ring_, [](const auto& one) { return one->under_way; });
}

void LIBUSB_CALL Transfers::completed(libusb_transfer* transfer) {
  auto* one = static_cast<One*>(transfer->user_data);
  one->under_way = false;
  if (one->home != nullptr) one->home->take_in(*one);
}

void Transfers::take_in(One& one) noexcept {
  const libusb_transfer& transfer = *one.transfer;
  if (transfer.actual_length > 0 && !ending_) {
    take_(std::span(one.buffer).first(static_cast<std::size_t>(transfer.actual_length)));
  }
  if (transfer.status != LIBUSB_TRANSFER_COMPLETED) {
    if (ended_ == LIBUSB_TRANSFER_COMPLETED && !ending_) ended_ = transfer.status;
    return;
  }
  if (ending_ || ended_ != LIBUSB_TRANSFER_COMPLETED) return;
  one.under_way = libusb_submit_transfer(one.transfer.get()) == 0;
  if (!one.under_way) ended_ = LIBUSB_TRANSFER_NO_DEVICE;
}

}  // namespace emtb::usb1608g
