#include "session/writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "session/spec.h"
#include "tests/session/foreign_readers.h"
#include "tests/session/scratch.h"

// HDF5 1.10.8 itself loses 120 bytes each time it fails to open a damaged file.
// NOLINTNEXTLINE(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5_serial\n"; }

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// What a child tells its parent, before and after its death.
struct Progress {
  std::atomic<std::uint64_t> flushed{0};  ///< rows of omega
  std::atomic<bool> refused{false};       ///< the writer threw
};

class Shared {
 public:
  Shared() : memory_(mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    progress_ = new (memory_) Progress;
  }
  ~Shared() { munmap(memory_, sizeof(Progress)); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  Progress* operator->() const { return progress_; }

 private:
  void* memory_;
  Progress* progress_;
};

double value_at(std::uint64_t row) { return 0.5 * static_cast<double>(row) + 0.125; }

class Writer : public Scratch {
 protected:
  static SessionWriter::Description description() {
    return {.channels = {{.signal = Signal::omega, .period = 0.001, .window = 0, .lsb = 0.1, .source = "daq channel 1"},
                         {.signal = Signal::u_ref, .period = 0.001, .window = 0, .lsb = 0, .source = "daq channel 0"},
                         {.signal = Signal::i_a, .period = 0.4, .window = 0.4, .lsb = 1e-4, .source = "meter"}},
            .attributes = {{"profile", "step"}, {"operator", "me"}},
            .config = "name: fh2\n"};
  }

  /// Appends rows [first, first + count) of omega and u_ref, and every 400th of i_a.
  static void append(SessionWriter& writer, std::uint64_t first, std::uint64_t count) {
    std::vector<double> t;
    std::vector<double> value;
    for (std::uint64_t row = first; row < first + count; ++row) {
      t.push_back(static_cast<double>(row) / 1000);
      value.push_back(value_at(row));
      if (row % 400 == 399) writer.append(Signal::i_a, {&t.back(), 1}, {&value.back(), 1});
    }
    writer.append(Signal::omega, t, value);
    writer.append(Signal::u_ref, t, value);
  }

  /// Runs `body` in a child process. @return its process id
  template <class Body>
  static pid_t child(Body body) {
    const pid_t pid = fork();
    if (pid == 0) {
      try {
        body();
      } catch (const std::exception& e) {
        std::fprintf(stderr, "child: %s\n", e.what());
        _exit(1);
      }
      _exit(0);
    }
    return pid;
  }

  /// A child that records for ever, flushing now and then, and is killed.
  void record_and_kill(Shared& progress, std::chrono::microseconds after, std::uint64_t seed) const {
    const pid_t pid = child([&] {
      std::mt19937_64 random(seed);
      SessionWriter writer(path("s.h5"), description());
      writer.append({0, event_code::run, "step"});
      for (std::uint64_t row = 0; row < 2000000;) {
        const std::uint64_t count = 1 + random() % 300;
        append(writer, row, count);
        row += count;
        if (random() % 3 == 0) {
          writer.flush();
          progress->flushed = row;
        }
      }
      writer.finish();
    });
    std::this_thread::sleep_for(after);
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
  }

  static std::size_t rows_of(const Session& session) {
    std::size_t rows = 0;
    for (const Run& run : session.runs) {
      for (const auto& [signal, recorded] : run.signals) rows += recorded.t.size();
    }
    return rows;
  }

