#include "hal/signal.h"

#include <algorithm>

namespace emtb {
namespace {

constexpr std::array<Signal, signal_count> signals{Signal::u_ref, Signal::e_a,         Signal::i_a,
                                                   Signal::omega, Signal::theta,       Signal::torque,
                                                   Signal::i_f,   Signal::temperature, Signal::armature_open};

constexpr std::array<SignalInfo, signal_count> infos{{
    {"u_ref", "V", "u_ref_V", "driver reference"},
    {"e_a", "V", "e_a_V", "terminal voltage of the armature"},
    {"i_a", "A", "i_a_A", "armature current"},
    {"omega", "rad/s", "omega_rad_s", "angular velocity"},
    {"theta", "rad", "theta_rad", "encoder angle"},
    {"torque", "N m", "torque_Nm", "shaft torque taken by the load"},
    {"i_f", "A", "i_f_A", "field current"},
    {"temperature", "degC", "temperature_degC", "temperature"},
    {"armature_open", "1", "armature_open", "armature circuit open (1) or closed (0)"},
}};

template <class Key>
std::optional<Signal> find(std::string_view text, Key key) noexcept {
  const auto found = std::ranges::find_if(signals, [&](Signal s) { return infos[index(s)].*key == text; });
  return found == signals.end() ? std::nullopt : std::optional{*found};
}

}  // namespace

const std::array<Signal, signal_count>& all_signals() noexcept { return signals; }

const SignalInfo& info(Signal signal) noexcept { return infos[index(signal)]; }

std::optional<Signal> signal_named(std::string_view name) noexcept { return find(name, &SignalInfo::name); }

std::optional<Signal> signal_of_column(std::string_view column) noexcept { return find(column, &SignalInfo::column); }

}  // namespace emtb
