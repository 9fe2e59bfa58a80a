#pragma once

#include <umockdev.h>

#include <atomic>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace emtb {

/// A device at the far end of a USB cable. Called from the port's thread.
class UsbDevice {
 public:
  struct Setup {  // of a control request
    std::uint8_t type = 0;
    std::uint8_t request = 0;
    std::uint16_t value = 0;
    std::uint16_t index = 0;
    std::uint16_t length = 0;
  };
  static constexpr int no_answer = -1000;  ///< never: the host's patience ends first

  virtual ~UsbDevice() = default;
  virtual std::vector<std::uint8_t> descriptors() const = 0;  ///< device, then configuration, as sysfs has them
  /// @return bytes moved, or -errno (-EPIPE stalls), or no_answer
  virtual int control(const Setup& setup, std::span<std::uint8_t> data) = 0;
  /// @return bytes moved, -EAGAIN: nothing yet, or -errno
  virtual int bulk_in(std::uint8_t endpoint, std::span<std::uint8_t> data) = 0;
  virtual void clear_halt(std::uint8_t endpoint) = 0;
};

/// The kernel of a machine without USB, for programs that umockdev's library is loaded into.
class MockKernel {
 public:
  MockKernel() : testbed_(umockdev_testbed_new()) {}
  ~MockKernel() { g_object_unref(testbed_); }
  MockKernel(const MockKernel&) = delete;
  MockKernel& operator=(const MockKernel&) = delete;
  UMockdevTestbed* testbed() const noexcept { return testbed_; }

 private:
  UMockdevTestbed* testbed_;
};

/// A socket for one device: what libusb asks of Linux' usbfs is answered here, below libusb. Any number of programs,
/// one at a time with the interface.
class UsbPort {
 public:
  /// @param number from 1: of the device on the bus
  UsbPort(MockKernel& kernel, int number, UsbDevice& device);
  ~UsbPort();
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  void plug();
  void unplug();  ///< every program that has it open hears of it

 private:
  struct Urb {
    UMockdevIoctlData* data = nullptr;    ///< the struct usbdevfs_urb
    UMockdevIoctlData* buffer = nullptr;  ///< of the program
    bool done = false;
  };
  struct Client {
    std::list<Urb> urbs;
    bool owns = false;  ///< the interface
    int plugged = 0;    ///< which time it was, when the program opened the device
  };

  static gboolean on_ioctl(UMockdevIoctlBase* base, UMockdevIoctlClient* client, UsbPort* port);
  static void on_vanished(UMockdevIoctlBase* base, UMockdevIoctlClient* client, UsbPort* port);
  void answer(UMockdevIoctlClient* client);
  bool connected(const Client& program) const { return plugged_ % 2 != 0 && program.plugged == plugged_; }
  int claim(Client& program);
  void submit(UMockdevIoctlClient* client, Client& program);
  void discard(UMockdevIoctlClient* client, Client& program);
  void reap(UMockdevIoctlClient* client, Client& program);
  void carry_out(Urb& urb);

  MockKernel& kernel_;
  UsbDevice& device_;
  std::string node_, sysfs_;
  int number_;
  UMockdevIoctlBase* handler_;
  std::map<UMockdevIoctlClient*, Client> clients_;  ///< of umockdev's thread
  std::atomic<int> plugged_ = 0;                    ///< counts the times; even: unplugged
};

}  // namespace emtb
