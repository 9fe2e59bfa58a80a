#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "hal/shared_column.h"
#include "model/dual.h"
#include "model/structure.h"

namespace emtb {

/// What drives a simulated run: values at the times t, each signal empty where the structure does not need it.
struct Excitation {
  SharedColumn<double> t;      ///< [s], increasing; the simulation's readings are at these times
  SharedColumn<double> u_ref;  ///< [V] held from its time to the next
  SharedColumn<double> e_a;    ///< [V] linear in between, or held, but for:
  SharedColumn<double>
      e_a_bulge;               ///< [V] by how much its mean from its time to the next exceeds that of both; empty: 0
  SharedColumn<double> i_a;    ///< [A] of a current drive, held
  SharedColumn<double> load;   ///< [N m] linear in between
  SharedColumn<double> omega;  ///< [rad/s] measured speed, for load effects beside a measured torque
  SharedColumn<double> angle;  ///< [rad] measured, linear in between: what periodic effects see; empty: as simulated
  SharedColumn<double> angle_pull;   ///< [1/s] how fast the rotor comes back to an angle that wanders: 0 where it
                                     ///< stands, for noise does not turn it; held; empty: it is where it is measured
  bool angle_integrated = false;     ///< it is the integral of the speed's reading: noise makes it wander, and a lag
                                     ///< or an offset of the reading, where the model has one, puts it off
  SharedColumn<double> temperature;  ///< [degC] of the armature, held
  std::vector<char> armature_open;   ///< from its time to the next
  double acts_after = 0;  ///< [s] after the readings of its row, before them where negative: when a held input acts;
                          ///< less than an interval
  std::size_t rows_early = 0;       ///< of that time, too: it was written so many rows behind
  bool e_a_held = false;            ///< a voltage that is set, not measured
  bool reads_circuit_late = false;  ///< a voltage or current that moves with the driver is read between the times
  bool reads_shaft_late = false;    ///< a signal that follows the shaft is
  bool reads_means = false;         ///< an instrument averages over a row, or a few
  InitialState initial;
  double longest_step = 2e-3;                                   ///< [s] longer intervals are divided
  double quick_step = std::numeric_limits<double>::infinity();  ///< [s] the same, where an effect is quicker than the
                                                                ///< shaft
};

/// [s] In steps of at most so much the motor is simulated: shorter where an effect is quicker than the shaft.
double longest_step_of(const ModelStructure& structure, const Excitation& excitation);

/// Does a machine that once stands still under held inputs stay so? Not where an effect remembers, repeats with the
/// angle or goes on with the time, nor where an input goes on within a row.
bool keeps_no_past(const ModelStructure& structure, const Excitation& excitation);

/// How many steps a simulation takes: the rows, or more where these are far apart, at most as many in each as such a
/// machine takes to stand still.
std::size_t steps_of(const ModelStructure& structure, const Excitation& excitation);

/// A simulation of a run otherwise than it was recorded, without a copy of the run.
struct Variation {
  std::span<const double> angle = {};  ///< [rad] in place of Excitation::angle; empty: as measured
  bool half_steps = false;             ///< steps of at most half the length: tells what their length does
};

/// How many derivatives one pass carries: one or two vector registers of AVX2, two or four of SSE2
/// (docs/decisions/sensitivities.md).
inline constexpr std::size_t derivatives_per_pass = 4;
using Sensitive = Dual<derivatives_per_pass>;
using WideSensitive = Dual<2 * derivatives_per_pass>;

/// The member for an instrument's signal; the speed's, where there is none.
template <class Readings>
auto& reading_of(Signal signal, Readings& y) {
  switch (signal) {
    case Signal::e_a:
      return y.e_a;
    case Signal::i_a:
      return y.i_a;
    case Signal::torque:
      return y.torque;
    case Signal::theta:
      return y.theta;
    default:
      return y.omega;
  }
}

/// What a driver does between the readings before and these: it stands still, moves straight, and stands still again.
template <class Scalar>
struct DriverMove {
  double from = 0, until = 0;  ///< when it moves, as shares of the interval; at once where they are one
  Scalar before{}, after{};    ///< [A] how fast the current falls before and after it, for each interval
};

/// How the shaft turns between the readings before and these: at a share x of the interval it is faster than at its
/// beginning by rise x + bow x (1 - x), which has the right mean.
template <class Scalar>
struct ShaftCourse {
  double interval = 0;   ///< [s]
  Scalar rise{}, bow{};  ///< [rad/s]
  Scalar bow_current{};  ///< [A] what the bow takes of the current, likewise

