#include "session/hdf5.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <random>

#include "session/child.h"
#include "session/field.h"
#include "session/spec.h"
#include "tests/session/foreign_readers.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class Hdf5 : public Scratch {
 protected:
  static Session sample() {
    Session s;
    s.runs.resize(1);
    s.runs[0].signals[Signal::omega] = series({0, 0.001, 0.002}, {1, 1.0 / 3, -2});
    s.runs[0].signals[Signal::omega].lsb = 0.25;
    s.runs[0].signals[Signal::omega].source = "daq channel 3";
    s.runs[0].signals[Signal::i_a] = series({0.4}, {1.5});
    s.runs[0].signals[Signal::i_a].window = 0.4;
    s.events = {{0.5, event_code::gap, "gap of 3 samples"}, {0.7, 101, "over_speed: Ω"}};
    s.attributes = {{"started_utc", "2024-05-06T07:08:09Z"},
                    {"profile", "step"},
                    {"bench", "fh2"},
                    {"operator", "me"},
                    {"note", "größer"},
                    {"software", "emtb 0.1.0"}};
    s.config = "name: fh2\nrate: 1000\n";
    return s;
  }
  /// A session that a few lines of Python make.
  std::filesystem::path made_by(const std::string& lines) const {
    python("import h5py, numpy as np\nf = h5py.File('" + path("made.h5").string() + "', 'w')\n" + lines +
           "\nf.close()\n");
    return path("made.h5");
  }
  std::string complaint(const std::filesystem::path& file) const {
    const std::string message = message_of<SessionError>([&] { read_hdf5(file); });
    EXPECT_THAT(message, StartsWith(file.string() + ": "));
    return message.substr(std::min(message.size(), file.string().size() + 2));
  }
};

void expect_same(const Session& a, const Session& b) {
  ASSERT_EQ(a.runs.size(), b.runs.size());
  for (std::size_t r = 0; r < a.runs.size(); ++r) {
    EXPECT_EQ(a.runs[r].name, b.runs[r].name);
    ASSERT_EQ(a.runs[r].signals.size(), b.runs[r].signals.size());
    for (const auto& [signal, s] : a.runs[r].signals) {
      const Series& other = b.runs[r].at(signal);
      EXPECT_EQ(s.t, other.t);
      EXPECT_EQ(s.value, other.value);
      EXPECT_EQ(s.window, other.window);
      EXPECT_EQ(s.lsb, other.lsb);
      EXPECT_EQ(s.source, other.source);
    }
  }
  ASSERT_EQ(a.events.size(), b.events.size());
  for (std::size_t i = 0; i < a.events.size(); ++i) {
    EXPECT_EQ(a.events[i].t, b.events[i].t);
    EXPECT_EQ(a.events[i].code, b.events[i].code);
    EXPECT_EQ(a.events[i].text, b.events[i].text);
  }
  EXPECT_EQ(a.attributes, b.attributes);
  EXPECT_EQ(a.config, b.config);
  EXPECT_EQ(a.complete, b.complete);
}

TEST_F(Hdf5, WhatIsWrittenReadsBackTheSame) {
  write_hdf5(path("s.h5"), sample());
  expect_same(read_hdf5(path("s.h5")), sample());
  Session incomplete = sample();
  incomplete.complete = false;
  write_hdf5(path("s.h5"), incomplete);
  expect_same(read_hdf5(path("s.h5")), incomplete);
}

TEST_F(Hdf5, SeveralRunsStandBehindOneAnotherAndReadBackTheSame) {
  Session s = sample();
  s.events.clear();
  s.runs[0].name = "low";
  s.runs.push_back(s.runs[0]);
  s.runs[1].name = "high";
  for (int i = 0; i < 3000; ++i) {
    s.runs[1].signals[Signal::theta].t.push_back(i / 1000.0);
    s.runs[1].signals[Signal::theta].value.push_back(i);
  }
  s.runs.push_back(s.runs[0]);
  write_hdf5(path("s.h5"), s);
  Session back = read_hdf5(path("s.h5"));
  ASSERT_EQ(back.events.size(), 3u);
  EXPECT_EQ(back.events[1].t, 1) << "at a whole second behind the first run's 0.4 s";
  EXPECT_EQ(back.events[1].code, event_code::run);
  EXPECT_EQ(back.events[1].text, "high");
  EXPECT_EQ(back.events[2].t, 4);
  EXPECT_EQ(back.events[2].text, "low_2");
  write_hdf5(path("again.h5"), back);
  expect_same(read_hdf5(path("again.h5")), back);
  back.events.clear();
  s.runs[2].name = "low_2";
  expect_same(back, s);
  EXPECT_THAT(read_runs(path("s.h5").string() + "#high@1:1.003").at(0).at(Signal::theta).value,
              ElementsAre(1000, 1001, 1002));
}

