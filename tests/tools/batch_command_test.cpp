#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "session/spec.h"
#include "tests/blind/recording.h"
#include "tests/tools/command_caller.h"
#include "tools/batch/rank.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// `emtb batch` on a few motors of one line.
class BatchCommand : public CommandCaller {
 protected:
  static constexpr int motors = 6;

  void SetUp() override {
    CommandCaller::SetUp();
    std::filesystem::create_directories(path("line"));
    for (int i = 0; i < motors; ++i) {
      blind::Bench bench = blind::fast_bench();
      std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::torque; });
      bench.plant.motor.K_b = bench.plant.motor.K_m = 0.040 + 0.001 * i;
      Session session;
      session.runs.push_back(record(bench, bench.train[0], static_cast<std::uint64_t>(i)));
      write_session(path("line/motor_" + std::to_string(i) + ".csv"), session);
    }
    write("line.yaml", manifest());
  }

  static std::string manifest(const std::string& more = "limits: {K_b: {min: 0.0405, max: 0.0435}}\n") {
    return "name: line 3\nmodel: " + std::string(EMTB_CONFIG) + "/models/desk.yaml\nfiles: line/*.csv\n" + more;
  }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(path(name)) << text;
    return path(name);
  }

  int batch(const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> words{"batch", path("line.yaml"), "--out", path(out)};
    words.insert(words.end(), more.begin(), more.end());
    return call(words);
  }

  /// One of several at the same time.
  std::unique_ptr<Process> start(const std::string& out, const std::string& shard) {
    std::string file = shard;
    std::ranges::replace(file, '/', '_');
    return std::make_unique<Process>(
        std::vector<std::string>{EMTB, "batch", path("line.yaml"), "--out", path(out), "--shard", shard},
        path("rank" + file));
  }

  std::string of(const std::string& folder, const std::string& file) const { return read(path(folder + "/" + file)); }
};

TEST_F(BatchCommand, SaysForEachMotorWhatItIsAndWhetherItPasses) {
  EXPECT_EQ(batch("one"), 1) << last->err();  // not all pass
  EXPECT_THAT(last->out(), HasSubstr("6 motors: 3 pass, 3 fail, 0 bad"));
  const std::string csv = of("one", "table.csv");
  EXPECT_THAT(csv, HasSubstr("serial,time,result,verdict,missing,error_train,error_held_out,R_a,R_a_std_error,K_b,"));
  EXPECT_THAT(csv, AllOf(HasSubstr("\nmotor_0,,fail,"), HasSubstr("\nmotor_3,,pass,"), HasSubstr("is below 0.0405"),
                         HasSubstr("is above 0.0435")));
  EXPECT_THAT(of("one", "index.html"), AllOf(HasSubstr("line 3"), HasSubstr("<svg"), HasSubstr("is above 0.0435")));
  EXPECT_EQ(of("one", "table.h5").substr(1, 3), "HDF");
  EXPECT_TRUE(std::filesystem::is_empty(path("one/claims")));
}

TEST_F(BatchCommand, IsTheSameToTheLastByteForAnyNumberOfProcesses) {
  batch("one", {"--jobs", "1"});
  for (const int ranks : {2, 3}) {
    const std::string out = "by" + std::to_string(ranks);
    std::vector<std::unique_ptr<Process>> processes;
    for (int k = ranks; k >= 1; --k) processes.push_back(start(out, std::to_string(k) + "/" + std::to_string(ranks)));
    for (auto& process : processes) EXPECT_LE(process->wait(300), 1) << process->err();
    for (const std::string file : {"table.csv", "table.h5", "index.html", "items/000001.json", "items/000006.json"}) {
      EXPECT_EQ(of("one", file), of(out, file)) << file << ", " << ranks << " processes";
    }
  }
}

TEST_F(BatchCommand, LosesNothingWhereAProcessIsKilled) {
  batch("one");
  auto killed = start("two", "1/2");
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(path("two/items/000001.json")); }));
  killed->signal(SIGKILL);
  killed.reset();
  // What it had claimed is seen to be left behind, at once on the same machine.
  auto other = start("two", "2/2");
  EXPECT_EQ(other->wait(300), 0) << other->err();
  for (const std::string file : {"table.csv", "table.h5", "index.html"})
    EXPECT_EQ(of("one", file), of("two", file)) << file;
  for (const auto& left : std::filesystem::directory_iterator(path("two/claims"))) {
    const bool draft = left.path().filename().string().starts_with(".draft");  // of a claim: none yet
    EXPECT_TRUE(draft) << left.path() << ": " << read(left.path());
  }
}

