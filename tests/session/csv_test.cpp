#include "session/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

class Csv : public Scratch {
 protected:
  Session session(const std::string& text, const Mapping& mapping = {}) const {
    return read_csv(write("steps.csv", text), mapping);
  }
  Run only_run(const std::string& text, const Mapping& mapping = {}) const {
    const Session s = session(text, mapping);
    EXPECT_EQ(s.runs.size(), 1u);
    return s.runs.at(0);
  }
  /// The complaint about that text, from the file's name on.
  std::string complaint(const std::string& text, const Mapping& mapping = {}) const {
    const std::string message = message_of<SessionError>([&] { session(text, mapping); });
    const std::string folder = path("").string();
    EXPECT_THAT(message, StartsWith(folder));
    return message.substr(std::min(folder.size(), message.size()));
  }
};

TEST_F(Csv, ReadsTheContractsColumnsInAnyOrder) {
  const Run run = only_run("omega_rad_s,t_s,u_ref_V\n1.5,0,2\n-2.5e1,0.001,3\n");
  EXPECT_THAT(run.at(Signal::omega).t, ElementsAre(0, 0.001));
  EXPECT_THAT(run.at(Signal::omega).value, ElementsAre(1.5, -25));
  EXPECT_THAT(run.at(Signal::u_ref).value, ElementsAre(2, 3));
  EXPECT_EQ(run.at(Signal::omega).source, "omega_rad_s");
  EXPECT_FALSE(run.has(Signal::i_a));
  EXPECT_EQ(run.duration(), 0.001);
}

TEST_F(Csv, AnEmptyCellIsNoReadingAndNothingIsInterpolated) {
  const Run run = only_run("t_s,omega_rad_s,i_a_A\n0,1,\n0.1,2,\n0.2,3,0.7\n0.3,4,\n0.4,5,0.9\n");
  EXPECT_THAT(run.at(Signal::i_a).t, ElementsAre(0.2, 0.4));
  EXPECT_THAT(run.at(Signal::i_a).value, ElementsAre(0.7, 0.9));
  EXPECT_EQ(run.at(Signal::omega).t.size(), 5u);
  EXPECT_TRUE(is_sparse(run, Signal::i_a));
  EXPECT_FALSE(is_sparse(run, Signal::omega));
}

TEST_F(Csv, AColumnWithoutAnyReadingIsNoSignal) {
  EXPECT_FALSE(only_run("t_s,omega_rad_s,i_a_A\n0,1,\n1,2,\n").has(Signal::i_a));
}

TEST_F(Csv, KnowsWhenTheMeansOfASlowMeterBegan) {
  const Run run = only_run("t_s,omega_rad_s,i_a_A\n0,0,\n0.2,0,\n0.4,0,1\n0.6,0,\n0.8,0,2\n1,0,\n1.2,0,3\n");
  EXPECT_DOUBLE_EQ(window_start(run.at(Signal::i_a), 0), 0);
  EXPECT_DOUBLE_EQ(window_start(run.at(Signal::i_a), 2), 0.8);
  Mapping mapping;
  mapping.window[Signal::i_a] = 0.1;
  const Run narrow = only_run("t_s,omega_rad_s,i_a_A\n0,0,1\n0.4,0,2\n", mapping);
  EXPECT_EQ(narrow.at(Signal::i_a).window, 0.1);
  EXPECT_DOUBLE_EQ(window_start(narrow.at(Signal::i_a), 1), 0.3);
}

TEST_F(Csv, UnderstandsWhatSpreadsheetsMakeOfIt) {
  const Run run = only_run("\xEF\xBB\xBF\"t_s\" , \"omega_rad_s\"\r\n 0 ,\t\"1.5\" \r\n\r\n1,+2\r\n");
  EXPECT_THAT(run.at(Signal::omega).t, ElementsAre(0, 1));
  EXPECT_THAT(run.at(Signal::omega).value, ElementsAre(1.5, 2));
}

TEST_F(Csv, TheLastLineNeedsNoNewline) {
  EXPECT_THAT(only_run("t_s,omega_rad_s\n0,1\n1,2").at(Signal::omega).value, ElementsAre(1, 2));
}

TEST_F(Csv, ReadsDecimalCommasWhereTheMappingSaysSo) {
  Mapping mapping;
  mapping.delimiter = ';';
  mapping.decimal = ',';
  EXPECT_THAT(only_run("t_s;omega_rad_s\n0,5;1,25\n1;-3\n", mapping).at(Signal::omega).value, ElementsAre(1.25, -3));
  EXPECT_THAT(complaint("t_s;omega_rad_s\n0;1.234,5\n", mapping),
              StartsWith("steps.csv:2: column omega_rad_s: `1.234,5` is not"));
}

