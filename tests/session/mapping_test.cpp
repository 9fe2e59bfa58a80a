#include "config/mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

class MappingFile : public Scratch {
 protected:
  Mapping mapping(const std::string& text) const { return read_mapping(write("map.yaml", text)); }
  std::string complaint(const std::string& text) const {
    return message_of<ConfigError>([&] { mapping(text); });
  }
};

TEST_F(MappingFile, SaysAllThatTheContractLists) {
  const Mapping m = mapping(
      "time: zeit\nrun: versuch\ncolumns: {theta: {from: pos_m, scale: 2, offset: -1}, i_a: {from: u_V}}\n"
      "window: {i_a: 0.4}\ndelimiter: \";\"\ndecimal: \",\"\n");
  EXPECT_EQ(m.time, "zeit");
  EXPECT_EQ(m.run, "versuch");
  EXPECT_EQ(m.columns.at(Signal::theta).column, "pos_m");
  EXPECT_EQ(m.columns.at(Signal::theta).scale, 2);
  EXPECT_EQ(m.columns.at(Signal::theta).offset, -1);
  EXPECT_EQ(m.columns.at(Signal::i_a).scale, 1);
  EXPECT_EQ(m.window.at(Signal::i_a), 0.4);
  EXPECT_EQ(m.delimiter, ';');
  EXPECT_EQ(m.decimal, ',');
}

TEST_F(MappingFile, NothingButAWindowIsEnough) {
  const Mapping m = mapping("window: {i_a: 0.4}\n");
  EXPECT_EQ(m.time, "t_s");
  EXPECT_TRUE(m.columns.empty());
  EXPECT_EQ(mapping("delimiter: tab\n").delimiter, '\t');
  EXPECT_EQ(mapping("delimiter: \"\\t\"\n").delimiter, '\t');
}

TEST_F(MappingFile, UnitsBecomeAScaleAndAnOffset) {
  const Mapping m = mapping(
      "time: t\ntime_unit: ms\ncolumns: {omega: {from: n, unit: rpm, scale: 2}, temperature: {from: T, unit: degF}}\n");
  EXPECT_DOUBLE_EQ(m.time_scale, 1e-3);
  EXPECT_NEAR(m.columns.at(Signal::omega).scale, 2 * 0.10471976, 1e-8);
  EXPECT_NEAR(m.columns.at(Signal::temperature).scale * 212 + m.columns.at(Signal::temperature).offset, 100, 1e-9);
}

TEST_F(MappingFile, TheTimeMayBeWrittenAsAColumnIs) {
  const Mapping m = mapping("time: {from: clock, unit: ms, scale: 2}\n");
  EXPECT_EQ(m.time, "clock");
  EXPECT_DOUBLE_EQ(m.time_scale, 2e-3);
  EXPECT_THAT(complaint("time: {from: clock, unit: fortnight}\n"), HasSubstr("time.unit is `fortnight`. Write s, ms"));
  EXPECT_THAT(complaint("time: {from: clock, offset: 1}\n"), HasSubstr("time.offset is not known here"));
}

TEST_F(MappingFile, RowsInEvenStepsAndAConstantNeedNoColumn) {
  const Mapping m = mapping("period: 0.02\ncolumns: {omega: {from: n}, u_ref: {value: 600, unit: mV}}\n");
  EXPECT_EQ(m.period, 0.02);
  EXPECT_EQ(m.columns.at(Signal::u_ref).column, "");
  EXPECT_DOUBLE_EQ(m.columns.at(Signal::u_ref).offset, 0.6);
  EXPECT_THAT(complaint("period: 0.02\ntime: t\n"), HasSubstr("map.yaml:1: period stands beside a time"));
  EXPECT_THAT(complaint("period: 0\n"), HasSubstr("period is 0, but must be above 0"));
  EXPECT_THAT(complaint("columns: {u_ref: {value: 6, from: n}}\n"), HasSubstr("columns.u_ref.from is not known here"));
}

TEST_F(MappingFile, ComplaintsNameFileLineAndKey) {
  EXPECT_THAT(complaint("time: t\ncolumn: {}\n"), HasSubstr("map.yaml:2: column is not known here"));
  EXPECT_THAT(complaint("columns:\n  omga: {from: n}\n"),
              HasSubstr("map.yaml:2: columns.omga is not a signal. Signals: u_ref, e_a"));
  EXPECT_THAT(complaint("columns:\n  omega: {scale: 2}\n"), HasSubstr("map.yaml:2: columns.omega.from is missing"));
  EXPECT_THAT(complaint("columns:\n  omega: n\n"),
              HasSubstr("map.yaml:2: columns.omega must be a map of `key: value` lines: write {from: n}"));
  EXPECT_THAT(complaint("columns:\n  omega: {from: n, factor: 2}\n"),
              HasSubstr("columns.omega.factor is not known here"));
  EXPECT_THAT(complaint("columns:\n  omega: {from: n, scale: 0}\n"), HasSubstr("columns.omega.scale is 0"));
  EXPECT_THAT(complaint("columns:\n  omega: {from: n, scale: .nan}\n"),
              HasSubstr("columns.omega.scale must be finite"));
  EXPECT_THAT(complaint("columns:\n  omega: {from: n}\n  omega: {from: m}\n"), HasSubstr("columns.omega stands twice"));
  EXPECT_THAT(complaint("columns: {omega: {from: n}}\nwindow: {i_a: 1}\n"),
              HasSubstr("map.yaml:2: window.i_a has a window but no column"));
  EXPECT_THAT(complaint("window: {i_a: -1}\n"), HasSubstr("window.i_a is -1, but must be above 0"));
  EXPECT_THAT(complaint("delimiter: \",,\"\n"), HasSubstr("delimiter must be one character"));
  EXPECT_THAT(complaint("decimal: \";\"\n"), HasSubstr("decimal must be"));
  EXPECT_THAT(complaint("time_unit: fortnight\n"), HasSubstr("time_unit is `fortnight`. Write s, ms"));
  EXPECT_THAT(complaint("columns:\n  omega: {from: n, unit: knots}\n"),
              HasSubstr("columns.omega.unit is `knots`, but omega is in one of: rad/s, rpm"));
  EXPECT_THAT(complaint("decimal: \",\"\ndelimiter: \",\"\n"),
              HasSubstr("map.yaml:1: decimal is the same for delimiter and decimal"));
  EXPECT_THAT(complaint("- 1\n"), HasSubstr("must be a map"));
}

}  // namespace
}  // namespace emtb
