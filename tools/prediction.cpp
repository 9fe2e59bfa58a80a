#include "tools/prediction.h"

#include <algorithm>
#include <cmath>

#include "config/model.h"
#include "hal/error.h"
#include "model/simulation.h"

namespace emtb {

Session prediction(const Model& model, const Profile& profile, double rate) {
  if (model.input != Signal::u_ref) {
    throw ModelError("model `" + model.name + "` is driven by " + std::string(info(model.input).name) +
                     ": a profile is a driver reference, u_ref");
  }
  Excitation x;
  const auto n = static_cast<std::size_t>(std::floor(profile.duration() * rate)) + 1;
  for (std::size_t k = 0; k < n; ++k) {
    x.t.push_back(static_cast<double>(k) / rate);
    x.u_ref.push_back(profile.reference(x.t.back()));
  }
  Trajectory<double> y;
  const std::vector<double> values = model.values();
  simulate<double>(model.structure(), values, x, y);
  if (!std::ranges::all_of(y.omega, [](double w) { return std::isfinite(w); })) {
    throw ModelError("model `" + model.name +
                     "`: the simulation is not finite. Look at J, R_a and the effects' parameters");
  }
  Run run;
  run.name = profile.name();
  const auto put = [&](Signal signal, const std::vector<double>& values_of) {
    run.signals[signal] = {
        .t = x.t, .value = values_of, .window = 0, .lsb = 0, .source = "simulated by model " + model.name};
  };
  put(Signal::u_ref, x.u_ref);
  put(Signal::e_a, y.e_a);
  put(Signal::i_a, y.i_a);
  put(Signal::omega, y.omega);
  put(Signal::theta, y.theta);
  put(Signal::torque, y.torque);
  Session session;
  session.runs.push_back(std::move(run));
  session.attributes = {{"profile", profile.name()}, {"note", "simulated by model " + model.name}};
  session.config = to_yaml(model);
  return session;
}

}  // namespace emtb
