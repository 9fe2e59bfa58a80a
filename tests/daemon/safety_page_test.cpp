#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "hal/fault.h"

namespace emtb {
namespace {

/// Number and name of each row of the fault table: `| 101 | over_speed | ... |`.
std::map<int, std::string> fault_table() {
  std::ifstream in(EMTB_DOCS "/safety.md");
  std::map<int, std::string> rows;
  std::string line;
  while (std::getline(in, line)) {
    int number = 0;
    char name[64] = "";
    if (std::sscanf(line.c_str(), "| %d | `%63[a-z_]` |", &number, name) == 2) rows[number] = name;
  }
  return rows;
}

TEST(SafetyPage, ListsEveryFaultByItsNumberAndNoOther) {
  std::map<int, std::string> faults;
  for (const Fault fault : all_faults) {
    const std::string words(text(fault));
    faults[static_cast<int>(fault)] = words.substr(0, words.find(':'));
  }
  EXPECT_EQ(fault_table(), faults);
}

}  // namespace
}  // namespace emtb