TEST_F(Hdf5, ForHowLongTheFieldHasBeenOnIsOfARunWhereverItStands) {
  Session s = sample();
  s.runs[0].name = "low";
  s.runs[0].field_on = 61.25;
  s.runs.push_back(s.runs[0]);
  s.runs[1].name = "high";
  s.runs[1].field_on = 300.002;
  s.runs.push_back(s.runs[0]);
  s.runs[2].field_on = 0;
  write_hdf5(path("s.h5"), s);
  const Session back = read_hdf5(path("s.h5"));
  ASSERT_EQ(back.runs.size(), 3u);
  EXPECT_EQ(back.runs[0].field_on, 61.25);
  EXPECT_EQ(back.runs[1].field_on, 300.002);
  EXPECT_EQ(back.runs[2].field_on, 0) << "cold, or unknown";
  write_hdf5(path("again.h5"), back);
  expect_same(read_hdf5(path("again.h5")), back);
  EXPECT_NEAR(read_runs(path("s.h5").string() + "#high@0.001:").at(0).field_on, 300.003, 1e-9)
      << "a part of a run begins later";
}

TEST_F(Hdf5, WordsOfTheFieldThatSomebodyElseWroteAreLeftAlone) {
  EXPECT_EQ(field_seconds({0, event_code::field, field_words(12.3456)}), 12.346);
  for (const char* words : {"", "the field has been on for long", "the field has been on for nan s",
                            "the field has been on for 3 s or so", "the field has been on for  s"}) {
    EXPECT_EQ(field_seconds({0, event_code::field, words}), std::nullopt) << words;
  }
  EXPECT_EQ(field_seconds({0, event_code::run, field_words(5)}), std::nullopt);
}

TEST_F(Hdf5, TheFirstRunBeginsAtZeroSoThatNothingFallsBeforeIt) {
  Session s = sample();
  s.events = {{0.0015, event_code::run, "a"}, {0.3, event_code::run, "b"}};
  write_hdf5(path("s.h5"), s);
  const Session back = read_hdf5(path("s.h5"));
  ASSERT_EQ(back.runs.size(), 1u) << "the marks did not fit one run without a name";
  s.runs[0].name = "a";
  s.events.pop_back();
  write_hdf5(path("s.h5"), s);
  const Session named = read_hdf5(path("s.h5"));
  ASSERT_EQ(named.runs.size(), 1u);
  EXPECT_EQ(named.runs[0].name, "a");
  EXPECT_EQ(named.events[0].t, 0.0015);
  EXPECT_THAT(named.runs[0].at(Signal::omega).t, ElementsAre(0, 0.001, 0.002));
}

TEST_F(Hdf5, PythonFindsWhatTheContractPromises) {
  write_hdf5(path("s.h5"), sample());
  const std::string out = python("import h5py\nf = h5py.File('" + path("s.h5").string() + R"(', 'r')
for name in sorted(f['signals']):
    g = f['signals'][name]
    for at in (g, g['value']):
        print(name, at.attrs['unit'], repr(at.attrs['source']), at.attrs['window'], at.attrs['lsb'])
    print(g['t'].dtype, g['value'].dtype, list(g['t']), g['t'].attrs['unit'])
print(list(f['events/t']), list(f['events/code']), [x.decode() for x in f['events/text']])
print(f['config'][()].decode())
print({k: f.attrs[k] for k in sorted(f.attrs)})
)");
  EXPECT_EQ(out,
            "i_a A '' 0.4 0.0\ni_a A '' 0.4 0.0\nfloat64 float64 [0.4] s\n"
            "omega rad/s 'daq channel 3' 0.0 0.25\nomega rad/s 'daq channel 3' 0.0 0.25\nfloat64 float64 [0.0, 0.001, "
            "0.002] s\n"
            "[0.5, 0.7] [2, 101] ['gap of 3 samples', 'over_speed: Ω']\n"
            "name: fh2\nrate: 1000\n\n"
            "{'bench': 'fh2', 'complete': 1, 'format': 'emtb session 1', 'note': 'größer', 'operator': 'me', "
            "'profile': 'step', "
            "'software': 'emtb 0.1.0', 'started_utc': '2024-05-06T07:08:09Z'}\n");
}

