#pragma once

#include <gmock/gmock.h>

#include <string>

#include "hal/error.h"

namespace emtb {

/// The one line that `call` complains with; empty where it does not complain.
template <class Call>
std::string complaint(Call call) {
  try {
    call();
  } catch (const ConfigError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "a message is one line";
    return e.what();
  }
  return "";
}

}  // namespace emtb
