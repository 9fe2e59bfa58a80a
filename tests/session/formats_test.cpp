#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hal/error.h"
#include "session/hdf5.h"
#include "session/spec.h"
#include "tests/session/foreign_readers.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

class Formats : public Scratch {
 protected:
  static std::filesystem::path kept(const std::string& name) {
    return std::filesystem::path(EMTB_SOURCE_DIR) / "tests/formats" / name;
  }
};

TEST_F(Formats, SessionsOfEachVersionAreRead) {
  for (const char* name : {"session-0.h5", "session.csv"}) {
    const Session s = read_session(kept(name));
    EXPECT_EQ(s.runs.at(0).at(Signal::omega).value, (std::vector<double>{0, 0.5, 2, 3.5})) << name;
  }
  for (const char* name : {"session-1.h5", "session-1.mat", "session-1-73.mat"}) {
    const Session s = read_session(kept(name));
    ASSERT_EQ(s.runs.size(), 1U) << name;
    EXPECT_EQ(s.runs[0].signals.size(), 6U) << name;
    EXPECT_EQ(s.runs[0].at(Signal::omega).t.size(), 101U) << name;
    EXPECT_NEAR(s.runs[0].at(Signal::omega).value[75], 25.2372, 1e-3) << name;
    EXPECT_EQ(s.attributes.at("profile"), "kept") << name;
    EXPECT_EQ(s.events.at(0).text, "kept") << name;
    EXPECT_TRUE(s.complete) << name;
  }
}

TEST_F(Formats, SignalsThatWereReadTogetherHoldTheirTimesOnce) {
  Session made;
  made.runs.resize(1);
  made.runs[0].signals[Signal::u_ref] = series({0, 0.5, 1.5}, {1, 2, 3});
  made.runs[0].signals[Signal::i_a] = series({0.5, 1.5}, {4, 5});
  made.runs[0].signals[Signal::omega] = series({0, 0.5, 1.5}, {6, 7, 8});
  for (const char* name : {"together.csv", "together.h5", "together.mat"}) {
    write_session(path(name), made);
    const Session read = read_session(path(name));
    const auto times = [&](Signal signal) { return read.runs.at(0).at(signal).t; };
    EXPECT_EQ(times(Signal::omega), (std::vector<double>{0, 0.5, 1.5})) << name;
    EXPECT_EQ(times(Signal::omega).data(), times(Signal::u_ref).data()) << name;
    EXPECT_EQ(times(Signal::i_a), (std::vector<double>{0.5, 1.5})) << name;
  }
}

TEST_F(Formats, ANewerSessionIsRefusedInOneLineWhateverItHolds) {
  const std::string made = path("new.h5").string();
  python("import h5py\nf = h5py.File('" + made + "', 'w')\nf.attrs['format'] = 'emtb session 2'\nf.create_group('x')");
  const std::string said = message_of<SessionError>([&] { read_session(made); });
  EXPECT_THAT(said, HasSubstr("new.h5: made by a newer emtb: it is `emtb session 2`"));
  EXPECT_EQ(said.find('\n'), std::string::npos);
}

TEST_F(Formats, AFormatOfSomebodyElseIsNoVersion) {
  const std::string made = path("theirs.h5").string();
  python("import h5py\nf = h5py.File('" + made +
         "', 'w')\nf.attrs['format'] = 'lab 7'\ng = f.create_group('signals/omega')\n"
         "g['t'] = [0.0, 1.0]\ng['value'] = [2.0, 3.0]");
  EXPECT_EQ(read_session(made).runs.at(0).at(Signal::omega).value[1], 3);
}

}  // namespace
}  // namespace emtb
