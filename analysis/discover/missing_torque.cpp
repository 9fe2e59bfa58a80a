#include "analysis/discover/missing_torque.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/simulation.h"

namespace emtb {
namespace {

using Deviation = Eigen::Vector3d;  ///< dw, T, V
using Covariance = Eigen::Matrix3d;

/// What was read of one signal in one interval, measured less simulated.
struct Reading {
  double value = 0, variance = 0;
  bool there = false;
};

/// One run in even intervals.
struct Course {
  MissingTorque states;
  std::vector<Reading> speed, current;
  double step = 0;
};

/// The motor about its simulation, over one interval.
struct Motion {
  Covariance advance = Covariance::Identity();
  Eigen::RowVector3d current = Eigen::RowVector3d::Zero();  ///< di
  double per_torque = 0;                                    ///< of dw
};

Motion motion_of(const Model& m, double step) {
  const std::vector<double> p = m.values();
  const double r = p[0], k_b = p[1], k_m = p[2], b = p[3], j = p[4];
  const bool by_voltage = m.input != Signal::i_a;
  const double rate = (b + (by_voltage ? k_m * k_b / r : 0.0)) / j;
  const double stays = std::exp(-rate * step);
  Motion motion;
  motion.per_torque = rate * step > 1e-9 ? (1 - stays) / (rate * j) : step / j;
  motion.advance(0, 0) = stays;
  motion.advance(0, 1) = motion.per_torque;
  if (by_voltage) {
    motion.advance(0, 2) = motion.per_torque * k_m / r;
    motion.current << -k_b / r, 0, 1 / r;
  }
  return motion;
}

/// The mean residual of each interval; a floor that remembers counts for fewer readings.
std::vector<Reading> readings_of(const Record& record, const Observation& o, const Eigen::VectorXd& residual,
                                 double step, std::size_t n) {
  std::vector<Reading> readings(n);
  std::vector<double> count(n, 0.0);
  const std::vector<double>& t = record.excitation.t;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const double at = 0.5 * (t[o.first[i]] + t[o.last[i]]) - t.front();
    const std::size_t k = std::min(n - 1, static_cast<std::size_t>(std::max(0.0, at / step)));
    readings[k].value += residual[static_cast<Eigen::Index>(i)] * o.sigma[i];
    readings[k].variance += o.sigma[i] * o.sigma[i];
    count[k] += 1;
  }
  const double rho = std::clamp(o.autocorrelation, 0.0, 0.99), colour = (1 + rho) / (1 - rho);
  for (std::size_t k = 0; k < n; ++k) {
    if (count[k] == 0) continue;
    const double mean_variance = readings[k].variance / count[k];
    readings[k].value /= count[k];
    readings[k].variance = mean_variance * std::min(1.0, colour / count[k]);
    readings[k].there = readings[k].variance > 0;
  }
  return readings;
}

Course course_of(std::span<const Record> records, std::size_t index, const Model& fitted, double step) {
  const Record& record = records[index];
  const ModelStructure structure = record.structure(fitted);
  const std::vector<double> values = fitted.values(), &t = record.excitation.t;
  Trajectory<double> y;
  simulate<double>(structure, values, record.excitation, y);
  Course course;
  course.step = step;
  course.states.run = record.name;
  const auto n = std::max<std::size_t>(2, static_cast<std::size_t>((t.back() - t.front()) / step) + 1);
  for (std::size_t k = 0, at = 0; k < n; ++k) {
    const double now = t.front() + (static_cast<double>(k) + 0.5) * step;
    while (at + 1 < t.size() && t[at + 1] <= now) ++at;
    const std::size_t next = std::min(at + 1, t.size() - 1);
    MissingTorque& s = course.states;
    s.t.push_back(now);
    s.omega.push_back(y.omega[at]);
    s.i_a.push_back(y.i_a[at]);
    const std::vector<double>& angle = record.excitation.angle;
    s.theta.push_back(angle.empty() ? y.theta[at] : angle[at]);
    s.u_ref.push_back(record.excitation.u_ref.empty() ? 0 : record.excitation.u_ref[at]);
    const double apart = t[next] - t[at];
    s.acceleration.push_back(apart > 0 ? (y.omega[next] - y.omega[at]) / apart : 0);
    if (!std::isfinite(y.omega[at])) throw ModelError(record.name + ": the simulation leaves all bounds");
  }
  course.speed.resize(n);
  course.current.resize(n);
  const std::vector<Residuals> all = residuals(records, index, structure, values, {});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Observation& o = record.observations[i];
    if (o.slow) continue;
    if (o.signal == Signal::omega) course.speed = readings_of(record, o, all[i].value, step, n);
    if (o.signal == Signal::i_a) course.current = readings_of(record, o, all[i].value, step, n);
  }
  return course;
}

