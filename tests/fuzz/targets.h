#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

/// What reads bytes that others made, each ready to be given any bytes at all.
///
/// The same functions are run by libFuzzer (`cmake --preset fuzz`, tests/fuzz/fuzz.sh) and by fuzz_tests, which replays
/// the kept corpus: tests/fuzz/corpus/TARGET/, seeds and what was found.
namespace emtb::fuzz {

/// A target did what it must not. Anything else that is thrown, a crash, a hang, is a find as well.
class Broken : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void must(bool is_so, const std::string& what) {
  if (!is_so) throw Broken(what);
}

struct Target {
  std::string_view name;
  void (*run)(std::string_view bytes);
};

void csv(std::string_view bytes);
void mapping(std::string_view bytes);
void bench(std::string_view bytes);
void profile(std::string_view bytes);
void model(std::string_view bytes);
void formula(std::string_view bytes);
void rpc_line(std::string_view bytes);
void metex(std::string_view bytes);
void fs9721(std::string_view bytes);
void es51922(std::string_view bytes);
void scpi(std::string_view bytes);
void fluke(std::string_view bytes);
void serial_daq(std::string_view bytes);
void modbus(std::string_view bytes);
void usb1608g(std::string_view bytes);
void hdf5(std::string_view bytes);

inline constexpr std::array targets{Target{"csv", csv},
                                    Target{"mapping", mapping},
                                    Target{"bench", bench},
                                    Target{"profile", profile},
                                    Target{"model", model},
                                    Target{"formula", formula},
                                    Target{"rpc_line", rpc_line},
                                    Target{"metex", metex},
                                    Target{"fs9721", fs9721},
                                    Target{"es51922", es51922},
                                    Target{"scpi", scpi},
                                    Target{"fluke", fluke},
                                    Target{"serial_daq", serial_daq},
                                    Target{"modbus", modbus},
                                    Target{"usb1608g", usb1608g},
                                    Target{"hdf5", hdf5}};

}  // namespace emtb::fuzz
