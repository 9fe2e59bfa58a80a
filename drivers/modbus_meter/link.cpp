#include "drivers/modbus_meter/link.h"

#include <modbus/modbus.h>

#include <cerrno>
#include <cmath>

#include "hal/error.h"

namespace emtb::modbus_meter {
namespace {

modbus_t* context_for(const Address& address) {
  if (const auto* tcp = std::get_if<TcpAddress>(&address)) {
    return modbus_new_tcp_pi(tcp->host.c_str(), std::to_string(tcp->port).c_str());
  }
  const auto& rtu = std::get<RtuAddress>(address);
  const char parity = rtu.line.parity == Parity::none ? 'N' : rtu.line.parity == Parity::even ? 'E' : 'O';
  return modbus_new_rtu(rtu.port.c_str(), rtu.line.baud, parity, rtu.line.data_bits, rtu.line.stop_bits);
}

Outcome outcome_of(int error) noexcept {
  switch (error) {
    case ETIMEDOUT:
      return Outcome::silent;
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBBADEXC:
    case EMBUNKEXC:
    case EMBMDATA:
    case EMBBADSLAVE:
      return Outcome::garbled;
    case EMBXILFUN:
    case EMBXILADD:
    case EMBXILVAL:
      return Outcome::refused;
    case EMBXSFAIL:
    case EMBXACK:
    case EMBXSBUSY:
    case EMBXNACK:
    case EMBXMEMPAR:
    case EMBXGPATH:
    case EMBXGTAR:
      return Outcome::unable;
    default:
      return Outcome::gone;
  }
}

}  // namespace

std::string name_of(const Address& address) {
  if (const auto* tcp = std::get_if<TcpAddress>(&address)) return tcp->host + ":" + std::to_string(tcp->port);
  return std::get<RtuAddress>(address).port;
}

void Link::Free::operator()(_modbus* context) const noexcept {
  modbus_close(context);
  modbus_free(context);
}

Link::Link(const Address& address, int unit, double timeout) : context_(context_for(address)) {
  const auto seconds = static_cast<std::uint32_t>(timeout);
  const auto microseconds = static_cast<std::uint32_t>((timeout - std::floor(timeout)) * 1e6);
  if (!context_ || modbus_set_slave(context_.get(), unit) != 0 ||
      modbus_set_response_timeout(context_.get(), seconds, microseconds) != 0 || modbus_connect(context_.get()) != 0) {
    throw DeviceError(name_of(address) + ": " + modbus_strerror(errno));
  }
}

Outcome Link::read(int function, int address, std::span<std::uint16_t> words) noexcept {
  const auto read = function == 3 ? modbus_read_registers : modbus_read_input_registers;
  const int count = static_cast<int>(words.size());
  if (read(context_.get(), address, count, words.data()) == count) return Outcome::ok;
  const int error = errno;
  why_ = modbus_strerror(error);
  return outcome_of(error);
}

void Link::flush() noexcept { modbus_flush(context_.get()); }

}  // namespace emtb::modbus_meter