  Scalar speed_bow(double share) const { return share * (1 - share) * bow; }
  Scalar current_bow(double share) const { return -share * (1 - share) * bow_current; }
  /// [rad] Of the angle, off a straight line.
  Scalar angle_bow(double share) const {
    const double rest = 1 - share;
    return -interval * share * rest * (0.5 * rise + (1.0 / 6) * (rest - share) * bow);
  }
};

/// What the model predicts that the instruments read on average, between the readings before and these.
template <class Scalar>
struct MeanReadings {
  Scalar e_a{}, i_a{}, omega{};
};

/// What the model predicts that the instruments read at one time.
template <class Scalar>
struct SimulatedReadings {
  const Scalar &e_a, &i_a, &omega, &theta, &torque;
  const DriverMove<Scalar>* move = nullptr;     ///< null: none, or no one asks (Excitation::reads_circuit_late)
  const ShaftCourse<Scalar>* course = nullptr;  ///< null: no one asks (Excitation::reads_shaft_late)
  const MeanReadings<Scalar>* means = nullptr;  ///< null: no one asks (Excitation::reads_means)

  const Scalar& of(Signal signal) const { return reading_of(signal, *this); }
};

/// Takes the readings of a simulation as they come. With derivatives a run is megabytes, which need not be kept to be
/// used once.
template <class Scalar>
class Reader {
 public:
  virtual ~Reader() = default;
  /// @param k place in the times of the excitation; called once for each, in their order
  virtual void read(std::size_t k, const SimulatedReadings<Scalar>& y) = 0;
};

/// Simulates a run.
/// @param parameters R_a, K_b, K_m, B, J, then those of each effect, in the order of the structure; optionally one
/// more, an angle to add to that of the rotor: where a run starts in a turn is seldom known
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& excitation,
              Reader<Scalar>& reader, const Variation& variation = {});

/// The readings that the model predicts at each time of the excitation.
template <class Scalar>
struct Trajectory {
  std::vector<Scalar> e_a, i_a, omega, theta, torque;

  const std::vector<Scalar>& of(Signal signal) const { return reading_of(signal, *this); }

  void resize(std::size_t n) {
    for (auto* signal : {&e_a, &i_a, &omega, &theta, &torque}) signal->resize(n);
  }
};

/// The same, with all readings kept.
/// @param out resized and filled; reuse it to spare allocations
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& excitation,
              Trajectory<Scalar>& out) {
  struct Keep final : Reader<Scalar> {
    explicit Keep(Trajectory<Scalar>& to) : out(to) {}
    void read(std::size_t k, const SimulatedReadings<Scalar>& y) override {
      out.e_a[k] = y.e_a;
      out.i_a[k] = y.i_a;
      out.omega[k] = y.omega;
      out.theta[k] = y.theta;
      out.torque[k] = y.torque;
    }
    Trajectory<Scalar>& out;
  } keep(out);
  out.resize(excitation.t.size());
  simulate(structure, parameters, excitation, static_cast<Reader<Scalar>&>(keep));
}

// These are compiled for several processors, and the one for this machine is taken (model/simulation_code.h).
template <>
void simulate<double>(const ModelStructure& structure, std::span<const double> parameters, const Excitation& excitation,
                      Reader<double>& reader, const Variation& variation);
template <>
void simulate<Sensitive>(const ModelStructure& structure, std::span<const Sensitive> parameters,
                         const Excitation& excitation, Reader<Sensitive>& reader, const Variation& variation);
template <>
void simulate<WideSensitive>(const ModelStructure& structure, std::span<const WideSensitive> parameters,
                             const Excitation& excitation, Reader<WideSensitive>& reader, const Variation& variation);

}  // namespace emtb