TEST_F(Csv, SeesSemicolonsTabsAndDecimalCommasByItself) {
  EXPECT_THAT(only_run("t_s;omega_rad_s\n0,5;1,25\n1;-3\n").at(Signal::omega).value, ElementsAre(1.25, -3));
  EXPECT_THAT(only_run("t_s;omega_rad_s\n0.5;1.25\n1;-3\n").at(Signal::omega).value, ElementsAre(1.25, -3));
  EXPECT_THAT(only_run("t_s\tomega_rad_s\n0,5\t1,25\n").at(Signal::omega).value, ElementsAre(1.25));
  EXPECT_THAT(complaint("t_s;omega_rad_s\n0;1.234,5\n"),
              StartsWith("steps.csv:2: column omega_rad_s: `1.234,5` is not"))
      << "neither sign is the decimal one for sure";
}

TEST_F(Csv, ColumnsNamedLikeTheContractsMayBeInAnotherUnit) {
  const Run run = only_run("t_s,omega_rpm,theta_deg,i_a_mA,torque_Ncm,temperature_K\n0,1500,90,250,12,293.15\n");
  EXPECT_NEAR(run.at(Signal::omega).value[0], 157.0796, 1e-4);
  EXPECT_NEAR(run.at(Signal::theta).value[0], 1.570796, 1e-6);
  EXPECT_DOUBLE_EQ(run.at(Signal::i_a).value[0], 0.25);
  EXPECT_DOUBLE_EQ(run.at(Signal::torque).value[0], 0.12);
  EXPECT_NEAR(run.at(Signal::temperature).value[0], 20, 1e-9);
}

TEST_F(Csv, AHeadShowsWhoNamesTheColumnsTheFirstCells) {
  std::string text = "Time [ms];omega_rpm;i_a_A;\"my \"\"own\"\"\"\n";
  for (int row = 0; row < 40000; ++row) text += std::to_string(row) + ";1,5;-2;x\n";
  const CsvHead head = read_csv_head(write("steps.csv", text), 2);
  ASSERT_EQ(head.columns.size(), 4u);
  EXPECT_EQ(head.delimiter, ';');
  EXPECT_EQ(head.decimal, ',');
  EXPECT_TRUE(head.columns[0].is_time);
  EXPECT_THAT(head.columns[0].cells, ElementsAre("0", "1"));
  EXPECT_EQ(head.columns[1].signal, Signal::omega);
  EXPECT_EQ(head.columns[1].unit, "rpm");
  EXPECT_EQ(head.columns[2].unit, "A");
  EXPECT_EQ(head.columns[3].name, "my \"own\"");
  EXPECT_FALSE(head.columns[3].signal);
  EXPECT_THAT(read_csv_head(write("short.csv", "a;b\n1\n"), 5).columns[1].cells, ElementsAre());
  EXPECT_THAT(message_of<SessionError>([&] { read_csv_head(write("empty.csv", ""), 5); }), HasSubstr("no line"));
  EXPECT_THAT(message_of<SessionError>([&] { read_csv_head(path("nowhere.csv"), 5); }), HasSubstr("no file"));
}

TEST_F(Csv, OfTwoColumnsOfOneSignalNoneIsDroppedInSilence) {
  EXPECT_THAT(message_of<SessionError>([&] { session("t_s,omega_rpm,omega_deg_s\n0,1,2\n"); }),
              HasSubstr("columns `omega_rpm` and `omega_deg_s` are both omega. Rename the one that shall not count"));
}

TEST_F(Csv, WhatNoBenchReadsIsRefused) {
  EXPECT_THAT(message_of<SessionError>([&] { session("t_s,omega_rad_s\n0,1\n1,-1e308\n"); }),
              HasSubstr(":3: column omega_rad_s: -1e+308 is no reading of a bench"));
}

TEST_F(Csv, ARunColumnSplitsTheFileAndEachRunStartsAtZero) {
  const Session s = session("run,t_s,omega_rad_s\nb,10,1\nb,10.1,2\na,3.1,3\nb,10.2,4\na,3.2,5\n");
  ASSERT_EQ(s.runs.size(), 2u);
  EXPECT_EQ(s.runs[0].name, "b");
  EXPECT_EQ(s.runs[1].name, "a");
  EXPECT_THAT(s.runs[0].at(Signal::omega).t, ElementsAre(0, 0.1, 0.2));
  EXPECT_THAT(s.runs[0].at(Signal::omega).value, ElementsAre(1, 2, 4));
  EXPECT_THAT(s.runs[1].at(Signal::omega).t, ElementsAre(0, 0.1));
}

