#include "analysis/record/thinned.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace emtb {
namespace {

/// The rows that stay, evenly spread, the first and the last among them.
std::vector<std::size_t> kept_rows(const Record& record) {
  const std::vector<double>& t = record.excitation.t;
  std::vector<std::size_t> rows;
  for (std::size_t k = 0; k + 1 < t.size(); ++k) {
    if (rows.empty() || t[k + 1] - t[rows.back()] > record.excitation.longest_step) rows.push_back(k);
  }
  if (!t.empty()) rows.push_back(t.size() - 1);
  return rows;
}

/// A column with those of its rows; empty where it is.
template <class Column>
Column at(const Column& column, const std::vector<std::size_t>& rows) {
  Column kept;
  if (column.empty()) return kept;
  for (const std::size_t row : rows) kept.push_back(column[row]);
  return kept;
}

InputNoise at(const InputNoise& noise, const std::vector<std::size_t>& rows) {
  return {at(noise.sigma, rows), at(noise.correlated, rows), at(noise.change, rows)};
}

Excitation at(const Excitation& x, const std::vector<std::size_t>& rows) {
  Excitation kept = x;
  kept.t = at(x.t, rows);
  kept.u_ref = at(x.u_ref, rows);
  kept.e_a = at(x.e_a, rows);
  kept.e_a_bulge.clear();
  kept.i_a = at(x.i_a, rows);
  kept.load = at(x.load, rows);
  kept.omega = at(x.omega, rows);
  kept.angle = at(x.angle, rows);
  kept.angle_pull = at(x.angle_pull, rows);
  kept.temperature = at(x.temperature, rows);
  kept.armature_open = at(x.armature_open, rows);
  kept.acts_after = 0;
  kept.rows_early = 0;
  kept.reads_circuit_late = kept.reads_shaft_late = kept.reads_means = false;
  return kept;
}

/// The means of what was read between two rows, so that nothing is lost of what noise lets through.
/// @param every [rows] of those before, on average
Observation at(const Observation& o, const std::vector<std::size_t>& rows, double every) {
  Observation kept;
  kept.signal = o.signal;
  kept.functional = Functional::mean;
  kept.origin = o.origin;
  kept.autocorrelation = std::pow(o.autocorrelation, every);
  kept.lsb = o.lsb;
  kept.window = o.window;
  kept.slow = true;
  const double remembered = (1 + o.autocorrelation) / (1 - o.autocorrelation);  // of the variance of a long mean
  std::size_t i = 0;
  for (std::size_t row = 1; row < rows.size(); ++row) {
    double sum = 0, variance = 0, count = 0, begin = 0, end = 0;
    for (; i < o.size() && o.last[i] <= rows[row]; ++i) {
      if (count == 0) begin = o.begin[i];
      end = o.end[i];
      sum += o.value[i];
      variance += o.sigma[i] * o.sigma[i];
      ++count;
    }
    if (count == 0) continue;
    kept.begin.push_back(begin);
    kept.end.push_back(end);
    kept.first.push_back(static_cast<std::uint32_t>(row - 1));
    kept.last.push_back(static_cast<std::uint32_t>(row));
    kept.value.push_back(sum / count);
    kept.sigma.push_back(std::sqrt(variance / count * std::min(1.0, remembered / count)));
  }
  return kept;
}

}  // namespace

Record thinned(const Record& record) {
  const std::vector<std::size_t> rows = kept_rows(record);
  if (2 * rows.size() > record.length()) return record;
  const double every = static_cast<double>(record.length()) / static_cast<double>(rows.size());
  Record kept = record;
  kept.excitation = at(record.excitation, rows);
  kept.voltage_noise = at(record.voltage_noise, rows);
  kept.load_noise = at(record.load_noise, rows);
  kept.observations.clear();
  for (const Observation& o : record.observations) kept.observations.push_back(at(o, rows, every));
  return kept;
}

}  // namespace emtb
