#include "tests/blind/wide/case_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hal/error.h"
#include "session/spec.h"

namespace emtb::blind::wide {
namespace {

using json = nlohmann::ordered_json;

std::string text(double value, int digits) {
  std::array<char, 64> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value, std::chars_format::general, digits);
  return {out.data(), end.ptr};
}

/// A parameter as people write it: a guess of the right size, bounds on either side.
std::string parameter(const std::string& symbol, double value, double min, double max, const char* unit,
                      const std::string& more = "") {
  return "  " + symbol + ": {value: " + text(value, 3) + ", min: " + text(min, 3) + ", max: " + text(max, 3) +
         ", unit: " + unit + more + "}\n";
}

/// The parameters of an effect that the model has from the start.
std::string given_text(const WideCase& c, Draw& draw) {
  const auto& p = c.bench.plant;
  const auto one = [&](const char* symbol, double truth, const char* unit) {
    return std::string(symbol) + ": {value: " + text(truth * draw.within(0.8, 1.2), 3) +
           ", min: " + text(truth / 50, 3) + ", max: " + text(20 * truth, 3) + ", unit: " + unit + "}";
  };
  std::string out;
  for (const std::string& id : c.given) {
    out += "  " + id + ": {";
    if (id == "coulomb_friction") out += one("T_c", p.friction.T_c, "N m");
    if (id == "windage") out += one("c_w", p.motor.windage, "N m s2/rad2");
    if (id == "shaft_compliance") {
      out += one("k", p.shaft.stiffness, "N m/rad") + ", " + one("d", p.shaft.damping, "N m s/rad") + ", " +
             one("J_2", p.shaft.J_2, "kg m2");
    }
    out += "}\n";
  }
  return out;
}

std::uint64_t fnv(std::uint64_t hash, const std::string& bytes) {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

/// Numbers with as many digits as an instrument shows; empty cells where a slow meter has nothing to say.
std::string csv_text(const Run& run) {
  std::vector<double> times;
  for (const auto& [signal, s] : run.signals) {
    if (s.t.size() > times.size()) times = s.t;
  }
  std::string out = "t_s";
  for (const auto& [signal, s] : run.signals) out += "," + std::string(info(signal).column);
  out += "\n";
  std::map<Signal, std::size_t> next;
  for (const double t : times) {
    out += text(t, 10);
    for (const auto& [signal, s] : run.signals) {
      std::size_t& k = next[signal];
      out += ",";
      if (k < s.t.size() && s.t[k] <= t + 1e-9) out += text(s.value[k++], 8);
    }
    out += "\n";
  }
  return out;
}

void write(const std::filesystem::path& path, const std::string& content) {
  std::ofstream out(path);
  out << content;
  if (!out.flush()) throw Error(path.string() + ": cannot be written. Give another folder");
}

json parameters_json(const std::vector<TrueParameter>& list) {
  json out = json::object();
  for (const TrueParameter& p : list) out[p.symbol] = p.value;
  return out;
}

}  // namespace

std::vector<std::string> CaseFiles::arguments() const {
  std::vector<std::string> list{model};
  list.insert(list.end(), train.begin(), train.end());
  if (held_out.empty()) return list;
  list.emplace_back("--held-out");
  list.insert(list.end(), held_out.begin(), held_out.end());
  return list;
}

std::vector<std::pair<std::string, double>> true_base(const WideCase& c) {
  const auto& m = c.bench.plant.motor;
  return {{"R_a", m.R_a}, {"K_b", m.K_b}, {"B", m.B}, {"J", m.J}};
}

std::string model_text(const WideCase& c) {
  const WideBench& b = c.bench;
  const Machine& m = b.machine;
  Draw draw(c.seed ^ 0x6d6f64656cU);
  std::ostringstream out;
  out << "name: " << m.kind << "\ninput: " << (b.logs_reference ? "u_ref" : "e_a") << "\n";
  if (b.logs_reference) {
    out << "driver: {gain: " << text(m.gain, 10);
    if (std::isfinite(m.slew)) out << ", rise: " << text(m.slew, 10) << ", fall: " << text(m.slew, 10);
    out << ", min: " << text(m.both_ways ? -m.voltage : 0, 10) << ", max: " << text(m.voltage, 10) << "}\n";
  }
  out << "tie: {K_m: K_b}\nparameters:\n";
  const auto loose = [&](const char* symbol, double truth, const char* unit) {
    const double start = truth * draw.log_within(0.5, 2);
    std::string more;
    double value = start;
    if (b.resistance_known && std::string(symbol) == "R_a") {
      value = truth * (1 + 0.02 * draw.within(-1, 1));
      more = ", prior: {value: " + text(value, 4) + ", std: " + text(0.02 * truth, 3) + "}";
    }
    out << parameter(symbol, value, truth / b.bounds, truth * b.bounds, unit, more);
  };
  loose("R_a", m.R, "ohm");
  loose("K_b", m.K, "V s/rad");
  out << parameter("B", m.B * draw.log_within(0.3, 3), 0, m.B * 4 * b.bounds, "N m s/rad");
  loose("J", m.J, "kg m2");
  if (c.given.empty()) {
    out << "effects: {}\n";
  } else {
    out << "effects:\n" << given_text(c, draw);
  }
  return out.str();
}

std::string truth_text(const WideCase& c) {
  json base = json::object(), effects = json::array();
  for (const auto& [symbol, value] : true_base(c)) base[symbol] = value;
  for (const Truth& t : c.truths) {
    effects.push_back(
        {{"id", t.id}, {"size", t.size}, {"right", t.right}, {"parameters", parameters_json(t.parameters)}});
  }
  json out{{"case", c.id},         {"seed", c.seed},          {"base", base}, {"hidden", effects}, {"given", c.given},
           {"visible", c.visible}, {"traits", c.bench.traits}};
  if (c.garbage) {
    out["garbage"] = {{"what", c.garbage->what}, {"how", c.garbage->how}, {"contradicted", c.garbage->contradicted}};
  }
  return out.dump(2) + "\n";
}

CaseFiles write_case(const WideCase& c, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  CaseFiles files;
  files.folder = folder;
  const std::string model = model_text(c);
  files.checksum = fnv(0xcbf29ce484222325U, model);
  write(folder / files.model, model);
  write(folder / "truth.json", truth_text(c));
  const auto write_runs = [&](const std::vector<Run>& runs, std::vector<std::string>& names) {
    for (const Run& run : runs) {
      const std::string csv = csv_text(run);
      files.checksum = fnv(files.checksum, csv);
      names.push_back(run.name + (c.bench.csv ? ".csv" : ".h5"));
      const auto path = folder / names.back();
      std::filesystem::remove(path);
      if (c.bench.csv) {
        write(path, csv);
      } else {
        write_session(path, {.runs = {run}, .events = {}, .attributes = {}, .config = {}, .complete = true});
      }
    }
  };
  write_runs(c.train, files.train);
  write_runs(c.held_out, files.held_out);
  write_runs(c.secret, files.secret);
  return files;
}

}  // namespace emtb::blind::wide