TEST_F(Csv, AMappingRenamesScalesAndSplits) {
  Mapping mapping;
  mapping.time = "zeit";
  mapping.run = "versuch";
  mapping.columns[Signal::omega] = {.column = "n", .scale = 0.1, .offset = 1};
  mapping.columns[Signal::armature_open] = {.column = "powered", .scale = -1, .offset = 1};
  const Session s = session("versuch,zeit,n,powered,t_s,i_a\nx,0,10,1,,\ny,5,20,0,,\n", mapping);
  ASSERT_EQ(s.runs.size(), 2u);
  EXPECT_THAT(s.runs[0].at(Signal::omega).value, ElementsAre(2));
  EXPECT_THAT(s.runs[0].at(Signal::armature_open).value, ElementsAre(0));
  EXPECT_THAT(s.runs[1].at(Signal::armature_open).value, ElementsAre(1));
  EXPECT_EQ(s.runs[0].at(Signal::omega).source, "n");
}

TEST_F(Csv, RowsInEvenStepsNeedNoTimeAndAConstantNoColumn) {
  Mapping mapping;
  mapping.period = 0.02;
  mapping.run = "try";
  mapping.columns[Signal::omega] = {.column = "n"};
  mapping.columns[Signal::u_ref] = {.column = "", .offset = 6, .constant = true};
  const Session s = session("try,n\na,1\na,2\na,3\nb,4\nb,5\n", mapping);
  ASSERT_EQ(s.runs.size(), 2U);
  EXPECT_THAT(s.runs[0].at(Signal::omega).t, ElementsAre(0, 0.02, 0.04));
  EXPECT_THAT(s.runs[0].at(Signal::u_ref).value, ElementsAre(6, 6, 6));
  EXPECT_THAT(s.runs[1].at(Signal::omega).t, ElementsAre(0, 0.02)) << "each run by itself";
  mapping.columns[Signal::u_ref].constant = false;
  EXPECT_THAT(complaint("try,n\na,1\n", mapping), StartsWith("steps.csv:1: no column ``")) << "a name left out";
  EXPECT_THAT(complaint("try,n\na,1\n"), HasSubstr("say so with --map, period: SECONDS"));
}

TEST_F(Csv, ForeignColumnsArePassedOver) {
  const Run run = only_run("t_s,omega_rad_s,omega_ref,note,omega_rpm\n0,1,x,\"hello, world\",9.5\n");
  EXPECT_EQ(run.signals.size(), 1u) << "omega is there, so omega_rpm is no loss";
}

TEST_F(Csv, AColumnThatIsNearlyASignalIsPointedOut) {
  for (const std::string column :
       {"i_a", "I_a", "ia_A", "omega", "Omega [rad/s]", "omga_rad_s", "theta_degrees", "E_A_V", "armature_opn"}) {
    const std::string near = complaint("t_s,x," + column + "\n0,1,2\n");
    EXPECT_THAT(near, AllOf(StartsWith("steps.csv:1: column `" + column + "` looks like "), HasSubstr("--map")))
        << column;
  }
  for (const std::string column : {"omega_ref", "id", "iac", "theta_m", "index", "torque_reference_Nm", "u_rel"}) {
    EXPECT_THAT(complaint("t_s," + column + "\n0,1\n"), StartsWith("steps.csv:1: no column that emtb knows")) << column;
  }
}