  static void expect_what_was_recorded(const Session& session, std::uint64_t at_least) {
    EXPECT_FALSE(session.complete);
    if (session.runs.empty()) {
      EXPECT_EQ(at_least, 0u);
      return;
    }
    const Run& run = session.runs.at(0);
    for (const Signal signal : {Signal::omega, Signal::u_ref}) {
      if (!run.has(signal)) {
        EXPECT_EQ(at_least, 0u);
        continue;
      }
      const Series& s = run.at(signal);
      ASSERT_EQ(s.t.size(), s.value.size());
      EXPECT_GE(s.t.size(), at_least);
      for (std::size_t row = 0; row < s.t.size(); ++row) {
        ASSERT_EQ(s.t[row], static_cast<double>(row) / 1000);
        ASSERT_EQ(s.value[row], value_at(row));
      }
    }
    EXPECT_GE(run.has(Signal::i_a) ? run.at(Signal::i_a).t.size() : 0, at_least / 400);
  }
};

TEST_F(Writer, RecordsWhatIsAppended) {
  SessionWriter writer(path("s.h5"), description());
  writer.append({0, event_code::run, "step"});
  for (std::uint64_t row = 0; row < 5000; row += 100) append(writer, row, 100);
  writer.append({4.9, 101, "over_speed: the speed exceeds limits.omega"});
  writer.append({5, event_code::run_ended, std::string(239, 'x') + "ä"});
  writer.finish();
  const Session session = read_session(path("s.h5"));
  EXPECT_TRUE(session.complete);
  EXPECT_EQ(session.attributes.at("profile"), "step");
  EXPECT_EQ(session.attributes.at("note"), "");
  EXPECT_EQ(session.config, "name: fh2\n");
  ASSERT_EQ(session.runs.size(), 1u);
  EXPECT_EQ(session.runs[0].name, "step");
  EXPECT_EQ(session.runs[0].at(Signal::omega).t.size(), 5000u);
  EXPECT_EQ(session.runs[0].at(Signal::omega).lsb, 0.1);
  EXPECT_EQ(session.runs[0].at(Signal::i_a).t.size(), 12u);
  EXPECT_EQ(session.runs[0].at(Signal::i_a).window, 0.4);
  EXPECT_EQ(session.events.at(1).code, 101);
  EXPECT_EQ(session.events.at(2).text, std::string(239, 'x')) << "cut, but not within a character";
  EXPECT_FALSE(repair_session(path("s.h5")));
}

TEST_F(Writer, ARowThatIsNoReadingIsLeftOut) {
  SessionWriter writer(path("s.h5"), description());
  const std::vector<double> t{0, 1, 1, 0.5, 2, 3};
  const std::vector<double> value{1, 2, 3, 4, std::nan(""), 5};
  writer.append(Signal::omega, t, value);
  writer.finish();
  EXPECT_THAT(read_session(path("s.h5")).runs.at(0).at(Signal::omega).value, ElementsAre(1, 2, 5));
}

TEST_F(Writer, WithoutFinishTheSessionIsIncompleteButWhole) {
  {
    SessionWriter writer(path("s.h5"), description()), moved = std::move(writer);
    append(moved, 0, 700);
  }
  const Session session = read_session(path("s.h5"));
  expect_what_was_recorded(session, 700);
  EXPECT_FALSE(repair_session(path("s.h5"))) << "it was closed in order";
}

TEST_F(Writer, NoticesThatItsFileWasCutAlsoWhereHdf5HasMendedTheBeginningSince) {
  SessionWriter writer(path("s.h5"), description());
  append(writer, 0, 700);
  writer.flush();
  const std::string before = read(path("s.h5"));
  std::filesystem::resize_file(path("s.h5"), 0);
  std::filesystem::resize_file(path("s.h5"), before.size());
  std::fstream(path("s.h5"), std::ios::in | std::ios::out | std::ios::binary) << before.substr(0, 48);  // superblock
  append(writer, 700, 100);
  try {
    writer.flush();
    FAIL() << "the first 700 rows are gone";
  } catch (const SessionError& e) {
    EXPECT_THAT(e.what(), HasSubstr("was cut or written over by another program"));
  }
}

TEST_F(Writer, CanBeReadWhileItRecords) {
  SessionWriter writer(path("s.h5"), description());
  append(writer, 0, 700);
  writer.flush();
  expect_what_was_recorded(read_session(path("s.h5")), 700);
  EXPECT_EQ(python("import h5py\nf = h5py.File('" + path("s.h5").string() +
                   "', 'r', swmr=True)\nprint(f['signals/omega/t'].shape, f.attrs['complete'])"),
            "(700,) 0\n");
  append(writer, 700, 100);
  writer.finish();
  EXPECT_EQ(read_session(path("s.h5")).runs.at(0).at(Signal::omega).t.size(), 800u);
}

TEST_F(Writer, OpensInOctaveWhateverLettersThereAre) {
  {
    SessionWriter::Description own = description();
    own.config = "name: b\xC3\xA4nk\n";
    SessionWriter writer(path("s.h5"), own);
    append(writer, 0, 700);
    writer.append(Event{0.5, 3, "mit \xC3\x96l"});
    writer.finish();
  }
  const std::string out = octave("s = load('-hdf5', '" + path("s.h5").string() + R"(');
printf('%d %g %g ', numel(s.signals.omega.t), s.signals.omega.t(3), s.signals.omega.value(3));
printf('[%s] [%s]', strtrim(s.config), strtrim(strrep(s.events.text(end, :), char(0), ' ')));
)");
  const Session session = read_session(path("s.h5"));
  const Series& omega = session.runs.at(0).at(Signal::omega);
  char numbers[64];
  std::snprintf(numbers, sizeof numbers, "%d %g %g ", 700, omega.t[2], omega.value[2]);
  EXPECT_EQ(out, std::string(numbers) + "[name: b\xC3\xA4nk] [mit \xC3\x96l]");
}

TEST_F(Writer, ASessionThatIsBeingRecordedIsNotRepaired) {
  SessionWriter writer(path("s.h5"), description());
  append(writer, 0, 700);
  writer.flush();
  EXPECT_TRUE(is_being_recorded(path("s.h5")));
  EXPECT_THAT(message_of<SessionError>([&] { repair_session(path("s.h5")); }),
              HasSubstr("is being recorded by another process"));
  writer.finish();
  EXPECT_FALSE(is_being_recorded(path("s.h5")));
}

TEST_F(Writer, RefusesWhatCannotBe) {
  SessionWriter writer(path("s.h5"), description());
  EXPECT_THAT(message_of<SessionError>([&] { SessionWriter(path("s.h5"), description()); }),
              HasSubstr("exists already"));
  EXPECT_THAT(message_of<SessionError>([&] { SessionWriter(path("no/s.h5"), description()); }),
              HasSubstr("cannot be created"));
  EXPECT_THAT(message_of<SessionError>([&] { writer.append(Signal::torque, {}, {}); }),
              HasSubstr("no channel measures torque"));
  const std::vector<double> two{1, 2};
  EXPECT_THAT(message_of<SessionError>([&] { writer.append(Signal::omega, two, {}); }),
              HasSubstr("a value for each time"));
  writer.finish();
  EXPECT_THAT(message_of<SessionError>([&] { writer.flush(); }), HasSubstr("is closed"));
  auto twice = description();
  twice.channels.push_back(twice.channels[0]);
  EXPECT_THAT(message_of<SessionError>([&] { SessionWriter(path("t.h5"), twice); }),
              HasSubstr("two channels measure omega"));
  EXPECT_FALSE(std::filesystem::exists(path("t.h5")));
  EXPECT_THAT(message_of<SessionError>([&] { repair_session(path("none.h5")); }), HasSubstr("no such file"));
}

TEST_F(Writer, KilledAtAnyInstantLosesNothingThatWasFlushed) {
  std::mt19937_64 random(20240506);
  for (int attempt = 0; attempt < 40; ++attempt) {
    std::filesystem::remove(path("s.h5"));
    Shared progress;
    // Every fourth within the first milliseconds, where the file is being made.
    record_and_kill(progress, std::chrono::microseconds(random() % (attempt % 4 == 0 ? 6000 : 120000)), random());
    const std::uint64_t flushed = progress->flushed;
    if (!std::filesystem::exists(path("s.h5"))) {
      EXPECT_EQ(flushed, 0u);
      continue;
    }
    const Session before = read_session(path("s.h5"));
    expect_what_was_recorded(before, flushed);
    EXPECT_TRUE(repair_session(path("s.h5")));
    EXPECT_FALSE(repair_session(path("s.h5"))) << "once is enough";
    const Session after = read_session(path("s.h5"));
    expect_what_was_recorded(after, flushed);
    ASSERT_FALSE(after.events.empty());
    EXPECT_EQ(after.events.back().code, event_code::repaired);
    EXPECT_EQ(after.config, "name: fh2\n");
    EXPECT_EQ(after.attributes, before.attributes);
    EXPECT_FALSE(std::filesystem::exists(path("s.h5.draft")));
    if (HasFailure()) return;
  }
}

TEST_F(Writer, ARepairedSessionOpensInPython) {
  Shared progress;
  while (progress->flushed < 1000) {
    std::filesystem::remove(path("s.h5"));
    record_and_kill(progress, std::chrono::milliseconds(200), 7);
  }
  const std::string script = "import h5py\nf = h5py.File('" + path("s.h5").string() + R"(', 'r')
t, v = f['signals/omega/t'], f['signals/omega/value']
assert t.shape == v.shape and t.shape[0] >= )" +
                             std::to_string(progress->flushed) + R"(, (t.shape, v.shape)
assert all(v[i] == 0.5*i + 0.125 for i in range(0, len(v), 97))
print(f.attrs['complete'], list(f['events/code']), f['events/text'][0].decode())
)";
  EXPECT_TRUE(repair_session(path("s.h5")));
  EXPECT_EQ(python(script), "0 [1, 3] step\n");
}

