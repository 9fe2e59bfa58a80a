#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "hal/error.h"

namespace emtb {

/// A text with a few things changed, as a fuzzer would: bytes, cuts, doubled parts, words that are hard to read.
inline std::string mutated(std::string text, std::mt19937& random) {
  static const std::vector<std::string> hard{std::string(1, '\0'),
                                             "\xff",
                                             "nan",
                                             "-inf",
                                             "1e308",
                                             "1e-320",
                                             "{",
                                             "[",
                                             "]]",
                                             ": ",
                                             "\n",
                                             "\r",
                                             "\t",
                                             "\"",
                                             "'",
                                             "&a",
                                             "*a",
                                             "<<: ",
                                             "--- ",
                                             "!!binary ",
                                             "\x1b[31m",
                                             "99999999999999999999",
                                             ",",
                                             ";",
                                             "#",
                                             "((((((((((",
                                             "\xe2\x80\xa8",
                                             "null",
                                             "~"};
  for (unsigned i = 1 + random() % 4; i > 0; --i) {
    const std::size_t at = text.empty() ? 0 : random() % text.size();
    const std::size_t size = text.empty() ? 0 : std::min<std::size_t>(random() % 30, text.size() - at);
    switch (random() % 6) {
      case 0:
        if (!text.empty()) text[at] = static_cast<char>(random());
        break;
      case 1:
        text.erase(at, size);
        break;
      case 2:
        text.insert(at, text.substr(at, size));
        break;
      case 3:
        text.resize(at);
        break;
      default:
        text.insert(at, hard[random() % hard.size()]);
    }
  }
  return text;
}

/// Reads `times` mutations of the seeds: each is read, or refused by an Error of one line. Nothing else may happen.
/// @return how many were refused
template <class Read>
int read_mutations(const std::vector<std::string>& seeds, int times, Read read) {
  std::mt19937 random(2011);
  int refused = 0;
  for (int i = 0; i < times; ++i) {
    const std::string text = mutated(seeds[static_cast<std::size_t>(i) % seeds.size()], random);
    try {
      read(text);
    } catch (const Error& e) {
      ++refused;
      const std::string why = e.what();
      EXPECT_EQ(why.find('\n'), std::string::npos) << "mutation " << i << ": " << why;
      EXPECT_LT(why.size(), 2000U) << "mutation " << i;
    } catch (const std::exception& e) {
      ADD_FAILURE() << "mutation " << i << " ends in something that is no message: " << e.what() << "\n" << text;
    }
  }
  return refused;
}

}  // namespace emtb