TEST_F(Hdf5, ReadsWhatAFewLinesOfPythonMade) {
  const Session s =
      read_hdf5(made_by("g = f.create_group('signals/omega')\n"
                        "g['t'] = np.arange(3)/10\n"
                        "g['value'] = np.array([[1], [2], [3]], dtype='float32')\n"
                        "g['value'].attrs['unit'] = np.bytes_('rad/s')\n"
                        "g['value'].attrs['lsb'] = np.float32(0.5)\n"
                        "g.attrs['window'] = 2\n"
                        "f['signals/other/t'] = [1.0]\n"
                        "f['events/t'] = [0.1]\nf['events/code'] = np.array([101], dtype='uint8')\n"
                        "f['events/text'] = ['over speed']\n"
                        "f['config'] = 'name: x'\nf.attrs['complete'] = True\nf.attrs['note'] = 'n'"));
  ASSERT_EQ(s.runs.size(), 1u);
  EXPECT_EQ(s.runs[0].signals.size(), 1u);
  const Series& omega = s.runs[0].at(Signal::omega);
  EXPECT_THAT(omega.value, ElementsAre(1, 2, 3));
  EXPECT_EQ(omega.lsb, 0.5);
  EXPECT_EQ(omega.window, 2);
  EXPECT_EQ(s.events.at(0).text, "over speed");
  EXPECT_EQ(s.config, "name: x");
  EXPECT_TRUE(s.complete);
  EXPECT_EQ(s.attributes.at("note"), "n");
}

