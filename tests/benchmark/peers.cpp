// emtb's innermost loop beside its peers, in one process and in turn: Boost.odeint, the exact recursion of a linear
// motor, and SUNDIALS CVODES. tests/benchmark/run.sh builds and runs it (it is no part of the normal build) and
// docs/performance.md says what is compared. Prints one line of JSON: times in s, errors over the range of the
// reference.
#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include "model/catalogue.h"
#include "model/simulation.h"

namespace {

constexpr double h = 1e-3;
constexpr double R = 1.2, K = 0.042, B = 1e-5, J = 6e-5, L = 1.5e-3, c_w = 1e-8, T_L = 0.01;

std::vector<double> voltage(std::size_t n) {
  std::vector<double> e(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = h * static_cast<double>(k);
    e[k] = 12 * std::sin(2 * t) + 6 * std::sin(31 * t) * std::sin(0.3 * t);
  }
  return e;
}

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// The least time of each, in turn.
std::vector<double> in_turn(const std::vector<std::function<void()>>& works, int repeats) {
  std::vector<double> least(works.size(), std::numeric_limits<double>::infinity());
  for (int r = 0; r < repeats; ++r) {
    for (std::size_t i = 0; i < works.size(); ++i) least[i] = std::min(least[i], seconds_of(works[i]));
  }
  return least;
}

double error(const std::vector<double>& a, const std::vector<double>& right) {
  double worst = 0, range = 0;
  for (std::size_t k = 0; k < right.size(); ++k) {
    worst = std::max(worst, std::abs(a[k] - right[k]));
    range = std::max(range, std::abs(right[k]));
  }
  return worst / range;
}

/// omega after each sample, with `steps` steps of a classical Runge-Kutta between two.
void odeint(const std::vector<double>& e, int steps, std::vector<double>& omega) {
  using State = std::array<double, 1>;
  boost::numeric::odeint::runge_kutta4<State> stepper;
  State x{0};
  omega[0] = 0;
  for (std::size_t k = 0; k + 1 < e.size(); ++k) {
    const auto slope = [&](const State& y, State& dy, double t) {
      const double u = e[k] + (e[k + 1] - e[k]) * (t / h);
      dy[0] = (K * (u - K * y[0]) / R - B * y[0]) / J;
    };
    for (int s = 0; s < steps; ++s) stepper.do_step(slope, x, h * s / steps, h / steps);
    omega[k + 1] = x[0];
  }
}

/// omega(k+1) = a omega(k) + b0 e(k) + b1 e(k+1), exact for a voltage that is linear in between.
void recursion(const std::vector<double>& e, std::vector<double>& omega) {
  const double rate = (K * K / R + B) / J, gain = K / R / J;
  const double a = std::exp(-rate * h), mean = (1 - a) / (rate * h);
  const double b1 = gain / rate * (1 - mean), b0 = gain / rate * (mean - a);
  double x = omega[0] = 0;
  for (std::size_t k = 0; k + 1 < e.size(); ++k) omega[k + 1] = x = a * x + b0 * e[k] + b1 * e[k + 1];
}

struct KeepOmega final : emtb::Reader<double> {
  explicit KeepOmega(std::vector<double>& to) : out(to) {}
  void read(std::size_t k, const emtb::SimulatedReadings<double>& y) override { out[k] = y.omega; }
  std::vector<double>& out;
};

emtb::Excitation driven_by(const std::vector<double>& e) {
  emtb::Excitation x;
  for (std::size_t k = 0; k < e.size(); ++k) x.t.push_back(h * static_cast<double>(k));
  x.e_a = e;
  return x;
}

void simulate() {
  const std::vector<double> e = voltage(60'001);
  const emtb::Excitation x = driven_by(e);
  emtb::ModelStructure structure;
  structure.input = emtb::Signal::e_a;
  structure.measured_voltage = true;
  const std::vector<double> p{R, K, K, B, J};
  std::vector<double> ours(e.size()), theirs(e.size()), exact(e.size()), tight(e.size());
  odeint(e, 40, tight);
  const auto emtb_run = [&] {
    KeepOmega keep(ours);
    emtb::simulate<double>(structure, p, x, keep);
  };
  const std::vector<double> least =
      in_turn({emtb_run, [&] { odeint(e, 1, theirs); }, [&] { recursion(e, exact); }}, 60);
  std::printf(
      "\"simulate\": {\"emtb\": %.6g, \"odeint\": %.6g, \"recursion\": %.6g, \"emtb_error\": %.3g, "
      "\"odeint_error\": %.3g, \"recursion_error\": %.3g}",
      least[0], least[1], least[2], error(ours, tight), error(theirs, tight), error(exact, tight));
}

// ---- sensitivities: i and omega by R, K_b, K_m, B, J, L, c_w, T_L

constexpr std::size_t wanted = 8;
using Eight = std::array<double, wanted>;
constexpr Eight values{R, K, K, B, J, L, c_w, T_L};

/// di/dt and domega/dt of (i, omega), and of their derivatives by the parameters.
void slope(const Eight& p, double e, const double* y, double* dy) {
  dy[0] = (e - p[0] * y[0] - p[1] * y[1]) / p[5];
  dy[1] = (p[2] * y[0] - p[3] * y[1] - p[6] * y[1] * std::abs(y[1]) - p[7]) / p[4];
}
void slope_of_derivative(const Eight& p, std::size_t j, const double* y, const double* dy, const double* s,
                         double* ds) {
  ds[0] = (-p[0] * s[0] - p[1] * s[1]) / p[5];
  ds[1] = (p[2] * s[0] - p[3] * s[1] - 2 * p[6] * std::abs(y[1]) * s[1]) / p[4];
  if (j == 0) ds[0] -= y[0] / p[5];
  if (j == 1) ds[0] -= y[1] / p[5];
  if (j == 2) ds[1] += y[0] / p[4];
  if (j == 3) ds[1] -= y[1] / p[4];
  if (j == 4) ds[1] -= dy[1] / p[4];
  if (j == 5) ds[0] -= dy[0] / p[5];
  if (j == 6) ds[1] -= y[1] * std::abs(y[1]) / p[4];
  if (j == 7) ds[1] -= 1 / p[4];
}

using Columns = std::array<std::vector<double>, wanted>;  // d omega/d p

/// Classical Runge-Kutta on the equations and their derivatives, in small steps.
void reference(const std::vector<double>& e, int steps, Columns& out) {
  constexpr std::size_t size = 2 * (wanted + 1);
  using State = std::array<double, size>;
  State x{};
  boost::numeric::odeint::runge_kutta4<State> stepper;
  for (std::size_t k = 0; k < e.size(); ++k) {
    for (std::size_t j = 0; j < wanted; ++j) out[j][k] = x[2 * j + 3];
    if (k + 1 == e.size()) break;
    const auto all = [&](const State& y, State& dy, double t) {
      slope(values, e[k] + (e[k + 1] - e[k]) * (t / h), y.data(), dy.data());
      for (std::size_t j = 0; j < wanted; ++j) {
        slope_of_derivative(values, j, y.data(), dy.data(), &y[2 * j + 2], &dy[2 * j + 2]);
      }
    };
    for (int s = 0; s < steps; ++s) stepper.do_step(all, x, h * s / steps, h / steps);
  }
}

struct User {
  const std::vector<double>* e;
  std::size_t k = 0;
  double voltage(double t) const { return (*e)[k] + ((*e)[k + 1] - (*e)[k]) * (t / h - static_cast<double>(k)); }
};

int cvodes_slope(double t, N_Vector y, N_Vector dy, void* user) {
  slope(values, static_cast<User*>(user)->voltage(t), NV_DATA_S(y), NV_DATA_S(dy));
  return 0;
}
int cvodes_derivatives(int n, double, N_Vector y, N_Vector dy, N_Vector* s, N_Vector* ds, void*, N_Vector, N_Vector) {
  for (int j = 0; j < n; ++j) {
    slope_of_derivative(values, static_cast<std::size_t>(j), NV_DATA_S(y), NV_DATA_S(dy), NV_DATA_S(s[j]),
                        NV_DATA_S(ds[j]));
  }
  return 0;
}
int cvodes_jacobian(double, N_Vector y, N_Vector, SUNMatrix j, void*, N_Vector, N_Vector, N_Vector) {
  SM_ELEMENT_D(j, 0, 0) = -R / L;
  SM_ELEMENT_D(j, 0, 1) = -K / L;
  SM_ELEMENT_D(j, 1, 0) = K / J;
  SM_ELEMENT_D(j, 1, 1) = (-B - 2 * c_w * std::abs(NV_Ith_S(y, 1))) / J;
  return 0;
}

void cvodes(const std::vector<double>& e, int method, double tolerance, Columns& out) {
  SUNContext context = nullptr;
  SUNContext_Create(nullptr, &context);
  N_Vector y = N_VNew_Serial(2, context);
  N_VConst(0, y);
  N_Vector* s = N_VCloneVectorArray(wanted, y);
  for (std::size_t j = 0; j < wanted; ++j) N_VConst(0, s[j]);
  void* solver = CVodeCreate(method, context);
  User user{&e};
  CVodeInit(solver, cvodes_slope, 0, y);
  CVodeSStolerances(solver, tolerance, tolerance);
  SUNMatrix matrix = SUNDenseMatrix(2, 2, context);
  SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
  CVodeSetLinearSolver(solver, linear, matrix);
  CVodeSetJacFn(solver, cvodes_jacobian);
  CVodeSetUserData(solver, &user);
  CVodeSetMaxNumSteps(solver, 100'000);
  CVodeSensInit(solver, wanted, CV_SIMULTANEOUS, cvodes_derivatives, s);
  Eight scale = values;
  CVodeSetSensParams(solver, nullptr, scale.data(), nullptr);
  CVodeSensEEtolerances(solver);
  CVodeSetSensErrCon(solver, 1);
  for (auto& column : out) column[0] = 0;
  for (std::size_t k = 0; k + 1 < e.size(); ++k) {
    user.k = k;
    const double end = h * static_cast<double>(k + 1);
    double t = 0;
    CVodeSetStopTime(solver, end);  // the voltage has a corner there
    if (CVode(solver, end, y, &t, CV_NORMAL) < 0) std::abort();
    CVodeGetSens(solver, &t, s);
    for (std::size_t j = 0; j < wanted; ++j) out[j][k + 1] = NV_Ith_S(s[j], 1);
  }
  CVodeFree(&solver);
  SUNLinSolFree(linear);
  SUNMatDestroy(matrix);
  N_VDestroyVectorArray(s, wanted);
  N_VDestroy(y);
  SUNContext_Free(&context);
}

struct KeepDerivatives final : emtb::Reader<emtb::WideSensitive> {
  explicit KeepDerivatives(Columns& to) : out(to) {}
  void read(std::size_t k, const emtb::SimulatedReadings<emtb::WideSensitive>& y) override {
    for (std::size_t j = 0; j < wanted; ++j) out[j][k] = y.omega.d[j];
  }
  Columns& out;
};

double worst_error(const Columns& a, const Columns& right) {
  double worst = 0;
  for (std::size_t j = 0; j < wanted; ++j) worst = std::max(worst, error(a[j], right[j]));
  return worst;
}

void sensitivities() {
  const std::vector<double> e = voltage(10'001);
  emtb::Excitation x = driven_by(e);
  emtb::ModelStructure structure;
  structure.input = emtb::Signal::e_a;
  structure.measured_voltage = true;
  structure.effects = {emtb::effect_index("armature_inductance"), emtb::effect_index("windage"),
                       emtb::effect_index("load_torque")};
  std::vector<emtb::WideSensitive> p(values.begin(), values.end());
  for (std::size_t j = 0; j < wanted; ++j) p[j].d[j] = 1;
  Columns ours, theirs, right;
  for (auto* columns : {&ours, &theirs, &right}) {
    for (auto& c : *columns) c.resize(e.size());
  }
  reference(e, 40, right);
  const auto emtb_run = [&] {
    KeepDerivatives keep(ours);
    emtb::simulate<emtb::WideSensitive>(structure, p, x, keep);
  };
  emtb_run();
  const double our_error = worst_error(ours, right);
  double best = std::numeric_limits<double>::infinity(), their_error = 0, emtb_time = best;
  for (const int method : {CV_BDF, CV_ADAMS}) {
    for (double tolerance = 1e-3; tolerance > 1e-12; tolerance /= 4) {
      cvodes(e, method, tolerance, theirs);
      const double now = worst_error(theirs, right);
      if (now > our_error) continue;
      const std::vector<double> least = in_turn({emtb_run, [&] { cvodes(e, method, tolerance, theirs); }}, 5);
      emtb_time = std::min(emtb_time, least[0]);
      if (least[1] < best) best = least[1], their_error = now;
      break;
    }
  }
  std::printf("\"sensitivities\": {\"emtb\": %.6g, \"cvodes\": %.6g, \"emtb_error\": %.3g, \"cvodes_error\": %.3g}",
              emtb_time, best, our_error, their_error);
}

}  // namespace

int main() {
  std::printf("{");
  simulate();
  std::printf(", ");
  sensitivities();
  std::printf("}\n");
}