struct Walks {
  double torque = 0, voltage = 0;  ///< variance a second
};

/// Takes one reading in. @return its logarithm of the likelihood
double take(const Reading& reading, const Eigen::RowVector3d& sees, Deviation& x, Covariance& p) {
  if (!reading.there) return 0;
  const double variance = (sees * p * sees.transpose()).value() + reading.variance;
  const double off = reading.value - (sees * x).value();
  const Deviation gain = p * sees.transpose() / variance;
  x += gain * off;
  const Covariance reduced = Covariance::Identity() - gain * sees;
  p = reduced * p * reduced.transpose() + gain * reading.variance * gain.transpose();
  return -0.5 * (std::log(variance) + off * off / variance);
}

/// What the filter knew before and after each interval.
struct Passed {
  std::vector<Deviation> x, x_before;
  std::vector<Covariance> p, p_before;
};

double filter(const Course& c, const Motion& motion, const Walks& walks, const Deviation& scale, Passed* keep) {
  Deviation x = Deviation::Zero();
  Covariance p = scale.cwiseAbs2().asDiagonal();
  Covariance grows = Covariance::Zero();
  grows(1, 1) = walks.torque * c.step;
  grows(2, 2) = walks.voltage * c.step;
  grows(0, 0) = motion.per_torque * motion.per_torque * grows(1, 1) / 3;
  grows(0, 1) = grows(1, 0) = 0.5 * motion.per_torque * grows(1, 1);
  const Eigen::RowVector3d speed(1, 0, 0);
  double likelihood = 0;
  for (std::size_t k = 0; k < c.speed.size(); ++k) {
    if (k > 0) {
      x = motion.advance * x;
      p = motion.advance * p * motion.advance.transpose() + grows;
    }
    if (keep != nullptr) {
      keep->x_before.push_back(x);
      keep->p_before.push_back(p);
    }
    likelihood += take(c.speed[k], speed, x, p);
    if (motion.current[2] != 0) likelihood += take(c.current[k], motion.current, x, p);
    if (keep != nullptr) {
      keep->x.push_back(x);
      keep->p.push_back(p);
    }
  }
  return likelihood;
}

/// The inverse of a symmetric positive 3 x 3 matrix whose rows are of different units.
Covariance inverse(const Covariance& p) {
  Deviation scale = p.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0 ? 1 / s : 0;
  Covariance a = scale.asDiagonal() * p * scale.asDiagonal();
  a.diagonal().array() += 1e-10;
  Covariance adjugate;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      adjugate(j, i) = a(i1, j1) * a(i2, j2) - a(i1, j2) * a(i2, j1);
    }
  }
  const double determinant = a.row(0).dot(adjugate.col(0));
  return scale.asDiagonal() * (adjugate / determinant) * scale.asDiagonal();
}

void smooth(Course& c, const Motion& motion, const Walks& walks, const Deviation& scale) {
  Passed passed;
  filter(c, motion, walks, scale, &passed);
  const std::size_t n = passed.x.size();
  for (std::size_t k = n - 1; k-- > 0;) {
    const Covariance gain = passed.p[k] * motion.advance.transpose() * inverse(passed.p_before[k + 1]);
    passed.x[k] += gain * (passed.x[k + 1] - passed.x_before[k + 1]);
    passed.p[k] += gain * (passed.p[k + 1] - passed.p_before[k + 1]) * gain.transpose();
  }
  MissingTorque& s = c.states;
  for (std::size_t k = 0; k < n; ++k) {
    s.omega[k] += passed.x[k][0];
    s.i_a_smoothed.push_back(s.i_a[k] + (motion.current * passed.x[k]).value());
    s.torque.push_back(passed.x[k][1]);
    s.torque_error.push_back(std::sqrt(std::max(0.0, passed.p[k](1, 1))));
    s.voltage.push_back(passed.x[k][2]);
    s.voltage_error.push_back(std::sqrt(std::max(0.0, passed.p[k](2, 2))));
  }
}

