#include <sstream>

#include "emtb/version.h"
#include "export/export_text.h"
#include "export/step_text.h"

namespace emtb {
namespace {

constexpr const char* octave_functions = R"(
function y = clamp(x, low, high)
  y = min(max(x, low), high);
end
function y = positive(x)
  y = double(x > 0);
end
function y = beyond(x, limit)  % x less as much of it as the limit takes
  y = sign(x)*max(abs(x) - limit, 0);
end
function y = slew_end(e, target, rise, fall, h)
  y = clamp(target, e - fall*h, e + rise*h);
end
function y = slew_mean(e, target, rise, fall, h)
  way = target - e;
  if way > 0, travel = rise*h; else, travel = -fall*h; end
  if abs(way) > abs(travel)
    y = e + 0.5*travel;
  elseif way == 0
    y = target;
  else
    y = target - 0.5*way*(way/travel);
  end
end
function y = lag_end(before, start, finish, tau, h)  % a first-order lag behind a ramp
  y = finish;
  if tau > 0
    behind = (finish - start)*tau/h;
    y = finish - behind + (before - start + behind)*exp(-h/tau);
  end
end
function y = mean_sine(x, width)  % the mean of a sine over so much of its angle, about x
  y = sin(x);
  if abs(width) > 1e-6, y = y*sin(0.5*width)/(0.5*width); end
end
function y = carried(h, tau)
  if tau > 0, y = exp(-h/tau); else, y = 0; end
end
function x = drop_for(stopping, ohm, drop, knee)  % what brushes take: V tanh(i/knee), solved for i
  x = 0;
  if drop == 0, return; end
  x = clamp(stopping*drop/(ohm*knee + drop), -drop, drop);
  for n = 1:20
    bend = tanh((stopping - x)/(ohm*knee));
    x = x - (x - drop*bend)/(1 + drop/(ohm*knee)*(1 - bend*bend));
  end
end
function i = reacting(with_all, taken, from, reaction, knee)  % the current of a flux that it weakens itself
  i = with_all;
  if reaction == 0, return; end
  most = taken*reaction;
  low = min(with_all, with_all + most); high = max(with_all, with_all + most); i = clamp(from, low, high);
  for n = 1:100
    x = i/knee; gap = i - with_all - most*x*x/(1 + x*x);
    if abs(gap) <= 1e-13*(abs(with_all) + abs(most)), break; end
    slope = max(0.02, 1 - 2*most*x/(knee*(1 + x*x)*(1 + x*x)));
    next = i - clamp(gap/slope, -0.5*knee, 0.5*knee);
    if gap > 0, high = i; else, low = i; end
    if ~(next > low && next < high), next = 0.5*(low + high); end
    i = next;
  end
end
)";

/// `pow` and `fabs` are called otherwise there.
std::string spelt_in_octave(const std::string& text) { return renamed(spelt(text, "p.", "s."), "pow", "power"); }

}  // namespace

std::string octave_function(const ExportedEquations& x, const std::string& function) {
  const std::string input = input_name(x.input);
  std::ostringstream out;
  out << "function y = " << function << "(t, " << input << ", p, load)\n"
      << "% The motor model `" << x.model << "`, written by emtb " << version
      << ". For Octave and MATLAB. SI units.\n%\n"
      << "%   y = " << function << "(t, " << input << ")   y.omega, y.i_a, y.e_a, y.theta at the times t\n"
      << "%   p = " << function << "()           its parameters, to be changed and given: " << function << "(t, "
      << input << ", p)\n%\n% t [s]: even, steps of 1 ms or less; " << input << " [" << input_unit(x.input)
      << "]: each value held until the next; load [N m]: torque\n"
      << "% that the load takes, a number or one for each time. p.std_error holds the standard errors that are "
         "known.\n";
  for (const std::string& id : x.included) out << "% with " << id << "\n";
  for (const std::string& id : x.left_out) out << "% without " << id << ": it is an instrument's\n";
  out << "  if nargin < 3, p = parameters(); end\n  if nargin < 4, load = 0; end\n"
      << "  if nargin == 0, y = p; return; end\n  if isscalar(load), load = load*ones(size(t)); end\n"
      << "  s = start(p, " << input << "(1));\n"
      << "  y = struct('t', t, 'omega', zeros(size(t)), 'i_a', zeros(size(t)), 'e_a', zeros(size(t)), 'theta', "
         "zeros(size(t)));\n"
      << "  y.e_a(1) = s.e_a; y.i_a(1) = s.i_a;\n  for k = 1:numel(t) - 1\n"
      << "    s = step(s, p, " << input << "(k), load(k), t(k + 1) - t(k));\n"
      << "    y.omega(k + 1) = s.omega; y.i_a(k + 1) = s.i_a; y.e_a(k + 1) = s.e_a; y.theta(k + 1) = s.theta;\n"
      << "  end\nend\n\nfunction p = parameters()\n";
  for (const ExportedParameter& p : x.parameters) {
    out << "  p." << p.name << " = " << exact(p.value) << ";  % [" << p.unit << "] " << p.about << "\n";
    if (p.std_error > 0) out << "  p.std_error." << p.name << " = " << exact(p.std_error) << ";\n";
  }
  out << "end\n\nfunction s = start(p, " << input << ")  % at rest, settled at the first input\n";
  for (const StateText& s : states_of(x)) out << "  s." << s.name << " = 0;  % [" << s.unit << "] " << s.about << "\n";
  if (x.input == Signal::u_ref) {
    out << "  u = u_ref; gain = p.driver_gain; offset = 0; e_min = p.driver_min; e_max = p.driver_max;\n"
        << "  lag = 0; output_resistance = 0;\n";
    for (const ResolvedStatement& s : x.driver) out << "  " << s.term << " = " << spelt_in_octave(s.value) << ";\n";
    out << "  s.e_a = clamp(gain*u + offset, e_min, e_max); s.e_slewed = s.e_a; s.e_driver = s.e_a;\n";
  } else {
    out << (x.input == Signal::e_a ? "  s.e_a = e_a;\n" : "  s.i_a = i_a_ref;\n");
  }
  out << "end\n\nfunction s = step(s, p, " << input << ", load, h)\n";
  for (const ResolvedStatement& a : step_of(x, input).assignments)
    out << "  " << spelt_in_octave(a.term) << " = " << spelt_in_octave(a.value) << ";\n";
  out << "end\n" << octave_functions;
  return out.str();
}

}  // namespace emtb
