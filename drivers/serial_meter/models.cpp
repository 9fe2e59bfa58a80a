#include "drivers/serial_meter/models.h"

#include <algorithm>
#include <array>

#include "drivers/serial_meter/es51922.h"
#include "drivers/serial_meter/fluke.h"
#include "drivers/serial_meter/fs9721.h"
#include "drivers/serial_meter/metex.h"
#include "drivers/serial_meter/scpi.h"

namespace emtb::serial_meter {
namespace {

constexpr std::string_view control_c = "\x03";

constexpr std::array<std::string_view, 2> scpi_requests{"READ?\n", "FUNC?\n"};
constexpr std::array<std::string_view, 1> fluke_requests{"MEAS1?\r"};
constexpr std::array<std::string_view, 1> metex_requests{"D"};

const Protocol scpi_talk{.name = "SCPI",
                         .find = scpi::find,
                         .requests = scpi_requests,
                         .clear = control_c,
                         .barrier = "SYST:ERR?\n",
                         .set_up = scpi::set_up};
const Protocol fluke_talk{.name = "Fluke prompts",
                          .find = fluke::find,
                          .requests = fluke_requests,
                          .clear = control_c,
                          .prompts = true,
                          .set_up = [](const Function& function, double, double) { return fluke::set_up(function); }};
const Protocol metex_talk{.name = "Metex, 14 bytes", .find = metex::find, .requests = metex_requests};
const Protocol fs9721_talk{.name = "FS9721", .find = fs9721::find, .requests = {}};
const Protocol es51922_talk{.name = "ES51922", .find = es51922::find, .requests = {}};

constexpr auto V = Quantity::voltage;
constexpr auto A = Quantity::current;

// The tables of ranges are the makers' digits; where your meter shows others, `resolution` in the bench file counts.
// 6 1/2 digits: 0.3 ppm of the range at 10 power line cycles.
constexpr std::array agilent_ranges{Range{V, 0.1, 3e-8}, Range{V, 1, 3e-7},    Range{V, 10, 3e-6},
                                    Range{V, 100, 3e-5}, Range{V, 1000, 3e-4}, Range{A, 0.01, 3e-9},
                                    Range{A, 0.1, 3e-8}, Range{A, 1, 3e-7},    Range{A, 3, 9e-7}};
// 6 1/2 digits.
constexpr std::array keithley_ranges{Range{V, 0.1, 1e-7}, Range{V, 1, 1e-6},    Range{V, 10, 1e-5},
                                     Range{V, 100, 1e-4}, Range{V, 1000, 1e-3}, Range{A, 0.01, 1e-8},
                                     Range{A, 0.1, 1e-7}, Range{A, 1, 1e-6},    Range{A, 3, 1e-5}};
// 100,000 counts at the slow rate.
constexpr std::array fluke_45_ranges{Range{V, 0.1, 1e-6}, Range{V, 1, 1e-5},    Range{V, 10, 1e-4},
                                     Range{V, 100, 1e-3}, Range{V, 1000, 1e-2}, Range{A, 0.01, 1e-7},
                                     Range{A, 0.1, 1e-6}, Range{A, 10, 1e-4}};
// 200,000 counts at the slow rate.
constexpr std::array fluke_8808a_ranges{Range{V, 0.2, 1e-6},  Range{V, 2, 1e-5},     Range{V, 20, 1e-4},
                                        Range{V, 200, 1e-3},  Range{V, 1000, 1e-2},  Range{A, 200e-6, 1e-9},
                                        Range{A, 2e-3, 1e-8}, Range{A, 20e-3, 1e-7}, Range{A, 200e-3, 1e-6},
                                        Range{A, 2, 1e-5},    Range{A, 10, 1e-4}};
// 4 1/2 digits: 20,000 counts.
constexpr std::array metex_4_ranges{Range{V, 0.2, 1e-5}, Range{V, 2, 1e-4},    Range{V, 20, 1e-3},  Range{V, 200, 1e-2},
                                    Range{V, 1000, 0.1}, Range{A, 2e-3, 1e-7}, Range{A, 0.2, 1e-5}, Range{A, 20, 1e-3}};
// 3 3/4 digits: 4,000 counts.
constexpr std::array fs9721_ranges{Range{V, 0.4, 1e-4},  Range{V, 4, 1e-3},     Range{V, 40, 1e-2},
                                   Range{V, 400, 0.1},   Range{V, 1000, 1},     Range{A, 400e-6, 1e-7},
                                   Range{A, 4e-3, 1e-6}, Range{A, 40e-3, 1e-5}, Range{A, 400e-3, 1e-4},
                                   Range{A, 4, 1e-3},    Range{A, 10, 1e-2}};
// 22,000 counts.
constexpr std::array ut61e_ranges{
    Range{V, 0.22, 1e-5},   Range{V, 2.2, 1e-4},     Range{V, 22, 1e-3},    Range{V, 220, 1e-2},    Range{V, 1000, 0.1},
    Range{A, 220e-6, 1e-8}, Range{A, 2200e-6, 1e-7}, Range{A, 22e-3, 1e-6}, Range{A, 220e-3, 1e-5}, Range{A, 10, 1e-3}};

/// A handheld meter's opto coupler is fed from DTR against RTS.
constexpr LineSettings fed(int baud, int data_bits, Parity parity, int stop_bits) {
  return {.baud = baud, .data_bits = data_bits, .parity = parity, .stop_bits = stop_bits, .dtr = true, .rts = false};
}

// Periods: the makers' readings a second where they say so, else what a frame takes on the wire and a pause. Windows:
// all of the period, where the maker does not say.

/// 10 cycles of 50 Hz, then as long for the automatic zero.
Model scpi_meter(std::string_view name, std::string_view maker, LineSettings line, double period,
                 std::span<const Range> ranges) {
  return {.name = name,
          .maker = maker,
          .protocol = &scpi_talk,
          .line = line,
          .period = period,
          .window = 0.2,
          .line_cycles = 10,
          .ranges = ranges};
}

Model fluke_meter(std::string_view name, std::string_view maker, std::span<const Range> ranges) {
  return {.name = name,
          .maker = maker,
          .protocol = &fluke_talk,
          .line = {.baud = 9600},
          .period = 0.4,
          .window = 0.4,
          .ranges = ranges};
}

Model metex_meter(std::string_view name, std::string_view maker, int baud, double period,
                  std::span<const Range> ranges = {}) {
  return {.name = name,
          .maker = maker,
          .protocol = &metex_talk,
          .line = fed(baud, 7, Parity::none, 2),
          .period = period,
          .window = period,
          .ranges = ranges};
}

Model fs9721_meter(std::string_view name, std::string_view maker, double period) {
  return {.name = name,
          .maker = maker,
          .protocol = &fs9721_talk,
          .line = fed(2400, 8, Parity::none, 1),
          .period = period,
          .window = period,
          .ranges = fs9721_ranges};
}

constexpr LineSettings agilent_line{.baud = 9600, .data_bits = 7, .parity = Parity::even, .stop_bits = 2};
constexpr LineSettings keithley_line{.baud = 4800};

const std::array all_models{
    scpi_meter("agilent_34401a", "HP, Agilent, Keysight 34401A", agilent_line, 0.5, agilent_ranges),
    scpi_meter("keithley_2000", "Keithley 2000", keithley_line, 0.6, keithley_ranges),
    fluke_meter("fluke_45", "Fluke 45", fluke_45_ranges),
    fluke_meter("fluke_8808a", "Fluke 8808A", fluke_8808a_ranges),
    metex_meter("metex_m4650cr", "Metex M-4650CR", 1200, 0.4, metex_4_ranges),
    metex_meter("metex_m3640d", "Metex M-3640D", 1200, 0.4),
    metex_meter("metex_m3650cr", "Metex M-3650CR, M-3650D", 1200, 0.4),
    metex_meter("metex_me31", "Metex ME-31", 600, 0.5),
    metex_meter("mastech_mas345", "Mastech MAS345", 600, 0.5),
    metex_meter("peaktech_3410", "PeakTech 3410", 600, 0.5),
    metex_meter("peaktech_4370", "PeakTech 4370", 1200, 0.4),
    metex_meter("voltcraft_me42", "Voltcraft ME-42", 600, 0.5),
    fs9721_meter("uni_t_ut60e", "UNI-T UT60E", 0.4),
    fs9721_meter("voltcraft_vc840", "Voltcraft VC820, VC840", 0.4),
    fs9721_meter("tekpower_tp4000zc", "TekPower TP4000ZC, Digitek DT4000ZC", 1),
    Model{.name = "uni_t_ut61e",
          .maker = "UNI-T UT61E",
          .protocol = &es51922_talk,
          .line = fed(19200, 7, Parity::odd, 1),
          .period = 0.5,
          .window = 0.5,
          .ranges = ut61e_ranges},
};

}  // namespace

std::span<const Model> models() noexcept { return all_models; }

const Model* model_named(std::string_view name) noexcept {
  const auto found = std::ranges::find(all_models, name, &Model::name);
  return found == all_models.end() ? nullptr : &*found;
}

}  // namespace emtb::serial_meter
