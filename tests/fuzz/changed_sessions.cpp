// Sessions with a few things changed, read one after the other: the child that reads them may die, the caller may not.
//
//     changed_sessions [--times N] [--seed N] [--keep FOLDER]
//
// Seeds are the sessions of tests/fuzz/corpus/hdf5. What kills a child is kept, one file for each way to die, where
// --keep says. Exit 1 where the reader did what it must not.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "hal/error.h"
#include "session/hdf5.h"
#include "tests/fuzz/file_of.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::uint64_t times = 1000;
  unsigned seed = 1;
  fs::path keep{};
};

std::vector<std::string> seeds() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(EMTB_CORPUS) / "hdf5")) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<std::string> texts;
  for (const fs::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return texts;
}

/// One to four things changed: bytes, bits, numbers, cuts, pieces copied over others or emptied.
std::string changed(std::string text, std::mt19937& random) {
  static constexpr std::array<unsigned char, 8> hard{0, 1, 0x7f, 0x80, 0xff, 8, 0x20, 0xfe};
  for (unsigned n = 1 + random() % 4; n > 0; --n) {
    const std::size_t at = random() % text.size();
    const std::size_t size = std::min<std::size_t>(1 + random() % 16, text.size() - at);
    switch (random() % 8) {
      case 0:
        text[at] = static_cast<char>(text[at] ^ static_cast<char>(1U << random() % 8));
        break;
      case 1:
        std::fill_n(text.begin() + static_cast<std::ptrdiff_t>(at), size, random() % 2 == 0 ? '\0' : '\xff');
        break;
      case 2:
        text.replace(at, size, text, random() % (text.size() - size), size);
        break;
      case 3:
        if (random() % 8 == 0) text.resize(std::max<std::size_t>(at, 1));
        break;
      case 4:
        text[at] = static_cast<char>(hard[random() % hard.size()]);
        break;
      default:
        text[at] = static_cast<char>(random());
    }
  }
  return text;
}

/// `SIGSEGV` of a message of a child that died; empty: it only refused
std::string death_of(const std::string& why) {
  const std::size_t at = why.find("is damaged: reading it");
  if (at == std::string::npos) return {};
  const std::size_t open = why.find("(SIG", at), close = why.find(')', at);
  return open == std::string::npos || close == std::string::npos ? "exit" : why.substr(open + 1, close - open - 1);
}

int run(const Options& options) {
  const std::vector<std::string> sessions = seeds();
  std::mt19937 random(options.seed);
  std::map<std::string, std::uint64_t> count;
  double slowest = 0;  // [s]
  for (std::uint64_t n = 0; n < options.times; ++n) {
    const std::string text = changed(sessions[n % sessions.size()], random);
    const auto begun = std::chrono::steady_clock::now();
    try {
      const FileOf file(text);
      read_hdf5(file.path());
      ++count["read"];
    } catch (const SessionError& e) {
      const std::string death = death_of(e.what());
      if (++count[death.empty() ? "refused" : death] == 1 && !death.empty() && !options.keep.empty()) {
        std::ofstream(options.keep / ("found-" + death), std::ios::binary) << text;
      }
    } catch (const std::exception& e) {
      std::ofstream("broken.h5", std::ios::binary) << text;
      std::printf("session %llu, kept as broken.h5: %s\n", static_cast<unsigned long long>(n), e.what());
      return 1;
    }
    slowest = std::max(slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  }
  for (const auto& [what, times] : count)
    std::printf("%s: %llu\n", what.c_str(), static_cast<unsigned long long>(times));
  std::printf("slowest: %.1f s\n", slowest);
  return 0;
}

}  // namespace
}  // namespace emtb::fuzz

int main(int argc, char** argv) {
  emtb::fuzz::Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    if (word == "--times") options.times = std::stoull(argv[i + 1]);
    if (word == "--seed") options.seed = static_cast<unsigned>(std::stoul(argv[i + 1]));
    if (word == "--keep") options.keep = argv[i + 1];
  }
  return emtb::fuzz::run(options);
}
