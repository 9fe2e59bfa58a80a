#include "tests/drivers/usb1608g/usb_port.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace emtb {
namespace {

constexpr std::size_t setup_bytes = 8;

std::string numbered(const char* format, int number) {
  gchar* text = g_strdup_printf(format, number);
  std::string copy = text;
  g_free(text);
  return copy;
}

/// What the program has at an address; null where it was killed while it asked.
UMockdevIoctlData* memory(UMockdevIoctlData* at, gsize offset, gsize bytes) {
  return umockdev_ioctl_data_resolve(at, offset, bytes, nullptr);
}

usbdevfs_urb& urb_in(UMockdevIoctlData* data) { return *reinterpret_cast<usbdevfs_urb*>(data->data); }

}  // namespace

UsbPort::UsbPort(MockKernel& kernel, int number, UsbDevice& device)
    : kernel_(kernel),
      device_(device),
      node_(numbered("/dev/bus/usb/001/%03d", number)),
      sysfs_(numbered("/sys/devices/usb1-%d", number)),
      number_(number),
      handler_(umockdev_ioctl_base_new()) {
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  g_signal_connect(handler_, "client-vanished", G_CALLBACK(on_vanished), this);
  plug();
}

UsbPort::~UsbPort() {
  if (plugged_ % 2 != 0) unplug();
  g_signal_handlers_disconnect_by_data(handler_, this);
  g_object_unref(handler_);
}

void UsbPort::plug() {
  std::string hex;
  for (const std::uint8_t byte : device_.descriptors()) hex += numbered("%02x", byte);
  const std::string number = numbered("%03d", number_);
  const std::string entry = "P: " + sysfs_.substr(4) + "\nN: " + node_.substr(5) +
                            "\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM=" + number +
                            "\nE: DEVNAME=" + node_ + "\nE: DEVTYPE=usb_device\nA: bConfigurationValue=1\\n\n" +
                            "A: busnum=1\\n\nA: devnum=" + std::to_string(number_) +
                            "\\n\nA: speed=480\\n\nH: descriptors=" + hex + "\n";
  ++plugged_;
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(kernel_.testbed(), node_.c_str(), handler_, &error) ||
      !umockdev_testbed_add_from_string(kernel_.testbed(), entry.c_str(), &error)) {
    throw std::runtime_error(std::string("umockdev: ") + (error != nullptr ? error->message : "?"));
  }
}

void UsbPort::unplug() {
  ++plugged_;
  umockdev_testbed_uevent(kernel_.testbed(), sysfs_.c_str(), "remove");
  umockdev_testbed_remove_device(kernel_.testbed(), sysfs_.c_str());
  umockdev_testbed_detach_ioctl(kernel_.testbed(), node_.c_str(), nullptr);
}

gboolean UsbPort::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, UsbPort* port) {
  port->answer(client);
  return TRUE;
}

void UsbPort::on_vanished(UMockdevIoctlBase*, UMockdevIoctlClient* client, UsbPort* port) {
  const auto found = port->clients_.find(client);
  if (found == port->clients_.end()) return;
  for (Urb& urb : found->second.urbs) umockdev_ioctl_data_unref(urb.data);
  port->clients_.erase(found);
}

int UsbPort::claim(Client& program) {
  const bool taken = std::ranges::any_of(clients_, [&](const auto& entry) {
    const auto& [client, other] = entry;
    return other.owns && &other != &program && connected(other) && umockdev_ioctl_client_get_connected(client) != 0;
  });
  program.owns = program.owns || !taken;
  return taken ? EBUSY : 0;
}

void UsbPort::answer(UMockdevIoctlClient* client) {
  Client& program = clients_.try_emplace(client, Client{.urbs = {}, .plugged = plugged_}).first->second;
  const gulong request = umockdev_ioctl_client_get_request(client);
  const auto complete = [&](int error) { umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error); };
  if (!connected(program) && request != USBDEVFS_REAPURB && request != USBDEVFS_REAPURBNDELAY) return complete(ENODEV);
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* word = memory(umockdev_ioctl_client_get_arg(client), 0, sizeof(guint32));
      if (word == nullptr) return complete(EFAULT);
      constexpr guint32 able = USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_BULK_CONTINUATION |
                               USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT |
                               USBDEVFS_CAP_ZERO_PACKET;
      std::memcpy(word->data, &able, sizeof able);
      umockdev_ioctl_data_unref(word);
      return complete(0);
    }
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      return complete(claim(program));
    case USBDEVFS_RELEASEINTERFACE:
      program.owns = false;
      return complete(0);
    case USBDEVFS_CLEAR_HALT: {
      UMockdevIoctlData* endpoint = memory(umockdev_ioctl_client_get_arg(client), 0, sizeof(unsigned));
      if (endpoint == nullptr) return complete(EFAULT);
      device_.clear_halt(endpoint->data[0]);
      umockdev_ioctl_data_unref(endpoint);
      return complete(0);
    }
    case USBDEVFS_SUBMITURB:
      return submit(client, program);
    case USBDEVFS_DISCARDURB:
      return discard(client, program);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(client, program);
    default:
      return complete(ENOTTY);
  }
}