/// The walks of largest likelihood: one after the other over eight decades, then finer.
Walks likeliest(std::span<const Course> courses, std::span<const Motion> motions, const Deviation& scale,
                bool voltage) {
  const auto likelihood = [&](const Walks& w) {
    std::vector<double> of(courses.size());
    parallel_for(courses.size(), [&](std::size_t i) { of[i] = filter(courses[i], motions[i], w, scale, nullptr); });
    double sum = 0;
    for (const double l : of) sum += l;
    return sum;
  };
  const double torque = scale[1] * scale[1], volt = scale[2] * scale[2];
  Walks best{1e-4 * torque, voltage ? 1e-4 * volt : 0.0};
  double most = likelihood(best);
  const auto look = [&](double Walks::*which, double from, double to, double times) {
    for (double value = from; value <= to; value *= times) {
      Walks w = best;
      w.*which = value;
      const double l = likelihood(w);
      if (l > most) {
        most = l;
        best = w;
      }
    }
  };
  for (int round = 0; round < 2; ++round) {
    look(&Walks::torque, 1e-8 * torque, 1e3 * torque, 10);
    if (voltage) look(&Walks::voltage, 1e-8 * volt, 1e3 * volt, 10);
  }
  look(&Walks::torque, best.torque / 3, best.torque * 3.1, 3);
  return best;
}

}  // namespace

WhatIsLeft what_is_left(std::span<const Record> records, const Model& fitted) {
  return what_is_left(records, std::vector<Model>(records.size(), fitted));
}

WhatIsLeft what_is_left(std::span<const Record> records, std::span<const Model> fitted) {
  constexpr double intervals = 4000;  // in all: the missing torque changes slower than the readings come
  WhatIsLeft left;
  double seconds = 0, longest_interval = 0;
  for (const Record& r : records) {
    seconds += r.excitation.t.back() - r.excitation.t.front();
    const Observation* current = r.find(Signal::i_a);
    if (current != nullptr && !current->slow && fitted.front().input != Signal::i_a) left.voltage_seen = true;
    longest_interval = std::max(longest_interval, (r.excitation.t.back() - r.excitation.t.front()) /
                                                      static_cast<double>(std::max<std::size_t>(1, r.length() - 1)));
  }
  const double step = std::max(longest_interval, seconds / intervals);
  std::vector<Course> courses(records.size());
  parallel_for(records.size(), [&](std::size_t i) { courses[i] = course_of(records, i, fitted[i], step); });
  double current = 0, speed = 0, count = 0;
  for (const Course& c : courses) {
    for (std::size_t k = 0; k < c.states.t.size(); ++k, ++count) {
      current += c.states.i_a[k] * c.states.i_a[k];
      speed += c.states.omega[k] * c.states.omega[k];
    }
  }
  const std::vector<double> p = fitted.front().values();
  left.torque_scale = p[2] * std::sqrt(current / count);
  left.voltage_scale = p[0] * std::sqrt(current / count);
  const Deviation scale(0.1 * std::sqrt(speed / count) + 1e-12, left.torque_scale + 1e-15,
                        left.voltage_seen ? left.voltage_scale + 1e-12 : 0.0);
  std::vector<Motion> motions;
  for (const Model& of_run : fitted) motions.push_back(motion_of(of_run, step));
  const Walks walks = likeliest(courses, motions, scale, left.voltage_seen);
  left.torque_intensity = walks.torque;
  left.voltage_intensity = walks.voltage;
  parallel_for(courses.size(), [&](std::size_t i) { smooth(courses[i], motions[i], walks, scale); });
  for (Course& c : courses) left.runs.push_back(std::move(c.states));
  return left;
}

}  // namespace emtb
