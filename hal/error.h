#pragma once

#include <stdexcept>
#include <string>

namespace emtb {

/// The one family of exceptions. Each message is a single line for a person: what, where (file, line, key), and what
/// would be right.
///
/// Thrown at start and by tools; never in the control loop, which reports a Fault instead.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A YAML file (bench, profile, model, mapping) is malformed, or says something that cannot be.
class ConfigError : public Error {
 public:
  using Error::Error;
};

/// A recorded session cannot be read, written or used.
class SessionError : public Error {
 public:
  using Error::Error;
};

/// A model, its parameters and the data do not fit together.
class ModelError : public Error {
 public:
  using Error::Error;
};

/// A device cannot be opened or refuses its settings.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// The other end of the socket refuses, is absent, or does not speak the protocol.
class ProtocolError : public Error {
 public:
  using Error::Error;
};

}  // namespace emtb