TEST_F(BatchCommand, TakesOverWhatAnotherMachineLeftBehind) {
  std::filesystem::create_directories(path("out/claims"));
  write("out/claims/000002", "elsewhere/boot/pid:[1] 17 4711 1\n");
  std::filesystem::last_write_time(path("out/claims/000002"),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_EQ(batch("out"), 1) << last->err();
  EXPECT_THAT(of("out", "table.csv"), HasSubstr("\nmotor_1,,pass,"));
}

TEST_F(BatchCommand, TheClaimOfAProcessThatDiedWhenItWasJustDoneGoes) {
  batch("out");
  write("out/claims/000001", "elsewhere/boot/pid:[1] 17 4711 1\n");
  std::filesystem::last_write_time(path("out/claims/000001"),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  batch("out");
  EXPECT_TRUE(std::filesystem::is_empty(path("out/claims")));
}

TEST_F(BatchCommand, AnItemAtWhichProcessesDieIsBadInTheEnd) {
  std::filesystem::create_directories(path("out/claims"));
  write("out/claims/000002", "elsewhere/boot/pid:[1] 17 4711 3\n");
  std::filesystem::last_write_time(path("out/claims/000002"),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_EQ(batch("out"), 1);
  EXPECT_THAT(of("out", "table.csv"), HasSubstr("the process died at it, 3 times"));
}

TEST_F(BatchCommand, ABadSessionIsRecordedAndTheRestGoesOn) {
  write("line/broken.csv", "t_s,u_ref_V\n0,1\n0,2\n");
  EXPECT_EQ(batch("out"), 1);
  EXPECT_THAT(last->out(), HasSubstr("7 motors: 3 pass, 3 fail, 1 bad"));
  EXPECT_THAT(of("out", "table.csv"), AllOf(HasSubstr("\nbroken,,bad,"), HasSubstr("broken.csv:3: t_s stands still")));
  EXPECT_THAT(of("out", "index.html"), HasSubstr("What does not pass"));
  // Mended, it alone is worked on again.
  std::filesystem::copy_file(path("line/motor_2.csv"), path("line/broken.csv"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(batch("out"), 1);
  EXPECT_THAT(last->out(), HasSubstr("7 motors: 4 pass, 3 fail, 0 bad"));
}

TEST_F(BatchCommand, GoesOnWhereItStoppedAndLimitsMayChangeWithoutAnotherFit) {
  batch("out");
  const auto when = std::filesystem::last_write_time(path("out/items/000003.json"));
  std::filesystem::remove(path("out/items/000005.json"));
  write("out/items/000006.json", "{\"key\": ");  // cut off
  write("line.yaml", manifest("limits: {K_b: {max: 0.0425}}\n"));
  EXPECT_EQ(batch("out"), 1);
  EXPECT_THAT(last->out(), HasSubstr("6 motors: 3 pass, 3 fail, 0 bad"));
  EXPECT_EQ(std::filesystem::last_write_time(path("out/items/000003.json")), when);
  EXPECT_THAT(of("out", "table.csv"), HasSubstr("is above 0.0425"));
}

TEST_F(BatchCommand, NamesMotorsTheirTimesAndModelsOneByOne) {
  write("line.yaml", "do: compare\nmodel: " + std::string(EMTB_CONFIG) +
                         "/models/desk.yaml\nitems:\n"
                         "  - {serial: A-1, time: 2026-03-01T10:00, session: line/motor_1.csv}\n"
                         "  - {serial: A-2, time: 2026-03-02T10:30, sessions: [line/motor_2.csv, line/motor_3.csv]}\n");
  EXPECT_EQ(batch("out"), 0) << last->err();
  EXPECT_THAT(of("out", "table.csv"), AllOf(HasSubstr("\nA-1,2026-03-01T10:00,pass,"), HasSubstr("\nA-2,")));
  EXPECT_THAT(of("out", "index.html"), HasSubstr("Over time"));
}

TEST_F(BatchCommand, SaysWhatIsWrongWithAManifest) {
  const auto complaint = [&](const std::string& text) {
    write("line.yaml", text);
    EXPECT_EQ(batch("out"), 2) << text;
    return last->err();
  };
  const std::string model = "model: " + std::string(EMTB_CONFIG) + "/models/desk.yaml\n";
  EXPECT_THAT(complaint(model), HasSubstr("items is missing"));
  EXPECT_THAT(complaint(model + "files: nowhere/*.csv\n"), HasSubstr("cannot be read"));
  EXPECT_THAT(complaint(model + "files: line/*.h5\n"), HasSubstr("names no file"));
  EXPECT_THAT(complaint(model + "do: guess\nfiles: line/*.csv\n"), HasSubstr("Write calibrate, compare or diagnose"));
  EXPECT_THAT(complaint(model + "items: [{serial: a, session: b.csv}, {serial: a, session: c.csv}]\n"),
              HasSubstr("like another"));
  EXPECT_THAT(complaint(model + "limits: {K_b: {min: 2, max: 1}}\nfiles: line/*.csv\n"), HasSubstr("is above max"));
  EXPECT_THAT(complaint("files: line/*.csv\n"), HasSubstr("model is missing"));
  write("line.yaml", manifest());
  EXPECT_EQ(batch("out", {"--shard", "3/2"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("K from 1 to N"));
}

TEST(BatchRank, IsWhatTheStarterSays) {
  std::map<std::string, std::string> environment;
  const auto get = [&](const char* name) -> const char* {
    const auto found = environment.find(name);
    return found == environment.end() ? nullptr : found->second.c_str();
  };
  const auto expect = [&](const Rank& rank, std::size_t number, std::size_t of) {
    EXPECT_EQ(rank.number, number);
    EXPECT_EQ(rank.of, of);
  };
  expect(find_rank("", get), 0, 1);
  expect(find_rank("2/3", get), 1, 3);
  environment = {{"OMPI_COMM_WORLD_RANK", "3"}, {"OMPI_COMM_WORLD_SIZE", "8"}, {"OMPI_COMM_WORLD_LOCAL_SIZE", "4"}};
  expect(find_rank("", get), 3, 8);
  EXPECT_EQ(find_rank("", get).on_machine, 4u);
  environment = {{"SLURM_PROCID", "1"}, {"SLURM_NTASKS", "2"}};
  expect(find_rank("", get), 1, 2);
  environment = {{"SLURM_ARRAY_TASK_ID", "12"},
                 {"SLURM_ARRAY_TASK_COUNT", "4"},
                 {"SLURM_ARRAY_TASK_MIN", "10"},
                 {"SLURM_PROCID", "0"},
                 {"SLURM_NTASKS", "1"}};
  expect(find_rank("", get), 2, 4);
}

}  // namespace
}  // namespace emtb
