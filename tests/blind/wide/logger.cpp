#include "tests/blind/wide/logger.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "drivers/simulated/noise.h"
#include "drivers/simulated/plant.h"
#include "tests/blind/wide/controller.h"

namespace emtb::blind::wide {
namespace {

using simulated::Plant;

/// The truth at one time.
struct Moment {
  double t = 0, e_a = 0, i_a = 0, tacho = 0, omega = 0, theta = 0, torque = 0, charge = 0;
};

Moment moment_of(const Plant& p) {
  return {p.time(), p.e_a(), p.ammeter(), p.tacho(), p.omega(), p.theta(), p.gauge(), p.charge()};
}

double of(const Moment& m, Signal signal) {
  switch (signal) {
    case Signal::e_a:
      return m.e_a;
    case Signal::i_a:
      return m.i_a;
    case Signal::omega:
      return m.tacho;
    case Signal::theta:
      return m.theta;
    case Signal::torque:
      return m.torque;
    default:
      return 0;
  }
}

/// The last moments, so that a sensor can show what was.
class Past {
 public:
  explicit Past(double longest) : longest_(longest) {}

  void add(const Moment& m) {
    moments_.push_back(m);
    while (moments_.size() > 2 && moments_[1].t < m.t - longest_) moments_.pop_front();
  }

  template <class Of>
  double at(double t, const Of& value_of) const {
    auto after = std::ranges::lower_bound(moments_, t, {}, &Moment::t);
    if (after == moments_.end()) return value_of(moments_.back());
    if (after == moments_.begin()) return value_of(*after);
    const Moment& before = *(after - 1);
    const double share = (t - before.t) / (after->t - before.t);
    return value_of(before) + share * (value_of(*after) - value_of(before));
  }

 private:
  double longest_;
  std::deque<Moment> moments_;
};

/// A slow random torque: Ornstein-Uhlenbeck, drawn on a grid and straight between its points.
std::function<double(double)> random_torque(double sigma, double time, double duration, std::uint64_t seed) {
  const double grid = time / 20, keep = std::exp(-1.0 / 20);
  simulated::Noise noise(sigma, keep, seed);
  std::vector<double> values(static_cast<std::size_t>(duration / grid) + 3);
  for (double& v : values) v = noise.next();
  return [=](double t) {
    const double at = std::clamp(t / grid, 0.0, static_cast<double>(values.size()) - 1.001);
    const auto k = static_cast<std::size_t>(at);
    return values[k] + (at - static_cast<double>(k)) * (values[k + 1] - values[k]);
  };
}

/// The plant of one run, whose rotor begins at an angle of its own.
simulated::PlantParameters plant_of(const WideBench& bench, double angle, double duration, std::uint64_t seed) {
  auto p = bench.plant;
  p.shaft.cogging_phase += p.shaft.cogging_order * angle;
  p.load.eccentric_phase += angle;
  p.sensors.ripple_phase += p.sensors.ripple_order * angle;
  if (!p.hidden_torque && bench.model_error == 0) return p;
  std::function<double(double)> slow;
  if (bench.model_error > 0) slow = random_torque(bench.model_error, bench.model_error_time, duration, seed);
  p.hidden_torque = [slow, law = bench.plant.hidden_torque, angle](double omega, double theta, double t) {
    return (slow ? slow(t) : 0) + (law ? law(omega, theta + angle, t) : 0);
  };
  return p;
}

double quantised(double value, double lsb) { return lsb > 0 ? lsb * std::round(value / lsb) : value; }

/// One instrument as it goes through a run.
class Channel {
 public:
  Channel(const Instrument& i, double period, std::uint64_t seed)
      : i_(i), period_(period), noise_(i.noise, i.correlation, simulated::stream(seed, 0, info(i.signal).name)) {}

  void read(std::size_t row, const Moment& now, const Past& past, bool logged, double t, Recording& out) {
    const auto signal = [this](const Moment& m) { return of(m, i_.signal); };
    double exact = past.at(now.t - i_.delay, signal) + i_.offset;
    if (i_.period > 0) {
      const bool due = now.t - since_ > i_.period - period_ / 2;
      exact = due ? (now.charge - charge_) / (now.t - since_) + i_.offset : mean_;
      const double reading = quantised(exact + noise_.next(), i_.lsb);
      if (due) since_ = now.t, charge_ = now.charge, mean_ = exact;
      if (due && logged && row > 0) keep(out, t, reading);
    } else {
      const double noise = noise_.next();
      if (row % static_cast<std::size_t>(i_.hold) == 0 || row == 0)
        value_ = quantised(exact + noise, i_.lsb), exact_ = exact;
      exact = exact_;
      if (logged) keep(out, t, value_);
    }
    if (logged) out.ideal[i_.signal].push_back(exact);
  }

  Signal signal() const { return i_.signal; }
  double value() const { return value_; }

 private:
  void keep(Recording& out, double t, double value) const {
    Series& s = out.run.signals[i_.signal];
    s.lsb = i_.lsb;
    s.window = i_.period;
    s.t.push_back(t);
    s.value.push_back(value);
  }

  Instrument i_;
  double period_;
  simulated::Noise noise_;
  double value_ = 0, exact_ = 0;
  double since_ = 0, charge_ = 0, mean_ = 0;  ///< of a slow meter's window
};

/// The counter behind an encoder.
class Counter {
 public:
  Counter(const Encoder& e, double angle) : e_(e), angle_(angle) {}

