#include "tools/prediction.h"

#include "analysis/diagnose/foresee.h"
#include "config/model.h"
#include "hal/error.h"

namespace emtb {

Session prediction(const Model& model, const Profile& profile, double rate) {
  const std::optional<Foreseen> foreseen = foresee(model, profile, 1 / rate);
  if (!foreseen) {
    throw ModelError("model `" + model.name +
                     "`: the simulation is not finite. Look at J, R_a and the effects' parameters");
  }
  const auto& [x, y] = *foreseen;
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