TEST_F(Writer, AFullDiskLosesNothingThatWasFlushed) {
  for (const rlim_t limit : {60000u, 100000u, 333333u}) {
    std::filesystem::remove(path("s.h5"));
    Shared progress;
    const pid_t pid = child([&] {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit file_size{.rlim_cur = limit, .rlim_max = limit};  // behaves as a full disk does
      setrlimit(RLIMIT_FSIZE, &file_size);
      SessionWriter writer(path("s.h5"), description());
      try {
        for (std::uint64_t row = 0; row < 2000000; row += 250) {
          append(writer, row, 250);
          writer.flush();
          progress->flushed = row + 250;
        }
      } catch (const SessionError& e) {
        progress->refused = std::string(e.what()).find("cannot be written (File too large)") != std::string::npos;
        EXPECT_THROW(writer.flush(), SessionError);
      }
    });
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    EXPECT_TRUE(progress->refused);
    EXPECT_GT(progress->flushed, 0u);
    expect_what_was_recorded(read_session(path("s.h5")), progress->flushed);
    repair_session(path("s.h5"));
    expect_what_was_recorded(read_session(path("s.h5")), progress->flushed);
  }
}

TEST_F(Writer, ARepairThatFindsTheDiskFullLeavesTheSessionAsItWas) {
  Shared progress;
  while (progress->flushed < 5000) {
    std::filesystem::remove(path("s.h5"));
    record_and_kill(progress, std::chrono::milliseconds(200), 7);
  }
  const std::string before = read(path("s.h5"));
  const pid_t pid = child([&] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit file_size{.rlim_cur = 30000, .rlim_max = 30000};
    setrlimit(RLIMIT_FSIZE, &file_size);
    EXPECT_THROW(repair_session(path("s.h5")), SessionError);
    _exit(HasFailure() ? 1 : 0);
  });
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read(path("s.h5")), before);
  EXPECT_FALSE(std::filesystem::exists(path("s.h5.draft")));
  EXPECT_TRUE(repair_session(path("s.h5")));
}

TEST_F(Writer, ACrashedSessionCutAnywhereKeepsOnlyWhatIsReallyThere) {
  Shared progress;
  while (progress->flushed < 3000) {
    std::filesystem::remove(path("s.h5"));
    record_and_kill(progress, std::chrono::milliseconds(60), 7);
  }
  const std::string whole = read(path("s.h5"));
  const Session uncut = read_session(path("s.h5"));
  std::mt19937_64 random(3);
  int readable = 0;
  for (int attempt = 0; attempt < 40; ++attempt) {
    const auto cut =
        write("cut.h5", whole.substr(0, attempt < 20 ? random() % 8192 : whole.size() - random() % (whole.size() / 3)));
    std::filesystem::remove(path("cut.h5.damaged"));
    try {
      const Session part = read_session(cut);
      ++readable;
      expect_what_was_recorded(part, 0);
      EXPECT_TRUE(repair_session(cut));
      expect_what_was_recorded(read_session(cut), 0);
      if (rows_of(part) < rows_of(uncut)) {
        EXPECT_TRUE(std::filesystem::exists(path("cut.h5.damaged"))) << "somebody may get more out of it";
      }
    } catch (const SessionError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(readable, 0);
}

}  // namespace
}  // namespace emtb