TEST_F(Csv, ComplaintsSayWhereAndWhatWouldBeRight) {
  const std::string head = "t_s,u_ref_V,omega_rad_s\n";
  EXPECT_THAT(complaint(""), AllOf(StartsWith("steps.csv: is empty"), HasSubstr("t_s,u_ref_V,omega_rad_s")));
  EXPECT_THAT(complaint("\n \r\n\n"), StartsWith("steps.csv: is empty"));
  EXPECT_THAT(complaint(head), StartsWith("steps.csv:1: has column names but no rows"));
  EXPECT_THAT(complaint("time,omega_rad_s\n0,1\n"),
              AllOf(StartsWith("steps.csv:1: no column `t_s`"), HasSubstr("time: time"),
                    EndsWith("Columns here: time, omega_rad_s")));
  EXPECT_THAT(complaint("t_s|omega_rad_s\n0|1\n"), HasSubstr("delimiter: \"|\""));
  EXPECT_THAT(complaint("0,1,2\n"), StartsWith("steps.csv:1: no column `t_s`"));
  EXPECT_THAT(complaint("t_s,omega_rad_s,omega_rad_s\n0,1,2\n"),
              StartsWith("steps.csv:1: column `omega_rad_s` stands twice"));
  EXPECT_THAT(complaint(head + "0,1,nan\n"),
              StartsWith("steps.csv:2: column omega_rad_s: `nan` is not a finite number. Leave"));
  EXPECT_THAT(complaint(head + "0,1,2\n1,-inf,2\n"), StartsWith("steps.csv:3: column u_ref_V: `-inf` is not a finite"));
  EXPECT_THAT(complaint(head + "0,1,1e999\n"), StartsWith("steps.csv:2: column omega_rad_s: `1e999` is not a finite"));
  EXPECT_THAT(complaint(head + "0,1,abc\n"), StartsWith("steps.csv:2: column omega_rad_s: `abc` is not a number"));
  EXPECT_THAT(complaint(head + "0,1,1.5x\n"), StartsWith("steps.csv:2: column omega_rad_s: `1.5x` is not a number"));
  EXPECT_THAT(complaint(head + "0,1,\"1,5\"\n"), HasSubstr("decimal: \",\""));
  EXPECT_THAT(complaint(head + ",1,2\n"), StartsWith("steps.csv:2: column t_s is empty"));
  EXPECT_THAT(complaint(head + "0,1\n1,2,3\n"), StartsWith("steps.csv:2: 2 cells instead of 3. Leave cells without"));
  EXPECT_THAT(complaint(head + "0,1,2,3\n"), StartsWith("steps.csv:2: 4 cells instead of 3"));
  EXPECT_THAT(complaint(head + "0,1,2\n1,2"),
              StartsWith("steps.csv:3: the last line is cut off: 2 cells instead of 3"));
  EXPECT_THAT(complaint(head + "0,,\n"), StartsWith("steps.csv: every cell of every signal is empty"));
  EXPECT_THAT(complaint(head + "0,\"1,2\n"), StartsWith("steps.csv:2: a quote is opened"));
  EXPECT_THAT(complaint(head + "0,\"1\"x,2\n"), StartsWith("steps.csv:2: text follows the closing quote"));
  EXPECT_THAT(complaint("t_s,omega_rad_s,armature_open\n0,1,0.5\n"),
              StartsWith("steps.csv:2: column armature_open: armature_open is 0.5"));
  EXPECT_THAT(complaint("\xFF\xFEt\0_\0"), HasSubstr("UTF-16"));
}

TEST_F(Csv, TimeMustIncreaseWithinARun) {
  std::string text = "t_s,omega_rad_s\n";
  for (int i = 1; i <= 15; ++i) text += std::to_string(i / 10) + "." + std::to_string(i % 10) + ",0\n";
  EXPECT_THAT(complaint(text + "1.0,0\n"),
              AllOf(StartsWith("steps.csv:17: t_s goes back from 1.5 to 1.0 s; "), HasSubstr("run: COLUMN")));
  EXPECT_THAT(complaint(text + "1.5,0\n"), StartsWith("steps.csv:17: t_s stands still at 1.5 s"));
  EXPECT_THAT(complaint("run,t_s,omega_rad_s\na,1,0\nb,0,0\na,0.5,0\n"),
              StartsWith("steps.csv:4: t_s goes back from 1 to 0.5 s; rows of one run"));
}

TEST_F(Csv, AMappingThatDoesNotFitIsToldSo) {
  Mapping mapping;
  mapping.columns[Signal::theta] = {.column = "pos_m"};
  EXPECT_THAT(
      complaint("t_s,u_V,pos\n0,1,2\n", mapping),
      StartsWith("steps.csv:1: no column `pos_m`, from which the mapping takes theta. Columns here: t_s, u_V, pos"));
  mapping.columns[Signal::theta] = {.column = "pos"};
  mapping.run = "run";
  EXPECT_THAT(complaint("t_s,u_V,pos\n0,1,2\n", mapping),
              StartsWith("steps.csv:1: no column `run`, by which the mapping splits"));
  mapping = {};
  mapping.delimiter = mapping.decimal = ',';
  EXPECT_THAT(complaint("t_s\n", mapping), HasSubstr("They must differ"));
}

TEST_F(Csv, AFileThatIsNotThereIsToldSo) {
  EXPECT_THAT(message_of<SessionError>([&] { read_csv(path("none.csv")); }),
              HasSubstr("none.csv: cannot be read: no such file"));
  EXPECT_THAT(message_of<SessionError>([&] { read_csv(path("")); }), HasSubstr("is a folder"));
}

