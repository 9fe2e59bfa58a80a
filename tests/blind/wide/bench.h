#pragma once

#include <map>
#include <string>
#include <vector>

#include "drivers/simulated/plant_parameters.h"
#include "experiment/profile.h"
#include "hal/signal.h"
#include "tests/blind/wide/machine.h"

namespace emtb::blind::wide {

/// A channel of the log that reads a voltage of some sensor: tachogenerator, shunt, divider, gauge.
struct Instrument {
  Signal signal{};
  double noise = 0;        ///< [SI] sigma
  double correlation = 0;  ///< of the noise from row to row
  double lsb = 0;          ///< [SI] step of the converter
  double delay = 0;        ///< [s] a reading shows what was so long before
  double offset = 0;       ///< [SI]
  int hold = 1;            ///< rows for which a reading stands before the next is taken
  double period = 0;       ///< [s] between readings, each the mean over it (a slow meter); 0: a reading a row

  double sigma() const;  ///< [SI] noise and steps
};

/// What the log holds of an encoder.
enum class EncoderAs {
  none,
  angle,  ///< the counts, as an angle
  speed   ///< the difference of two counts over the time between them
};

struct Encoder {
  EncoderAs as = EncoderAs::none;
  double step = 0;        ///< [rad] a count
  double delay = 0;       ///< [s]
  bool absolute = false;  ///< the angle is that of the shaft, not counted from the run's start
};

enum class Loop { open, speed, position };

/// One run: what is asked of the bench, and from when on it is logged.
struct Experiment {
  std::string name;
  Profile target{"rest", {{0, 0}}};  ///< [V] reference; closed loop: [rad/s] or [rad]
  double begin = 0;                  ///< [s] of the profile at which the log begins
};

/// A bench that nobody tuned anything for.
struct WideBench {
  Machine machine;
  simulated::PlantParameters plant;
  std::vector<Instrument> instruments;
  Encoder encoder;
  double period = 1e-3;     ///< [s] between rows
  double jitter = 0;        ///< times are off by up to this share of a period; the log has the real ones
  bool read_after = false;  ///< the reference of a row is written before its readings are taken
  Loop loop = Loop::open;
  double model_error = 0;         ///< [N m] sigma of a slow random torque (Ornstein-Uhlenbeck)
  double model_error_time = 1;    ///< [s] its correlation time
  bool logs_reference = true;     ///< false: the file has e_a in its place, and the model's input is e_a
  bool csv = true;                ///< files without resolution and window; else HDF5
  double bounds = 5;              ///< the model's bounds are this factor away from the truth, both ways
  bool resistance_known = false;  ///< an ohmmeter's reading of R_a is in the model as a prior
  std::vector<Experiment> train, held_out, secret;
  std::map<std::string, std::string> traits;  ///< what was drawn, in words, for breaking a table down

  const Instrument* find(Signal signal) const;
  Instrument* find(Signal signal);
  bool speed_measured() const { return find(Signal::omega) != nullptr || encoder.as == EncoderAs::speed; }
  /// [rad/s] Floor of the speed, however it is read; of counts over a tenth of tau.
  double speed_sigma() const;
};

/// Draws machine, instruments, timing and experiments; nothing is hidden yet.
WideBench draw_bench(Draw& draw);

}  // namespace emtb::blind::wide