void UsbPort::submit(UMockdevIoctlClient* client, Client& program) {
  Urb urb;
  urb.data = memory(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_urb));
  if (urb.data == nullptr) return umockdev_ioctl_client_complete(client, -1, EFAULT);
  const usbdevfs_urb& asked = urb_in(urb.data);
  if (asked.type != USBDEVFS_URB_TYPE_CONTROL && !program.owns) {
    umockdev_ioctl_data_unref(urb.data);
    return umockdev_ioctl_client_complete(client, -1, EINVAL);
  }
  urb.buffer = memory(urb.data, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(asked.buffer_length));
  if (urb.buffer == nullptr) {
    umockdev_ioctl_data_unref(urb.data);
    return umockdev_ioctl_client_complete(client, -1, EFAULT);
  }
  program.urbs.push_back(urb);
  if (asked.type == USBDEVFS_URB_TYPE_CONTROL) carry_out(program.urbs.back());
  umockdev_ioctl_client_complete(client, 0, 0);
}

void UsbPort::carry_out(Urb& one) {
  usbdevfs_urb& urb = urb_in(one.data);
  int result = 0;
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    const guint8* head = one.buffer->data;
    const auto word = [&](int at) { return static_cast<std::uint16_t>(head[at] | head[at + 1] << 8U); };
    const UsbDevice::Setup setup{
        .type = head[0], .request = head[1], .value = word(2), .index = word(4), .length = word(6)};
    result = device_.control(setup, {one.buffer->data + setup_bytes, setup.length});
    if (result == UsbDevice::no_answer) return;
  } else {
    result = device_.bulk_in(urb.endpoint, {one.buffer->data, static_cast<std::size_t>(urb.buffer_length)});
    if (result == -EAGAIN) return;
  }
  urb.status = std::min(result, 0);
  urb.actual_length = std::max(result, 0);
  one.done = true;
}

void UsbPort::discard(UMockdevIoctlClient* client, Client& program) {
  const gulong address = *reinterpret_cast<gulong*>(umockdev_ioctl_client_get_arg(client)->data);
  const auto found =
      std::ranges::find_if(program.urbs, [&](const Urb& urb) { return urb.data->client_addr == address && !urb.done; });
  if (found == program.urbs.end()) return umockdev_ioctl_client_complete(client, -1, EINVAL);
  urb_in(found->data).status = -ENOENT;
  found->done = true;
  umockdev_ioctl_client_complete(client, 0, 0);
}

void UsbPort::reap(UMockdevIoctlClient* client, Client& program) {
  if (!connected(program)) {
    for (Urb& urb : program.urbs) {
      if (!urb.done) urb_in(urb.data).status = -ENODEV;
      urb.done = true;
    }
  }
  auto ready = std::ranges::find_if(program.urbs, &Urb::done);
  if (ready == program.urbs.end() && connected(program)) {
    // Bulk transfers of one endpoint end in the order in which they began.
    ready = std::ranges::find_if(program.urbs,
                                 [](const Urb& urb) { return urb_in(urb.data).type == USBDEVFS_URB_TYPE_BULK; });
    if (ready != program.urbs.end()) carry_out(*ready);
  }
  if (ready == program.urbs.end() || !ready->done) {
    if (connected(program))
      std::this_thread::sleep_for(std::chrono::microseconds(500));  // its descriptor is always ready
    return umockdev_ioctl_client_complete(client, -1, connected(program) ? EAGAIN : ENODEV);
  }
  UMockdevIoctlData* where = memory(umockdev_ioctl_client_get_arg(client), 0, sizeof(gpointer));
  if (where == nullptr) return umockdev_ioctl_client_complete(client, -1, EFAULT);
  umockdev_ioctl_data_set_ptr(where, 0, ready->data);
  umockdev_ioctl_data_unref(where);
  umockdev_ioctl_client_complete(client, 0, 0);
  umockdev_ioctl_data_unref(ready->data);
  program.urbs.erase(ready);
}

}  // namespace emtb
