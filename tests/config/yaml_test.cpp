#include "config/yaml.h"

#include <limits>

#include "tests/config/complains.h"
#include "tests/temporary_file.h"

namespace emtb {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

YamlMap yaml(const std::string& text) { return YamlMap::parse(text, "f.yaml"); }

TEST(Yaml, ReadsWhatIsThere) {
  const YamlMap map = yaml("n: 1.5e-3\nt: words\nf: true\nl: [1, -2]\nm: {a: 1}\ns: [{a: 1}, {a: 2}]\n");
  EXPECT_DOUBLE_EQ(map.number("n"), 1.5e-3);
  EXPECT_EQ(map.text("t"), "words");
  EXPECT_TRUE(map.flag_or("f", false));
  EXPECT_THAT(map.numbers("l"), ElementsAre(1, -2));
  EXPECT_DOUBLE_EQ(map.map("m").number("a"), 1);
  ASSERT_EQ(map.maps("s").size(), 2U);
  EXPECT_DOUBLE_EQ(map.maps("s")[1].number("a"), 2);
  EXPECT_THAT(map.keys(), ElementsAre("n", "t", "f", "l", "m", "s"));
}

TEST(Yaml, FallsBackOnlyWhereTheKeyIsAbsent) {
  const YamlMap map = yaml("n: 2\nbad: x\n");
  EXPECT_DOUBLE_EQ(map.number_or("n", 7), 2);
  EXPECT_DOUBLE_EQ(map.number_or("other", 7), 7);
  EXPECT_DOUBLE_EQ(map.within_or("other", 0, 1, 7), 7);
  EXPECT_EQ(map.text_or("other", "t"), "t");
  EXPECT_TRUE(map.flag_or("other", true));
  EXPECT_FALSE(map.map_if("other"));
  EXPECT_TRUE(map.maps("other").empty());
  EXPECT_NE(complaint([&] { map.number_or("bad", 7); }), "");
}

TEST(Yaml, ComplaintsNameFileLineAndKey) {
  const YamlMap map = yaml("# comment\nouter:\n  inner:\n    a: x\n    b: 2\n");
  const YamlMap inner = map.map("outer").map("inner");
  EXPECT_EQ(complaint([&] { inner.number("a"); }), "f.yaml:4: outer.inner.a must be a number, not `x`");
  EXPECT_EQ(complaint([&] { inner.number("c"); }), "f.yaml:4: outer.inner.c is missing");
  EXPECT_EQ(complaint([&] { inner.only({"a", "c"}); }), "f.yaml:5: outer.inner.b is not known here. Known: a, c");
}

TEST(Yaml, TheLineIsTheKeysNotItsValues) {
  const YamlMap map = yaml("a: 1\nlimits:\n  omega: 3\n");
  EXPECT_THAT(complaint([&] { map.only({"a"}); }), StartsWith("f.yaml:2: limits "));
}

TEST(Yaml, WrongTypes) {
  const YamlMap map = yaml("n: [1]\nempty:\nword: x\nhex: 1e400\nnan: .nan\ninf: .inf\nlist: [1, x]\nmap: {a: 1}\n");
  EXPECT_EQ(complaint([&] { map.number("n"); }), "f.yaml:1: n must be a number");
  EXPECT_EQ(complaint([&] { map.number("empty"); }), "f.yaml:2: empty must be a number");
  EXPECT_EQ(complaint([&] { map.number("hex"); }), "f.yaml:4: hex must be a number, not `1e400`");
  EXPECT_EQ(complaint([&] { map.number("nan"); }), "f.yaml:5: nan must be finite");
  EXPECT_EQ(complaint([&] { map.number("inf"); }), "f.yaml:6: inf must be finite");
  EXPECT_EQ(complaint([&] { map.numbers("list"); }), "f.yaml:7: list must be a number, not `x`");
  EXPECT_EQ(complaint([&] { map.numbers("word"); }), "f.yaml:3: word must be a list of numbers, e.g. [1, 2, 3]");
  EXPECT_EQ(complaint([&] { map.text("map"); }), "f.yaml:8: map must be a text");
  EXPECT_EQ(complaint([&] { map.text("empty"); }), "f.yaml:2: empty must be a text");
  EXPECT_EQ(complaint([&] { map.flag_or("word", true); }), "f.yaml:3: word must be true or false");
  EXPECT_THAT(complaint([&] { map.map("word"); }), HasSubstr("word must be a map"));
  EXPECT_THAT(complaint([&] { map.maps("word"); }), HasSubstr("word must be a list"));
  EXPECT_THAT(complaint([&] { map.maps("list"); }), HasSubstr("list must be a list of maps"));
}

TEST(Yaml, NumbersOutOfRange) {
  const YamlMap map = yaml("zero: 0\nbig: 8\n");
  EXPECT_EQ(complaint([&] { map.positive("zero"); }), "f.yaml:1: zero is 0, but must be above 0");
  EXPECT_EQ(complaint([&] { map.within("big", 0, 6); }), "f.yaml:2: big is 8, but must be 0 to 6");
  EXPECT_EQ(complaint([&] { map.within("zero", 1, std::numeric_limits<double>::infinity()); }),
            "f.yaml:1: zero is 0, but must be 1 or more");
  EXPECT_DOUBLE_EQ(map.within("big", 8, 8), 8);
}

TEST(Yaml, AKeyMayStandOnce) {
  EXPECT_EQ(complaint([] { yaml("a: 1\nb: 2\na: 3\n"); }), "f.yaml:3: a stands twice. Keep one");
  const YamlMap outer = yaml("m:\n  x: {a: 1}\n  x: {a: 2}\n");
  EXPECT_EQ(complaint([&] { outer.map("m"); }), "f.yaml:3: m.x stands twice. Keep one");
}

TEST(Yaml, WhatIsNotOneMap) {
  EXPECT_THAT(complaint([] { yaml("- 1\n- 2\n"); }), HasSubstr("f.yaml:1: must be a map"));
  EXPECT_THAT(complaint([] { yaml("just words"); }), HasSubstr("must be a map"));
  EXPECT_EQ(complaint([] { yaml(""); }), "f.yaml:1: is empty. Write `key: value` lines");
  EXPECT_EQ(complaint([] { yaml("# only a comment\n"); }).substr(0, 8), "f.yaml:1");
  EXPECT_EQ(complaint([] { yaml("a: 1\n---\nb: 2\n"); }), "f.yaml:3: starts a second document. Keep one in a file");
  EXPECT_THAT(complaint([] { yaml("[1, 2]: 3\n"); }), HasSubstr("a key that is not a plain word"));
}

TEST(Yaml, WhatIsNotYaml) {
  EXPECT_THAT(complaint([] { yaml("a: 1\nb: [1, 2\n"); }), HasSubstr("not YAML"));
  EXPECT_THAT(complaint([] { yaml("a: 1\n\tb: 2\n"); }), StartsWith("f.yaml:2: not YAML"));
  EXPECT_THAT(complaint([] { yaml("a: *nowhere\n"); }), HasSubstr("not YAML"));
  EXPECT_NE(complaint([] { yaml(std::string(5000, '[')); }), "") << "deep nesting must not end the process";
}

TEST(Yaml, FilesThatCannotBeRead) {
  EXPECT_EQ(complaint([] { YamlMap::load("no/such.yaml"); }),
            "no/such.yaml: cannot be read: no such file. Give the path of a YAML file");
  EXPECT_THAT(complaint([] { YamlMap::load("."); }), HasSubstr("cannot be read"));
}

TEST(Yaml, AnEmptyFileIsEmptyNotUnreadable) {
  const TemporaryFile file(".yaml", "");
  EXPECT_THAT(complaint([&] { YamlMap::load(file.path()); }), HasSubstr(":1: is empty"));
}

TEST(Yaml, NoTextMakesDocumentsWithoutEnd) {
  for (const char* text : {",a: b\n", "]", "}\n", "a: 1\n]\n", ", , ,"}) {
    EXPECT_THROW(YamlMap::parse(text, "f.yaml"), ConfigError) << text;
  }
}

}  // namespace
}  // namespace emtb
