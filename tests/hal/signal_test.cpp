#include "hal/signal.h"

#include <gtest/gtest.h>

#include <set>

namespace emtb {
namespace {

TEST(Signals, KeepTheirOrder) {
  ASSERT_EQ(all_signals().size(), signal_count);
  for (std::size_t i = 0; i < signal_count; ++i) EXPECT_EQ(index(all_signals()[i]), i);
}

TEST(Signals, AreFoundByNameAndByColumn) {
  for (const Signal signal : all_signals()) {
    EXPECT_EQ(signal_named(info(signal).name), signal);
    EXPECT_EQ(signal_of_column(info(signal).column), signal);
  }
}

TEST(Signals, NamesAndColumnsAreUniqueAndColumnsBeginWithTheName) {
  std::set<std::string_view> names;
  std::set<std::string_view> columns;
  for (const Signal signal : all_signals()) {
    EXPECT_TRUE(names.insert(info(signal).name).second);
    EXPECT_TRUE(columns.insert(info(signal).column).second);
    EXPECT_TRUE(info(signal).column.starts_with(info(signal).name));
    EXPECT_FALSE(info(signal).unit.empty());
    EXPECT_FALSE(info(signal).meaning.empty());
  }
}

TEST(Signals, UnknownNamesAreNothing) {
  EXPECT_FALSE(signal_named("speed"));
  EXPECT_FALSE(signal_named(""));
  EXPECT_FALSE(signal_named("i_a_A")) << "a column is not a name";
  EXPECT_FALSE(signal_of_column("i_a")) << "a name is not a column";
}

}  // namespace
}  // namespace emtb
