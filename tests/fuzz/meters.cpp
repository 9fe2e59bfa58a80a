#include <algorithm>
#include <cmath>

#include "drivers/serial_meter/es51922.h"
#include "drivers/serial_meter/fluke.h"
#include "drivers/serial_meter/fs9721.h"
#include "drivers/serial_meter/metex.h"
#include "drivers/serial_meter/scpi.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

using serial_meter::Message;

/// A line that delivers the bytes one by one: what is heard is finite, nothing waits for good, no memory is filled.
void hear(serial_meter::Find find, std::string_view bytes) {
  std::string received;
  for (const char byte : bytes) {
    received += byte;
    while (!received.empty()) {
      const Message message = find(received);
      if (message.kind == Message::Kind::partial) break;
      must(message.length >= 1 && message.length <= received.size(), "a message has a length");
      if (message.kind == Message::Kind::reading && !message.measurement.overload) {
        must(std::isfinite(message.measurement.value), "a reading is finite");
        must(message.measurement.digit >= 0 && std::isfinite(message.measurement.digit), "a digit has a weight");
      }
      received.erase(0, message.length);
    }
    must(received.size() < 200, "no meter fills the memory");
  }
}

}  // namespace

void metex(std::string_view bytes) { hear(serial_meter::metex::find, bytes); }
void fs9721(std::string_view bytes) { hear(serial_meter::fs9721::find, bytes); }
void es51922(std::string_view bytes) { hear(serial_meter::es51922::find, bytes); }
void scpi(std::string_view bytes) { hear(serial_meter::scpi::find, bytes); }
void fluke(std::string_view bytes) { hear(serial_meter::fluke::find, bytes); }

}  // namespace emtb::fuzz