TEST_F(Csv, CutAnywhereItIsReadOrRefusedInOneLine) {
  const std::string whole =
      "run,t_s,\"omega_rad_s\",i_a_A\r\na,0,1.5,\r\na,0.1,-2e-3,0.5\r\n\"b\"\"c\",0,3,\r\nb,0.1,4,0.7\r\n";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    try {
      session(whole.substr(0, length));
    } catch (const SessionError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }
}

TEST_F(Csv, WritesTheUnionOfTimesAndLeavesCellsEmpty) {
  Session s;
  s.runs.resize(1);
  s.runs[0].signals[Signal::omega] = series({0, 0.1, 0.2}, {1, 1.0 / 3, -2});
  s.runs[0].signals[Signal::i_a] = series({0.15, 0.2}, {1e-7, 2});
  write_csv(path("out.csv"), s);
  EXPECT_EQ(read(path("out.csv")), "t_s,i_a_A,omega_rad_s\n0,,1\n0.1,,0.3333333333333333\n0.15,1e-07,\n0.2,2,-2\n");
}

TEST_F(Csv, WhatIsWrittenReadsBackTheSame) {
  Session s;
  s.runs.resize(3);
  s.runs[0].name = "a, \"b\"";
  s.runs[0].signals[Signal::omega] = series({0, 0.1}, {0.1 + 0.2, 5e-300});
  s.runs[1].name = "c";
  s.runs[1].signals[Signal::i_a] = series({0, 1e5 / 3}, {-1, 1e22});
  s.runs[2].name = "c";
  s.runs[2].signals[Signal::i_a] = series({0}, {4});
  write_csv(path("out.csv"), s);
  const Session back = read_csv(path("out.csv"));
  ASSERT_EQ(back.runs.size(), 3u);
  EXPECT_EQ(back.runs[0].name, s.runs[0].name);
  EXPECT_EQ(back.runs[2].name, "c_2") << "two runs of one name are kept apart";
  for (std::size_t r = 0; r < 3; ++r) {
    for (const auto& [signal, written] : s.runs[r].signals) {
      EXPECT_EQ(back.runs[r].at(signal).t, written.t);
      EXPECT_EQ(back.runs[r].at(signal).value, written.value);
    }
  }
}

TEST_F(Csv, ResolutionAndWindowStandInColumnsOfTheirOwnOnceARun) {
  Session s;
  s.runs.resize(2);
  for (Run& run : s.runs) run.signals[Signal::omega] = series({0, 0.1}, {1, 2});
  s.runs[1].signals[Signal::i_a] = series({0.1}, {0.5});
  s.runs[1].signals[Signal::i_a].window = 0.4;
  s.runs[1].signals[Signal::i_a].lsb = 1e-3;
  s.runs[0].signals[Signal::omega].lsb = 0.1;
  write_csv(path("out.csv"), s);
  EXPECT_EQ(read(path("out.csv")),
            "run,t_s,i_a_A,omega_rad_s,i_a_lsb_A,i_a_window_s,omega_lsb_rad_s\n"
            "run,0,,1,,,0.1\nrun,0.1,,2,,,\nrun_2,0,,1,0.001,0.4,\nrun_2,0.1,0.5,2,,,\n");
  const Session back = read_csv(path("out.csv"));
  EXPECT_EQ(back.runs[0].at(Signal::omega).lsb, 0.1);
  EXPECT_EQ(back.runs[1].at(Signal::omega).lsb, 0) << "of this run nothing was known";
  EXPECT_EQ(back.runs[1].at(Signal::i_a).lsb, 1e-3);
  EXPECT_EQ(back.runs[1].at(Signal::i_a).window, 0.4);
}

TEST_F(Csv, ResolutionAndWindowMayStandInEveryRowButMustNotContradictThemselves) {
  const std::string head = "t_s,i_a_A,i_a_lsb_A,i_a_window_s\n";
  const Run run = only_run(head + "0,1,0.01,0.4\n1,2,0.01,0.4\n");
  EXPECT_EQ(run.at(Signal::i_a).lsb, 0.01);
  EXPECT_EQ(run.at(Signal::i_a).window, 0.4);
  EXPECT_THAT(complaint(head + "0,1,0.01,\n1,2,0.02,\n"),
              StartsWith("steps.csv:3: column i_a_lsb_A: 0.02 after 0.01. One value stands for a run"));
  EXPECT_THAT(complaint(head + "0,1,,-1\n"), StartsWith("steps.csv:2: column i_a_window_s: -1. It must be above 0"));
}

TEST_F(Csv, WritingWhereOneCannotIsAnError) {
  EXPECT_THAT(message_of<SessionError>([&] { write_csv(path("no/such/folder.csv"), {}); }),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace emtb
