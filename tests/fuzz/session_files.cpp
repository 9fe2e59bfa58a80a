#include <algorithm>
#include <cmath>

#include "config/mapping.h"
#include "session/csv.h"
#include "session/hdf5.h"
#include "tests/fuzz/file_of.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

/// What every reader of sessions promises.
void must_be_whole(const Session& session) {
  must(!session.runs.empty(), "a session has a run");
  for (const Run& run : session.runs) {
    must(!run.signals.empty(), "a run has a signal");
    for (const auto& [signal, series] : run.signals) {
      must(series.t.size() == series.value.size(), "each value has its time");
      must(std::ranges::all_of(series.t, [](double t) { return std::isfinite(t); }), "times are finite");
      must(std::ranges::adjacent_find(series.t, std::greater_equal()) == series.t.end(), "time increases");
      must(std::ranges::all_of(series.value, [](double v) { return std::isfinite(v); }), "values are finite");
      must(series.window >= 0 && series.lsb >= 0, "window and resolution are lengths");
    }
  }
}

/// What the first byte chooses: the contract's columns, or others.
const std::vector<Mapping>& mappings() {
  static const std::vector<Mapping> all = [] {
    std::vector<Mapping> some(1);
    for (const char* text : {"time: t\nrun: run\ncolumns: {omega: {from: w, scale: 2}, i_a: {from: u, unit: mA}}\n"
                             "window: {i_a: 0.4}\n",
                             "time: t_s\ntime_unit: ms\ndelimiter: \";\"\ndecimal: \",\"\n"}) {
      some.push_back(read_mapping(FileOf(text).path()));
    }
    return some;
  }();
  return all;
}

}  // namespace

void csv(std::string_view bytes) {
  const std::size_t which = bytes.empty() ? 0 : static_cast<unsigned char>(bytes[0]) % (2 * mappings().size());
  const bool chosen = which >= mappings().size();  // otherwise the first byte belongs to the file
  const FileOf file(chosen ? bytes.substr(1) : bytes);
  read_or_refused([&] {
    const Session session = read_csv(file.path(), mappings()[chosen ? which - mappings().size() : 0]);
    must_be_whole(session);
    const FileOf copy("");
    write_csv(copy.path(), session);
    const Session again = read_csv(copy.path());
    must(again.runs.size() == session.runs.size(), "what was written has the same runs");
    for (std::size_t r = 0; r < session.runs.size(); ++r) {
      must(again.runs[r].signals.size() == session.runs[r].signals.size(), "and the same signals");
    }
  });
}

void mapping(std::string_view bytes) {
  const FileOf file(bytes);
  const FileOf table("t,w,u,run\n0,1,2,a\n0.1,2,3,a\n");
  read_or_refused([&] { must_be_whole(read_csv(table.path(), read_mapping(file.path()))); });
}

/// The library that reads HDF5 may crash, in a child; whoever calls the reader may not.
void hdf5(std::string_view bytes) {
  const FileOf file(bytes);
  read_or_refused([&] { must_be_whole(read_hdf5(file.path())); });
}

}  // namespace emtb::fuzz