  void read(const Moment& now, const Past& past, bool logged, double t, double period, Recording& out) {
    const double theta = past.at(now.t - e_.delay, [](const Moment& m) { return m.theta; });
    const double counts = std::floor((theta + angle_) / e_.step);
    if (!begun_) last_ = counts, last_t_ = now.t - period, begun_ = true;
    speed_ = (counts - last_) * e_.step / (now.t - last_t_);
    last_ = counts, last_t_ = now.t;
    if (logged && !zero_) zero_ = e_.absolute ? 0 : counts;
    angle_read_ = (counts - zero_.value_or(counts)) * e_.step;
    if (!logged) return;
    const bool angle = e_.as == EncoderAs::angle;
    Series& s = out.run.signals[angle ? Signal::theta : Signal::omega];
    s.lsb = angle ? e_.step : e_.step / period;
    s.t.push_back(t);
    s.value.push_back(angle ? angle_read_ : speed_);
    if (out.run.has(Signal::omega) && angle) return;
    out.ideal[Signal::theta].push_back(past.at(now.t - e_.delay, [](const Moment& m) { return m.omega; }));
  }

  double speed() const { return speed_; }
  double angle() const { return angle_read_; }

 private:
  Encoder e_;
  double angle_;
  bool begun_ = false;
  double last_ = 0, last_t_ = 0, speed_ = 0, angle_read_ = 0;
  std::optional<double> zero_;
};

double longest_delay(const WideBench& bench) {
  double longest = bench.encoder.delay;
  for (const Instrument& i : bench.instruments) longest = std::max(longest, i.delay);
  return longest;
}

/// Everything of one run that goes on from row to row.
class Logger {
 public:
  Logger(const WideBench& bench, const Experiment& experiment, std::uint64_t seed)
      : bench_(bench),
        experiment_(experiment),
        draw_(simulated::stream(seed, 1, "logger")),
        angle_(draw_.phase()),
        plant_(plant_of(bench, angle_, experiment.target.duration(), simulated::stream(seed, 2, "model error"))),
        past_(longest_delay(bench) + 2 * bench.period),
        pieces_(longest_delay(bench) > 0 ? 8 : 1),
        controller_(bench),
        counter_(bench.encoder, bench.encoder.absolute ? angle_ : bench.encoder.step * draw_.within(0, 1)) {
    for (const Instrument& i : bench.instruments) channels_.emplace_back(i, bench.period, seed);
    past_.add(moment_of(plant_));
  }

  Recording run(const std::vector<double>& replay) {
    out_.run.name = experiment_.name;
    const auto rows = static_cast<std::size_t>(experiment_.target.duration() / bench_.period);
    for (std::size_t row = 0; row <= rows; ++row) {
      const double planned = static_cast<double>(row) * bench_.period;
      const double t = std::max(planned + bench_.period * bench_.jitter * draw_.within(-1, 1), 0.0);
      advance_to(t);
      const auto next = [&] { return row < replay.size() ? replay[row] : reference(planned); };
      const bool logged = planned >= experiment_.begin;
      if (bench_.read_after) {
        reference_ = next();
        advance_to(t + std::min(1e-6, bench_.period / 1000));
        read(row, t, logged);
      } else {
        read(row, t, logged);
        reference_ = next();
      }
      out_.written.push_back(reference_);
      if (logged) log(Signal::u_ref, stamp(t), reference_);
    }
    if (!bench_.logs_reference) out_.run.signals.erase(Signal::u_ref);
    return std::move(out_);
  }

 private:
  void advance_to(double t) {
    const double left = t - plant_.time();
    if (left <= 0) return;
    for (int n = 0; n < pieces_; ++n) {
      plant_.advance(left / pieces_, reference_);
      past_.add(moment_of(plant_));
    }
  }

  void read(std::size_t row, double t, bool logged) {
    if (logged && !begin_) begin_ = t;
    const Moment now = moment_of(plant_);
    for (Channel& c : channels_) c.read(row, now, past_, logged, stamp(t), out_);
    if (bench_.encoder.as != EncoderAs::none) counter_.read(now, past_, logged, stamp(t), bench_.period, out_);
  }

  double reference(double t) {
    const double target = experiment_.target.reference(t);
    if (bench_.loop == Loop::open) return target;
    double speed = counter_.speed();
    for (const Channel& c : channels_) {
      if (c.signal() == Signal::omega) speed = c.value();
    }
    return controller_.act(target, speed, counter_.angle());
  }

  /// [s] As the log states it: from the first row, to the microsecond.
  double stamp(double t) const { return std::round((t - begin_.value_or(0)) * 1e6) / 1e6; }

  void log(Signal signal, double t, double value) {
    Series& s = out_.run.signals[signal];
    s.t.push_back(t);
    s.value.push_back(value);
  }

  const WideBench& bench_;
  const Experiment& experiment_;
  Draw draw_;
  double angle_;
  Plant plant_;
  Past past_;
  int pieces_;  ///< of a row, where a sensor looks back
  Controller controller_;
  Counter counter_;
  std::vector<Channel> channels_;
  double reference_ = 0;
  std::optional<double> begin_;
  Recording out_;
};

}  // namespace

Recording record(const WideBench& bench, const Experiment& experiment, std::uint64_t seed,
                 const std::vector<double>& replay) {
  return Logger(bench, experiment, seed).run(replay);
}

}  // namespace emtb::blind::wide
