#include <sstream>

#include "emtb/version.h"
#include "export/export_text.h"
#include "export/step_text.h"

namespace emtb {
namespace {

constexpr const char* c_functions = R"(
static inline double emtb_clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
static inline double emtb_positive(double x) { return x > 0 ? 1.0 : 0.0; }
static inline double emtb_sign(double x) { return x > 0 ? 1.0 : x < 0 ? -1.0 : 0.0; }
/* x less as much of it as the limit takes */
static inline double emtb_beyond(double x, double limit) { return x > limit ? x - limit : x < -limit ? x + limit : 0.0; }
/* an output that follows its target no faster than its limits: where it is after h, and its mean over h */
static inline double emtb_slew_end(double e, double target, double rise, double fall, double h) {
  return emtb_clamp(target, e - fall * h, e + rise * h);
}
static inline double emtb_slew_mean(double e, double target, double rise, double fall, double h) {
  const double way = target - e, travel = (way > 0 ? rise : -fall) * h;
  if (fabs(way) > fabs(travel)) return e + 0.5 * travel;
  return way == 0 ? target : target - 0.5 * way * (way / travel);
}
/* a first-order lag behind a ramp from start to end */
static inline double emtb_lag_end(double before, double start, double end, double tau, double h) {
  const double behind = tau > 0 ? (end - start) * tau / h : 0.0;
  return tau > 0 ? end - behind + (before - start + behind) * exp(-h / tau) : end;
}
/* the mean of a sine over so much of its angle, about x */
static inline double emtb_mean_sine(double x, double width) {
  return fabs(width) > 1e-6 ? sin(x) * sin(0.5 * width) / (0.5 * width) : sin(x);
}
static inline double emtb_carried(double h, double tau) { return tau > 0 ? exp(-h / tau) : 0.0; }
/* what brushes take of the voltage that is left: V tanh(i/knee), solved for i */
static inline double emtb_drop_for(double stopping, double ohm, double drop, double knee) {
  double x;
  int n;
  if (drop == 0) return 0.0;
  x = emtb_clamp(stopping * drop / (ohm * knee + drop), -drop, drop);
  for (n = 0; n < 20; ++n) {
    const double bend = tanh((stopping - x) / (ohm * knee));
    x -= (x - drop * bend) / (1 + drop / (ohm * knee) * (1 - bend * bend));
  }
  return x;
}
/* the current that a flux leaves which it weakens itself, on from the last one */
static inline double emtb_reacting(double with_all, double taken, double from, double reaction, double knee) {
  const double most = taken * reaction;
  double low = with_all < with_all + most ? with_all : with_all + most;
  double high = with_all < with_all + most ? with_all + most : with_all, i = emtb_clamp(from, low, high);
  int n;
  if (reaction == 0) return with_all;
  for (n = 0; n < 100; ++n) {
    const double x = i / knee, gap = i - with_all - most * x * x / (1 + x * x);
    const double slope = 1 - 2 * most * x / (knee * (1 + x * x) * (1 + x * x));
    const double step = emtb_clamp(gap / (slope > 0.02 ? slope : 0.02), -0.5 * knee, 0.5 * knee);
    double next = i - step;
    if (fabs(gap) <= 1e-13 * (fabs(with_all) + fabs(most))) break;
    if (gap > 0) high = i;
    else low = i;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    i = next;
  }
  return i;
}
)";

std::string spelt_in_c(const std::string& text) {
  std::string out = spelt(text, "p->", "s->");
  out = renamed(out, "abs", "fabs");
  for (const char* name : {"sign", "beyond", "positive", "clamp", "slew_end", "slew_mean", "lag_end", "carried",
                           "drop_for", "reacting", "mean_sine"})
    out = renamed(out, name, std::string("emtb_") + name);
  return out;
}

void start_function(std::ostream& out, const ExportedEquations& x) {
  out << "\n/* At rest, settled at the first input. */\n"
      << "static inline void emtb_start(emtb_state *s, const emtb_parameters *p, double " << input_name(x.input)
      << ") {\n  const emtb_state rest = {0};\n  *s = rest;\n";
  if (x.input == Signal::u_ref) {
    out << "  {\n    double u = u_ref, gain = p->driver_gain, offset = 0, e_min = p->driver_min, e_max = "
           "p->driver_max;\n"
        << "    double rise = p->driver_rise, fall = p->driver_fall, lag = 0, output_resistance = 0;\n";
    for (const ResolvedStatement& s : x.driver) out << "    " << s.term << " = " << spelt_in_c(s.value) << ";\n";
    out << "    (void)rise, (void)fall, (void)lag, (void)output_resistance;\n"
        << "    s->e_slewed = s->e_driver = s->e_a = emtb_clamp(gain * u + offset, e_min, e_max);\n  }\n";
  } else {
    out << "  (void)p;\n  " << (x.input == Signal::e_a ? "s->e_a = e_a;\n" : "s->i_a = i_a_ref;\n");
  }
  out << "}\n";
}

}  // namespace

std::string c_header(const ExportedEquations& x) {
  const std::string input = input_name(x.input);
  std::ostringstream out;
  out << "/* The motor model `" << x.model << "`, written by emtb " << version
      << ". C99; needs math.h alone. SI units.\n *\n"
      << " *   emtb_state s;\n *   emtb_start(&s, &emtb_model, " << input << ");\n *   emtb_step(&s, &emtb_model, "
      << input << ", load, h);      h [s]: 1 ms or less; then read s.omega, s.i_a ...\n *\n"
      << " * " << input << " [" << input_unit(x.input)
      << "] is held over the step; load [N m] is a torque that the load takes, 0 without one.\n";
  for (const std::string& id : x.included) out << " * with " << id << "\n";
  for (const std::string& id : x.left_out) out << " * without " << id << ": it is an instrument's\n";
  out << " */\n#ifndef EMTB_MODEL_H\n#define EMTB_MODEL_H\n#include <math.h>\n\ntypedef struct {\n";
  for (const ExportedParameter& p : x.parameters)
    out << "  double " << p.name << ";  /* [" << p.unit << "] " << p.about << " */\n";
  out << "} emtb_parameters;\n\ntypedef struct {\n";
  for (const StateText& s : states_of(x))
    out << "  double " << s.name << ";  /* [" << s.unit << "] " << s.about << " */\n";
  out << "} emtb_state;\n\nstatic const emtb_parameters emtb_model = {\n";
  for (const ExportedParameter& p : x.parameters) {
    out << "  " << exact(p.value) << ",  /* " << p.name;
    if (p.std_error > 0) out << " +- " << exact(p.std_error);
    out << " */\n";
  }
  out << "};\n" << c_functions;
  start_function(out, x);
  const StepText step = step_of(x, input);
  out << "\nstatic inline void emtb_step(emtb_state *s, const emtb_parameters *p, double " << input
      << ", double load, double h) {\n  double ";
  for (std::size_t i = 0; i < step.locals.size(); ++i)
    out << (i == 0 ? "" : i % 10 == 0 ? ",\n      " : ", ") << step.locals[i];
  out << ";\n";
  for (const ResolvedStatement& s : step.assignments)
    out << "  " << spelt_in_c(s.term) << " = " << spelt_in_c(s.value) << ";\n";
  out << "}\n#endif\n";
  return out.str();
}

}  // namespace emtb