TEST_F(Hdf5, ComplaintsNameFileAndObject) {
  const std::string good = "g = f.create_group('signals/omega')\ng['t'] = [0.0, 1.0]\n";
  EXPECT_THAT(complaint(made_by("f['x'] = 1")), StartsWith("/signals is not there: HDF5, but no session"));
  EXPECT_THAT(complaint(made_by(good)), StartsWith("/signals/omega/value is not there"));
  EXPECT_THAT(complaint(made_by("f['signals/omega'] = [1.0]")), StartsWith("/signals/omega/t is not there"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = [1.0]")), StartsWith("/signals/omega has 2 times but 1 values"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = np.ones((2, 2))")),
              HasSubstr("/signals/omega/value is not there or not one column"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = ['a', 'b']")),
              StartsWith("/signals/omega/value cannot be read (holds no numbers)"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = [1.0, np.nan]")),
              StartsWith("/signals/omega row 1 is not finite"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = [1.0, -1e308]")),
              StartsWith("/signals/omega row 1 is no reading of a bench: -1e+308"));
  EXPECT_THAT(complaint(made_by("g = f.create_group('signals/omega')\ng['t'] = [1.0, 0.5]\ng['value'] = [1, 2]")),
              StartsWith("/signals/omega/t row 1 goes back from 1 to 0.5 s"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = [1.0, 2.0]\ng.attrs['unit'] = 'rpm'")),
              StartsWith("/signals/omega has the unit rpm. Convert it to rad/s"));
  EXPECT_THAT(complaint(made_by(good + "g['value'] = [1.0, 2.0]\nf['events/t'] = [1.0]")),
              StartsWith("/events/code is not there"));
}

TEST_F(Hdf5, FilesThatAreNoneAreToldSo) {
  EXPECT_THAT(complaint(path("none.h5")), StartsWith("no such file"));
  EXPECT_THAT(complaint(path("")), StartsWith("is not a file"));
  EXPECT_THAT(complaint(write("empty.h5", "")), StartsWith("is empty"));
  EXPECT_THAT(complaint(write("text.h5", "t_s,omega_rad_s\n0,1\n")), StartsWith("is not HDF5"));
  EXPECT_THAT(complaint(write("magic.h5", "\x89HDF\r\n\x1a\n")), StartsWith("is "));
}

TEST_F(Hdf5, ASessionWithoutReadingsOpensButGivesNoRuns) {
  write_hdf5(path("s.h5"), Session{});
  EXPECT_TRUE(read_hdf5(path("s.h5")).runs.empty());
  EXPECT_THAT(message_of<SessionError>([&] { read_runs(path("s.h5").string()); }), HasSubstr("holds no reading"));
}

TEST_F(Hdf5, ATruncatedFileIsOneClearLine) {
  Session s = sample();
  for (int i = 0; i < 5000; ++i) {
    s.runs[0].signals[Signal::theta].t.push_back(i / 1000.0);
    s.runs[0].signals[Signal::theta].value.push_back(i);
  }
  write_hdf5(path("s.h5"), s);
  const std::string whole = read(path("s.h5"));
  for (std::size_t length = 0; length < whole.size(); length += length < 4096 ? 97 : 1511) {
    const auto cut = write("cut.h5", whole.substr(0, length));
    EXPECT_THAT(complaint(cut), StartsWith("is ")) << length;
  }
}

TEST_F(Hdf5, AnExportReplacesWhatStoodThereOnlyWhenItIsWhole) {
  write_hdf5(path("s.h5"), sample());
  Session bad = sample();
  bad.attributes["note"] = std::string(10, 'x');
  std::filesystem::create_directory(path("s.h5.draft"));
  write("s.h5.draft/in_the_way", "");
  EXPECT_THAT(message_of<SessionError>([&] { write_hdf5(path("s.h5"), bad); }), HasSubstr("exists already"));
  expect_same(read_hdf5(path("s.h5")), sample());
  EXPECT_THAT(message_of<SessionError>([&] { write_hdf5(path("no/folder.h5"), bad); }), HasSubstr("cannot be created"));
}

TEST_F(Hdf5, WhatIsInAnotherFileIsNotFollowed) {
  python("import h5py, numpy as np\nf = h5py.File('" + path("other.h5").string() +
         "', 'w')\nf['t'] = np.arange(3.0)\nf.close()\n");
  const std::string other = path("other.h5").string();
  EXPECT_THAT(complaint(made_by("g = f.create_group('signals/omega')\ng['value'] = np.arange(3.0)\n"
                                "g['t'] = h5py.ExternalLink('" +
                                other + "', '/t')")),
              HasSubstr("/signals/omega/t"));
  EXPECT_THAT(
      complaint(made_by("f.create_group('signals')\nf['signals/omega'] = h5py.ExternalLink('" + other + "', '/')")),
      HasSubstr("/signals/omega"));
  EXPECT_THAT(complaint(made_by("g = f.create_group('signals/omega')\ng['value'] = np.arange(3.0)\n"
                                "g.create_dataset('t', (3,), 'f8', external=[('" +
                                other + "', 0, 24)])")),
              HasSubstr("in another file, which is not followed"));
  EXPECT_THAT(complaint(made_by("g = f.create_group('signals/omega')\ng['value'] = np.arange(3.0)\n"
                                "l = h5py.VirtualLayout((3,), 'f8')\nl[:] = h5py.VirtualSource('" +
                                other + "', 't', (3,))\ng.create_virtual_dataset('t', l)")),
              HasSubstr("in another file, which is not followed"));
  EXPECT_EQ(read_hdf5(made_by("g = f.create_group('signals/omega')\ng['value'] = np.arange(3.0)\n"
                              "f['t'] = np.arange(3.0)\ng['t'] = h5py.SoftLink('/t')"))
                .runs.at(0)
                .at(Signal::omega)
                .t.size(),
            3u)
      << "a link within the file is as good as what it leads to";
}

/// The library that reads HDF5 crashes on some of these; a reader of sessions does not.
TEST_F(Hdf5, NoChangedByteCrashesTheReader) {
  write_hdf5(path("s.h5"), sample());
  made_by(
      "f.attrs['note'] = 'x' * 100\ng = f.create_group('signals/omega')\ng['value'] = np.arange(3.0)\n"
      "g['t'] = np.arange(3.0)\ng['value'].attrs['unit'] = 'rad/s'");
  std::mt19937 random(20);
  int read = 0, refused = 0, died = 0;
  for (const char* name : {"s.h5", "made.h5"}) {
    const std::string whole = Scratch::read(path(name));
    for (int i = 0; i < 400; ++i) {
      std::string changed = whole;
      for (int bytes = 1 + i % 2; bytes > 0; --bytes) changed[random() % whole.size()] = static_cast<char>(random());
      const auto file = write("changed.h5", changed);
      try {
        read_hdf5(file);
        ++read;
      } catch (const SessionError& e) {
        ++refused;
        died += std::string(e.what()).find("is damaged: reading it") != std::string::npos;
      }
    }
  }
  EXPECT_EQ(read + refused, 800);
  RecordProperty("children_that_died", died);
}

TEST_F(Hdf5, AReaderThatCrashesOrNeverEndsIsAMessage) {
  const auto file = write("s.h5", "x");
  const auto why = [&](const std::function<void()>& work) {
    return message_of<SessionError>([&] {
      read_in_child(file, [&](const auto&) {
        work();
        return Session();
      });
    });
  };
  EXPECT_THAT(why([] { raise(SIGSEGV); }), HasSubstr("s.h5: is damaged: reading it fails (SIGSEGV)"));
  EXPECT_THAT(why([] { abort(); }), HasSubstr("s.h5: is damaged"));
  EXPECT_THAT(why([] { _exit(0); }), HasSubstr("s.h5: is damaged: reading it fails"));
  EXPECT_EQ(why([] { throw SessionError("as it was said"); }), "as it was said");
}

}  // namespace
}  // namespace emtb
